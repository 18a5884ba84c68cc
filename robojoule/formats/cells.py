"""Files of cells: which kinds there are, told apart by their suffix and by what they say they are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.documents import data_of, read_document_text
from robojoule.errors import InputError, refuse
from robojoule.formats.cell_files import cell_of
from robojoule.formats.cell_xml import read_cells as read_benchmark
from robojoule.formats.line_numbers import with_lines
from robojoule.inputs import as_path, shown
from robojoule.programs.cell import Cell

if TYPE_CHECKING:
    from robojoule.formats.robot_cell import RobotCell

SUFFIXES = {".xml": "published benchmark", ".yaml": "cell file", ".yml": "cell file", ".json": "cell file"}
ROBOT_CELL = "robojoule-robot-cell"


def load_cells(path: str | Path) -> tuple[Cell | RobotCell, ...]:
    """Read the cells of a file: one of a cell file (YAML, JSON), one or more of the published benchmark (XML).

    Raises:
        InputError: Unknown suffix, unreadable file, or a file that does not hold cells; names the place.
    """
    file = as_path(path, "path")
    suffix = file.suffix.lower()
    if suffix not in SUFFIXES:
        allowed = ", ".join(f"{one} ({what})" for one, what in SUFFIXES.items())
        raise InputError(f"unknown file type {shown(suffix)}", file=file, allowed=allowed)
    if suffix == ".xml":
        return read_benchmark(file)
    text = read_document_text(file)
    data = data_of(text, file)
    try:
        if isinstance(data, dict) and data.get("format") == ROBOT_CELL:
            from robojoule.formats.robot_cell_files import robot_cell_of  # late: brings robots

            return (robot_cell_of(data, file),)
        return (cell_of(data, file),)
    except InputError as error:
        if error.file != str(file):  # that of a program or of a robot
            raise
        refuse(with_lines(error, text))
        raise
