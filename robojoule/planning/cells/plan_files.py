"""Plans of cells as JSON and CSV files, for writing and reading."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, Literal, get_args

from robojoule.documents import Document, check_output, parse, read_document, read_text, write_document, write_text
from robojoule.errors import InputError
from robojoule.inputs import number_of, shown
from robojoule.planning.cells.plan import CellPlan, Step

SUFFIXES = (".json", ".csv")
_STEP = [one.name for one in fields(Step)]
_COLUMNS = ["cell", "status", "cycle_time_s", "bound_j", "runtime_s", *_STEP]


_STATED = ("energy_j", "gap_percent", "largest_mean_power_w")  # follow from the rest of a plan
_TOLERANCE = 1e-6  # of what a plan states
_Status = Literal["optimal", "feasible"]


class _StepDocument(Document):
    robot: str
    activity: str
    option: str
    mode: str | None
    start_s: float
    duration_s: float
    energy_j: float


class _PlanDocument(Document):
    cell: str
    status: _Status
    cycle_time_s: float
    energy_j: float
    bound_j: float
    gap_percent: float
    runtime_s: float
    largest_mean_power_w: float | None = None
    steps: tuple[_StepDocument, ...]


class _PlansDocument(Document):
    format: Literal["robojoule-cell-plans"]
    version: Literal[1]
    plans: tuple[_PlanDocument, ...]


def check_plan_file(path: Path) -> None:
    """Refuse a file that plans cannot be written to, before they are searched.

    Raises:
        InputError: Another suffix than JSON's or CSV's, or see `check_output`.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"unknown file type {shown(path.suffix)}", file=path, allowed=", ".join(SUFFIXES))
    check_output(path)


def write_plans(plans: Sequence[CellPlan], path: str | Path) -> None:
    """Write plans as JSON or CSV (by suffix), atomically; a CSV file has a row for each activity.

    Raises:
        InputError: Another suffix, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        text = io.StringIO()
        writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n")
        writer.writeheader()
        for plan in plans:
            head = {name: getattr(plan, name) for name in _COLUMNS[: -len(_STEP)]}
            writer.writerows({**head, **asdict(step)} for step in plan.steps)
        write_text(path, text.getvalue())
        return
    _check_suffix(path)
    write_document(path, {"format": "robojoule-cell-plans", "version": 1, "plans": [plan.to_dict() for plan in plans]})


def read_plans(path: str | Path) -> tuple[CellPlan, ...]:
    """Read plans from a JSON or CSV file; whether they are feasible is for `check_plan` to say.

    Raises:
        InputError: The file cannot be read, does not hold plans, or states figures that do not follow from their steps.
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        return _read_csv(path)
    _check_suffix(path)
    document = parse(_PlansDocument, read_document(path), path)
    if not document.plans:
        raise InputError("the file holds no plan", file=path)
    return tuple(_plan(one, number, path) for number, one in enumerate(document.plans))


def _plan(one: _PlanDocument, number: int, path: Path) -> CellPlan:
    """A plan, if what it states of itself is what its steps give."""
    steps = tuple(Step(**step.model_dump()) for step in one.steps)
    plan = CellPlan(one.cell, one.cycle_time_s, steps, one.status, one.bound_j, one.runtime_s)
    _check_times(one.cycle_time_s, one.runtime_s, path, f"plans.{number}.")
    for name in _STATED:
        stated, found = getattr(one, name), getattr(plan, name)
        if stated is not None and abs(stated - found) > _TOLERANCE * max(abs(found), 1.0):
            problem = f"the plan states {stated:.7g}, its steps and its bound give {found:.7g}"
            raise InputError(problem, file=path, key=f"plans.{number}.{name}")
    return plan


def _check_times(cycle_time_s: float, runtime_s: float, path: Path, place: str) -> None:
    if cycle_time_s <= 0.0:
        raise InputError("the cycle time must be above 0 s", file=path, key=f"{place}cycle_time_s")
    if runtime_s < 0.0:
        raise InputError("the runtime must not be below 0 s", file=path, key=f"{place}runtime_s")


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() != ".json":
        raise InputError(f"unknown file type {shown(path.suffix)}", file=path, allowed=", ".join(SUFFIXES))


def _read_csv(path: Path) -> tuple[CellPlan, ...]:
    try:
        reader = csv.DictReader(io.StringIO(read_text(path)), strict=True)
        rows = [(reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise InputError(f"the file is not CSV ({error})", file=path) from None
    if not rows or reader.fieldnames is None or set(reader.fieldnames) != set(_COLUMNS):
        raise InputError("this is not a table of plans", file=path, allowed=", ".join(_COLUMNS))
    plans: dict[tuple[Any, ...], list[Step]] = {}
    for line, row in rows:
        if None in row or None in row.values():
            raise InputError("the row has more or fewer cells than the header", file=path, key=f"line {line}")

        def number(name: str, line: int = line, row: dict[str, str] = row) -> float:
            try:
                return number_of(row[name].strip())
            except ValueError as error:
                raise InputError(str(error), file=path, key=f"line {line}, column {name}") from None

        if row["status"] not in get_args(_Status):
            place, allowed = f"line {line}, column status", ", ".join(get_args(_Status))
            raise InputError(f"unknown status {shown(row['status'])}", file=path, key=place, allowed=allowed)
        cycle_time_s, runtime_s = number("cycle_time_s"), number("runtime_s")
        _check_times(cycle_time_s, runtime_s, path, f"line {line}, column ")
        head = (row["cell"], cycle_time_s, row["status"], number("bound_j"), runtime_s)
        plans.setdefault(head, []).append(
            Step(
                row["robot"],
                row["activity"],
                row["option"],
                row["mode"] or None,
                number("start_s"),
                number("duration_s"),
                number("energy_j"),
            )
        )
    return tuple(CellPlan(head[0], head[1], tuple(steps), *head[2:]) for head, steps in plans.items())
