"""Joint positions as CSV: the first row is the start of the cycle, each further one the target of a fine move.

The header names the columns, in any order: `q1_deg ..` or `q1_rad ..`, one per joint; `name`, `speed_limit_percent`,
`wait_before_s`, `wait_after_s`, the other settings of moves, `robot` and `angles` may be left out. Cells are separated
by commas and stripped; empty rows are skipped; an empty cell of a setting is the default. The program is called after
the file; the first row names the robot that it is written for, if it is for one alone, and says whether its angles are
those of the robot's model (the default) or of its pendant.
"""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from robojoule.documents import decoded, read_bytes, with_plain_line_ends, write_text
from robojoule.errors import InputError
from robojoule.formats.exact_degrees import in_exact_degrees
from robojoule.formats.format import Reading
from robojoule.formats.table_text import text_with_columns
from robojoule.formats.tree_text import number_text
from robojoule.inputs import LONGEST_S, counted, number_of, shown
from robojoule.programs.operation_tree import (
    LEAST_SPEED_PERCENT,
    PLANNED,
    MoveOperation,
    OperationTree,
    tree_from_configurations,
)
from robojoule.robots.pendant_file import ANGLES

_SETTINGS: dict[str, Any] = {**PLANNED, "least_speed_percent": None, "fixed": False}  # with their defaults
_ALWAYS = ("speed_limit_percent", "wait_before_s", "wait_after_s")  # written even where all are defaults
_WORDS = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
_COLUMNS = (
    "q1_deg .. or q1_rad .., name, robot, angles, speed_limit_percent, least_speed_percent, fixed, "
    "[added_]wait_before_s, [added_]wait_after_s"
)
_JOINT = re.compile(r"q([1-9]\d?)_(deg|rad)")


class PositionFiles:
    """CSV files of joint positions; see the module's text."""

    name = "joint positions"
    suffixes: tuple[str, ...] = (".csv",)
    speed_step_percent = 1.0

    def read(self, path: Path) -> Reading:
        """Read a file; see `robojoule.formats.format.Format`."""
        return self._reading(decoded(read_bytes(path), path), path)

    def _reading(self, text: str, path: Path) -> Reading:
        """What the text of a file holds."""
        header, *rows = _rows(text, path)
        joints = _joint_columns(header)
        if len(rows) < 2:
            raise InputError("there is no move: the first row is the start of the cycle", file=path)
        start, *targets = rows
        for column, default in _SETTINGS.items():
            if start.setting(column) != default:
                raise start.error(column, "the first row is the start of the cycle, not a move", "an empty cell")
        for row in targets:
            for column in ("robot", "angles"):
                if row.cells.get(column):
                    what = "the robot is" if column == "robot" else "angles are"
                    raise row.error(column, f"{what} named in the first row alone", "an empty cell")
        angles = start.cells.get("angles") or ANGLES[0]
        if angles not in ANGLES:
            raise start.error("angles", f"unknown angles {shown(angles)}", ", ".join(ANGLES))
        positions = [[row.number(column) for column in joints] for row in rows]
        if joints[0].endswith("deg"):
            positions = [[math.radians(value) for value in row] for row in positions]
        names = _names(targets) if "name" in header.cells else None
        try:
            tree = tree_from_configurations(
                path.stem.strip(), positions, start.cells.get("robot") or None, move_names=names
            )
        except ValidationError as error:  # a name of the file, the robot or a move that no program may have
            details = error.errors(include_url=False)[0]
            raise InputError(f"{details['msg']} (found {shown(details['input'])})", file=path) from None
        if start.cells.get("angles"):
            tree = tree.model_copy(update={"angles": angles})
        moves = dict(zip((move.name for move in tree.moves()), targets, strict=True))
        settings = {name: {column: row.setting(column) for column in _SETTINGS} for name, row in moves.items()}
        for row in targets:
            row.check_speeds()
        places = {f"operations.{move}.target_rad": f"line {row.line}" for move, row in enumerate(targets)}
        return Reading(
            tree.with_settings(settings),
            {"robot": f"line {start.line}, column robot", "start_rad": f"line {start.line}", **places},
            text,
        )

    def write(self, tree: OperationTree, path: Path, text: str | None = None) -> None:
        """Write a file; see `robojoule.formats.format.Format`.

        Angles are in degrees if these read as the very same positions, as they do where they come from degrees.
        """
        moves = _flat_moves(tree, path)
        kept = None if text is None else self._kept(text, moves, tree.angles, path)
        held = None if kept is None else self._reading(kept, path).tree
        if kept is not None and held is not None and (held.operations, held.angles) == (tree.operations, tree.angles):
            write_text(path, kept)
            return
        unit, positions = _positions([tree.start_rad, *(move.target_rad for move in moves)])
        joints = [f"q{joint}_{unit}" for joint in range(1, len(positions[0]) + 1)]
        said = {} if tree.robot is None else {"robot": tree.robot}
        said |= {} if tree.angles == "model" else {"angles": tree.angles}
        used = [k for k, default in _SETTINGS.items() if k in _ALWAYS or any(getattr(m, k) != default for m in moves)]
        settings = [said, *({"name": move.name} | {key: _cell(getattr(move, key)) for key in used} for move in moves)]
        table = io.StringIO()
        writer = csv.DictWriter(table, ["name", *joints, *used, *said], restval="", lineterminator="\n")
        writer.writeheader()
        for row, values in zip(settings, positions, strict=True):
            writer.writerow(row | dict(zip(joints, values, strict=True)))
        write_text(path, table.getvalue())

    def _kept(self, text: str, moves: list[MoveOperation], angles: str, path: Path) -> str | None:
        """The text with other speed limits and waits; None if it has other moves."""
        _, start, *rows = _rows(text, path)
        if len(rows) != len(moves):
            return None
        columns: dict[str, list[str | None]] = {}
        if angles != (start.cells.get("angles") or ANGLES[0]):
            columns["angles"] = [angles, *[None if "angles" in start.cells else ""] * len(moves)]
        for key in PLANNED:
            wanted = [getattr(move, key) for move in moves]
            there = [row.setting(key) for row in rows]
            if wanted != there:
                cells = [
                    None if new == old else "" if new is None else number_text(float(new))
                    for new, old in zip(wanted, there, strict=True)
                ]
                columns[key] = [None if key in start.cells else "", *cells]
        return text_with_columns(text, columns)


