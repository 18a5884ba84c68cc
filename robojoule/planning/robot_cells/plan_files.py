"""Plans of cells of robots as files: one JSON file, and beside it the program of each robot, which it names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

from robojoule.documents import Document, check_output, parse, read_document, write_document
from robojoule.errors import InputError
from robojoule.formats.program import Program, load_program
from robojoule.formats.robot_cell import RobotCell
from robojoule.inputs import shown
from robojoule.planning.robot_cells.cell_run import CellRun, simulate_cell
from robojoule.planning.robot_cells.plan import RobotCellPlan

PLAN: Literal["robojoule-robot-cell-plan"] = "robojoule-robot-cell-plan"
SUFFIXES = (".json",)
TOLERANCE_SHARE = 1e-6  # of the energy that a plan states


class _ProgramDocument(Document):
    robot: str
    file: str
    start_s: float


class _PlanDocument(Document, extra="ignore"):
    """What of a plan file is read: the rest is told by the simulation of its programs."""

    format: Literal["robojoule-robot-cell-plan"]
    version: Literal[1]
    cell: str
    cycle_time_s: float
    energy_j: float
    programs: tuple[_ProgramDocument, ...]


def program_paths(cell: RobotCell, path: Path) -> tuple[Path, ...]:
    """Where the programs of a plan go: beside its file, named after it and the robot.

    Raises:
        InputError: A file that the cell was read from would be overwritten.
    """
    read = {one.program.path.resolve() for one in cell.robots if one.program.path is not None}
    read |= {cell.source.resolve()} if cell.source is not None else set()
    found: list[Path] = []
    for one in cell.robots:
        plain = "".join(c if c.isalnum() or c in "-_" else "-" for c in one.name)
        own = one.program.path if one.program.source is None else None  # a vendor's program cannot hold other targets
        suffix = own.suffix if own is not None else ".yaml"
        file = path.with_name(f"{path.stem}.{plain}{suffix}")
        if file in found:
            file = path.with_name(f"{path.stem}.{plain}-{len(found) + 1}{suffix}")
        if file.resolve() in read:
            raise InputError("the cell is read from this file, a plan may not replace it", file=file, key="out")
        found.append(file)
    return tuple(found)


def write_robot_plan(cell: RobotCell, plan: RobotCellPlan, path: str | Path) -> tuple[Path, ...]:
    """Write a plan and its programs.

    Args:
        cell: The cell.
        plan: Its plan.
        path: File of the plan (.json); the programs go beside it.

    Returns:
        Files of the programs.

    Raises:
        InputError: Another suffix, or a file that cannot be written or must not be.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"unknown file type {shown(path.suffix)}", file=path, allowed=", ".join(SUFFIXES))
    files = program_paths(cell, path)
    check_output(path)
    for program, file, start_s in zip(plan.programs, files, plan.run.starts_s, strict=True):
        program.save(file, (f"plan of cell '{plan.cell}': starts at {start_s:.3f} s of its cycle",))
    entries = [
        {"robot": name, "file": file.name, "start_s": start_s}
        for name, file, start_s in zip(plan.run.robots, files, plan.run.starts_s, strict=True)
    ]
    write_document(path, {"format": PLAN, "version": 1, **plan.to_dict(), "programs": entries})
    return files


def read_robot_plan(cell: RobotCell, path: str | Path) -> tuple[tuple[Program, ...], tuple[float, ...], float]:
    """Read the programs of a plan.

    Args:
        cell: The cell that it is for.
        path: File of the plan.

    Returns:
        A program for each robot of the cell; when each starts [s]; the energy that the plan states [J].

    Raises:
        InputError: The file does not hold a plan of this cell, or a program cannot be read.
    """
    path = Path(path)
    document = parse(_PlanDocument, read_document(path), path)
    if document.cell != cell.name:
        raise InputError(f"the plan is for cell {shown(document.cell)}", file=path, allowed=cell.name)
    entries = {one.robot: one for one in document.programs}
    missing = [one.name for one in cell.robots if one.name not in entries]
    if missing or len(document.programs) != len(cell.robots):
        names = ", ".join(one.name for one in cell.robots)
        raise InputError("the plan must name one program for each robot of the cell", file=path, allowed=names)
    ordered = [entries[one.name] for one in cell.robots]
    programs = tuple(load_program(path.parent / one.file) for one in ordered)
    return programs, tuple(one.start_s for one in ordered), document.energy_j


def simulate_plan_file(cell: RobotCell, path: str | Path) -> CellRun:
    """Simulate the programs of a plan file; a plan that states another energy than they take does not hold.

    Raises:
        InputError: See `read_robot_plan`.
    """
    programs, starts_s, stated_j = read_robot_plan(cell, path)
    run = simulate_cell(cell, programs, starts_s)
    if abs(run.energy_j - stated_j) <= TOLERANCE_SHARE * run.energy_j:
        return run
    stated = f"the plan states {stated_j:.2f} J, its programs take {run.energy_j:.2f} J"
    return replace(run, violations=(*run.violations, stated))
