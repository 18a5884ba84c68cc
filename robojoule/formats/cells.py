"""Files of cells: which kinds there are, told apart by their suffix."""

from __future__ import annotations

from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.cell_files import read_cell
from robojoule.formats.cell_xml import read_cells as read_benchmark
from robojoule.inputs import as_path, shown
from robojoule.programs.cell import Cell

SUFFIXES = {".xml": "published benchmark", ".yaml": "cell file", ".yml": "cell file", ".json": "cell file"}


def load_cells(path: str | Path) -> tuple[Cell, ...]:
    """Read the cells of a file: one of a cell file (YAML, JSON), one or more of the published benchmark (XML).

    Raises:
        InputError: Unknown suffix, unreadable file, or a file that does not hold cells; names the place.
    """
    file = as_path(path, "path")
    suffix = file.suffix.lower()
    if suffix not in SUFFIXES:
        allowed = ", ".join(f"{one} ({what})" for one, what in SUFFIXES.items())
        raise InputError(f"unknown file type {shown(suffix)}", file=file, allowed=allowed)
    return read_benchmark(file) if suffix == ".xml" else (read_cell(file),)