@dataclass(frozen=True)
class _Row:
    """One row of a file: its line and its cells by column; the header's cells are the columns themselves."""

    path: Path
    line: int
    cells: dict[str, str]

    def error(self, column: str | None, problem: str, allowed: str | None = None) -> InputError:
        """A refusal that names file, line and column."""
        place = f"line {self.line}" + (f", column {column}" if column else "")
        return InputError(problem, file=self.path, key=place, allowed=allowed)

    def number(self, column: str, default: float | None = None) -> float:
        """A cell as a number; `default` where the cell is empty or there is no such column."""
        text = self.cells.get(column, "")
        if not text:
            if default is None:
                raise self.error(column, "the cell is empty", "a number")
            return default
        try:
            return number_of(text)
        except ValueError as error:
            raise self.error(column, str(error), "digits with a decimal point") from None

    def setting(self, column: str) -> Any:
        """A speed limit, a wait or whether the move is fixed, checked."""
        if not self.cells.get(column):
            return _SETTINGS[column]
        if column == "fixed":
            if (word := self.cells[column].lower()) not in _WORDS:
                raise self.error(column, f"{shown(word)} does not say whether the move is fixed", ", ".join(_WORDS))
            return _WORDS[word]
        value = self.number(column)
        is_limit = column.endswith("_percent")
        least, most, what = (LEAST_SPEED_PERCENT, 100.0, "speed limit") if is_limit else (0.0, LONGEST_S, "wait")
        if not least <= value <= most:
            raise self.error(column, f"{value:g} is not a valid {what}", f"{least:g} to {most:g}")
        return value

    def check_speeds(self) -> None:
        """Refuse a least speed above the speed limit."""
        least, most = self.setting("least_speed_percent"), self.setting("speed_limit_percent")
        if least is not None and least > most:
            raise self.error("least_speed_percent", f"{least:g} is more than the speed limit", f"at most {most:g}")


