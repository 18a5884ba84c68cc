"""The file formats of programs: which there are, and which one a suffix names.

A further format is a module of this package with a `Format` and a line in `FORMATS`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from robojoule.errors import InputError
from robojoule.formats.position_files import PositionFiles
from robojoule.formats.tree_files import TreeFiles
from robojoule.inputs import as_path
from robojoule.programs.program import Program


class Format(Protocol):
    """A kind of file that holds programs.

    Attributes:
        name: What it is called.
        suffixes: Suffixes of its files, in lower case, with the dot.
    """

    name: str
    suffixes: tuple[str, ...]

    def read(self, path: Path) -> Program:
        """Read a file.

        Raises:
            InputError: The file cannot be read, or does not hold a program; names the place in the file.
        """

    def write(self, program: Program, path: Path) -> None:
        """Write a file, atomically.

        Raises:
            InputError: The format cannot hold the program, or the file cannot be written.
        """


FORMATS: tuple[Format, ...] = (TreeFiles(), PositionFiles())


def format_of(path: str | Path) -> Format:
    """The format that a file's suffix names.

    Raises:
        InputError: There is no such format; names those that there are.
    """
    suffix = Path(path).suffix.lower()
    for found in FORMATS:
        if suffix in found.suffixes:
            return found
    known = ", ".join(f"{', '.join(one.suffixes)} ({one.name})" for one in FORMATS)
    raise InputError(f"unknown file type '{suffix}'", file=path, allowed=known)


def load_program(path: str | Path) -> Program:
    """Read a program from a file of any known format.

    Args:
        path: Operation tree (YAML, JSON) or joint positions (CSV).

    Raises:
        InputError: Unknown suffix, unreadable file, or a file that does not hold a program.
    """
    file = as_path(path, "path")
    return format_of(file).read(file)
