"""Files of vendors' programs as formats of the registry."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from robojoule.documents import write_files
from robojoule.errors import InputError
from robojoule.formats.format import Reading
from robojoule.formats.joint_motions import as_joint_motions
from robojoule.formats.vendor.composing import Compose
from robojoule.formats.vendor.source import VendorSource
from robojoule.formats.vendor.text import numbers_in_bounds
from robojoule.formats.vendor.trace import Beside, VendorProgram
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.robot import Robot


@dataclass(frozen=True)
class VendorFiles:
    """Files in a vendor's language; see `robojoule.formats.format.Format`.

    Attributes:
        name: What the language is called.
        suffixes: Suffixes of its files, in lower case, with the dot.
        parse: Reads a file, and those that go with it.
        compose: Makes the texts of a new program; None: new programs are not made.
        companions: Suffixes of files that are read and written with one, in lower case, with the dot.
        speed_step_percent: Step of speed limits that plans take: fine where the language has speeds or durations. [%]
    """

    name: str
    suffixes: tuple[str, ...]
    parse: Callable[[Path], VendorProgram]
    compose: Compose | None = None
    companions: tuple[str, ...] = ()
    speed_step_percent: float = 1.0

    def companions_of(self, path: Path) -> tuple[Path, ...]:
        """Files that go with one, as far as they are there."""
        names = (path.with_suffix(made) for one in self.companions for made in (one, one.upper(), one.title()))
        return tuple({name.resolve(): name for name in names if name.is_file()}.values())

    def check_companions(self, path: Path, written: Collection[str], key: str | None = None) -> None:
        """Refuse a file to write beside which there is one that would go with it, and is another program's.

        Args:
            path: File to write.
            written: Suffixes of what is written with it, in lower case: where the file is there already, these belong
                to it, and are replaced together with it.
            key: How messages name the file to write.

        Raises:
            InputError: There is one.
        """
        for beside in self.companions_of(path):
            if beside.suffix.lower() not in written or not path.exists():
                problem = f"this file would go with '{path.name}', and is there already"
                raise InputError(problem, file=beside, key=key, allowed="another name for the program, or no such file")

    def source(self, path: Path, beside: Beside | None = None) -> VendorSource:
        """Read a program without saying yet for which robot.

        Raises:
            InputError: A file cannot be read.
        """
        with numbers_in_bounds(path):
            return VendorSource(self.parse(path), beside or Beside())

    def read(self, path: Path) -> Reading:
        """Read a program that needs no robot; see `robojoule.formats.format.Format`."""
        source = self.source(path)
        return Reading(source.resolution.tree, source.resolution.places, source.program.sources[0].text)

    def write(self, tree: OperationTree, path: Path, text: str | None = None) -> None:
        """Write a new program; see `robojoule.formats.format.Format`."""
        self.create(tree, path, None)

    def create(self, tree: OperationTree, path: Path, robot: Robot | None) -> tuple[str, ...]:
        """Write a new program, with the files that go with it beside it.

        Args:
            tree: What it does.
            path: File to write.
            robot: Robot that executes it, where the language needs its figures.

        Returns:
            What the language cannot say, a sentence each.

        Raises:
            InputError: New programs of the language are not made, or the language needs a robot.
        """
        if self.compose is None:
            problem = f"new programs of this kind ({self.name}) are not made"
            raise InputError(problem, file=path, allowed="the format that the program was read from, or another one")
        try:
            tree, unsaid = as_joint_motions(tree, robot)
            made = self.compose(tree, robot, path.stem)
        except InputError as error:
            raise InputError(error.problem, file=path, key=error.key, allowed=error.allowed) from None
        self.check_companions(path, list(made.texts))
        names = [path, *(path.with_suffix(suffix) for suffix in list(made.texts)[1:])]
        write_files({name: text.encode("utf-8") for name, text in zip(names, made.texts.values(), strict=True)})
        return (*unsaid, *made.lost)