def _cell(value: Any) -> Any:
    """A setting as it is written."""
    if isinstance(value, bool):
        return "yes" if value else ""
    return "" if value is None else value


def _rows(text: str, path: Path) -> list[_Row]:
    """The header and the rows below it."""
    reader = csv.reader(io.StringIO(with_plain_line_ends(text)), strict=True)
    try:
        found = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader]
    except csv.Error as error:
        raise InputError(f"the row cannot be read ({error})", file=path, key=f"line {reader.line_num}") from None
    found = [(line, cells) for line, cells in found if any(cells)]
    if not found:
        raise InputError("the file is empty", file=path, allowed=_COLUMNS)
    line, columns = found[0]
    header = _Row(path, line, {column: column for column in columns})
    if len(columns) == 1 and re.search(r"[;\t|]", columns[0]):
        raise header.error(None, "the columns are not separated by commas", "commas, and decimal points in numbers")
    for place, column in enumerate(columns):
        if column in columns[:place]:
            raise header.error(column or str(place + 1), "the column appears twice")
    for line, cells in found[1:]:
        if len(cells) != len(columns):
            problem = f"the header names {counted(len(columns), 'column')}, but the row has {len(cells)}"
            raise InputError(problem, file=path, key=f"line {line}")
    return [header, *(_Row(path, line, dict(zip(columns, cells, strict=True))) for line, cells in found[1:])]


def _joint_columns(header: _Row) -> list[str]:
    """Columns of the joints in their order; refuses unknown and missing columns."""
    joints: dict[int, str] = {}
    units: list[str] = []
    for column in header.cells:
        match = _JOINT.fullmatch(column)
        if match is not None:
            joints[int(match[1])] = column
            units.append(match[2])
            if match[2] != units[0]:
                raise header.error(column, "positions are given in degrees and in radians", "one unit for all joints")
        elif column not in ("name", "robot", "angles", *_SETTINGS):
            raise header.error(column or None, "unknown column" if column else "a column has no name", _COLUMNS)
    if not joints:
        raise header.error(None, "there are no joint positions", _COLUMNS)
    for number in range(1, max(joints)):
        if number not in joints:
            raise header.error(f"q{number}_{units[0]}", "the column is missing")
    return [joints[number] for number in sorted(joints)]


def _names(rows: list[_Row]) -> list[str]:
    """Names of the moves, one per row, each once."""
    lines: dict[str, int] = {}
    for row in rows:
        name = row.cells["name"]
        if not name:
            raise row.error("name", "the move has no name", "a name in every row but the first, or no such column")
        if name in lines:
            raise row.error("name", f"the name '{name}' is already used in line {lines[name]}")
        lines[name] = row.line
    return list(lines)


def _positions(radians: list[tuple[float, ...]]) -> tuple[str, list[list[float]]]:
    """Positions as they are written, with their unit."""
    degrees = in_exact_degrees(radians)
    return ("rad", [list(row) for row in radians]) if degrees is None else ("deg", degrees)


def _flat_moves(tree: OperationTree, path: Path) -> list[MoveOperation]:
    """The moves of a tree that holds nothing else and stops at each of them."""

    def refuse(problem: str) -> InputError:
        return InputError(problem, file=path, allowed="a program of fine moves only, or another format")

    moves = []
    for operation in tree.operations:
        if not isinstance(operation, MoveOperation):
            raise refuse(f"joint positions cannot hold the {operation.type} operation '{operation.name}'")
        if not operation.is_fine:
            raise refuse(f"joint positions cannot hold the coarse zone of move '{operation.name}'")
        if operation.tool_path is not None:
            raise refuse(f"joint positions cannot hold the path of move '{operation.name}'")
        if operation.speed_group is not None:
            raise refuse(f"joint positions cannot hold the speed group of move '{operation.name}'")
        if len(operation.target_rad) != len(tree.start_rad):
            raise refuse(f"move '{operation.name}' has another number of joints than the start")
        moves.append(operation)
    return moves
