"""Files of vendors' programs as formats of the registry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.format import Reading
from robojoule.formats.vendor.source import VendorSource
from robojoule.formats.vendor.trace import Beside, VendorProgram
from robojoule.programs.operation_tree import OperationTree


@dataclass(frozen=True)
class VendorFiles:
    """Files in a vendor's language; see `robojoule.formats.format.Format`.

    Attributes:
        name: What the language is called.
        suffixes: Suffixes of its files, in lower case, with the dot.
        parse: Reads a file, and those that go with it.
    """

    name: str
    suffixes: tuple[str, ...]
    parse: Callable[[Path], VendorProgram]

    def source(self, path: Path, beside: Beside | None = None) -> VendorSource:
        """Read a program without saying yet for which robot.

        Raises:
            InputError: A file cannot be read.
        """
        return VendorSource(self.parse(path), beside or Beside())

    def read(self, path: Path) -> Reading:
        """Read a program that needs no robot; see `robojoule.formats.format.Format`."""
        source = self.source(path)
        return Reading(source.resolution.tree, source.resolution.places, source.program.sources[0].text)

    def write(self, tree: OperationTree, path: Path, text: str | None = None) -> None:
        """Write a new program; see `robojoule.formats.format.Format`."""
        problem = f"the program was not read from a file of this kind ({self.name})"
        raise InputError(problem, file=path, allowed="the format that it was read from, YAML, JSON or CSV")
