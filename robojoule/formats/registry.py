"""The file formats of programs: which there are, and which one a suffix names.

A further format is a module of this package with a `Format` and a line in `FORMATS`.
"""

from __future__ import annotations

from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.format import Format
from robojoule.formats.position_files import PositionFiles
from robojoule.formats.tree_files import TreeFiles

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
