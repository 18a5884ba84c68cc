"""What the library's functions make of what they are given: programs, robots and runs checked, motions to plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.inputs import as_number, shown
from robojoule.planning.batch import TreeBatch
from robojoule.planning.whole_speeds import check_speed_step
from robojoule.profile.energy_profile import LEAST_TRAVEL_RAD
from robojoule.programs.operation_tree import OperationTree
from robojoule.programs.tree_check import in_model_angles
from robojoule.robots.robot import Robot

if TYPE_CHECKING:
    from robojoule.calibration.run_table import MeasuredRuns

Kind = TypeVar("Kind")
SLOWEST_PERCENT = 1.0  # least speed limit of plans: what a controller takes as a whole percent
LEAST_PERCENT = 0.01  # below it, a motion of a second takes hours


def checked_step(speed_step: object, program: Program) -> float:
    """Step of speed limits, that of the program's format if none is given. [%]"""
    return check_speed_step(checked_program(program).speed_step_percent if speed_step is None else speed_step)


def checked_runs(runs: str | Path | MeasuredRuns, program: Program) -> MeasuredRuns:
    """Measured runs of a program's moves."""
    from robojoule.calibration.run_table import MeasuredRuns, check_range, read_runs

    if not isinstance(runs, MeasuredRuns):
        return read_runs(runs, [move.name for move in program.moves])
    check_range(runs, len(program.moves))
    return runs


def checked_batch(
    program: Program, robot: Robot, tree: OperationTree | None = None, slowest_percent: float = SLOWEST_PERCENT
) -> TreeBatch:
    """Motions and optimisation graph of a program, or of a tree of the same targets, checked against its robot."""
    key = "slowest_speed_limit_percent"
    slowest = as_number(slowest_percent, key, least=LEAST_PERCENT, most=100.0, unit="%") / 100.0
    checked_program(program).check(checked_robot(robot))
    return TreeBatch(robot, [tree or program.tree], slowest)


def moving_batch(
    program: Program, robot: Robot, tree: OperationTree | None = None, slowest_percent: float = SLOWEST_PERCENT
) -> TreeBatch:
    """The same of a program that has something to plan."""
    batch = checked_batch(program, robot, tree, slowest_percent)
    if np.ptp(program.tree.configurations_rad(), axis=0).max() <= LEAST_TRAVEL_RAD:
        raise InputError("there is no motion: all positions of the program are the same", file=program.path)
    return batch


def check_trial(measured_cycle: object, runs: object) -> None:
    """Refuse neither or both of what a trial may give."""
    if (measured_cycle is None) == (runs is None):
        given = "neither a measured cycle nor runs" if runs is None else "both a measured cycle and runs"
        raise InputError(f"{given} are given", key="measured_cycle", allowed="one of them; runs tell more")


def adjustable_tree(program: Program, given: Program | None, robot: Robot) -> OperationTree:
    """The tree of a plan, each move as fast as the program that the plan was made from let it be."""
    if given is None:
        return program.tree.at_most_speeds()
    checked_kind(given, Program, "a program", "given", "what load_program returns")
    before = model_program(known_program(given, robot), robot).tree
    limits = {move.name: move.speed_limit_percent for move in before.moves()}
    if limits.keys() != {move.name for move in program.moves}:
        raise InputError("it has other moves than the plan", key="given", allowed="the program that the plan is of")
    return program.tree.without_plan().with_plan(limits)


def known_program(program: Program, robot: Robot) -> Program:
    """The program as a robot executes it; see `Program.for_robot`."""
    return checked_program(program).for_robot(checked_robot(robot))


def model_program(program: Program, robot: Robot) -> Program:
    """The program in angles of the robot's model, checked where it is in others."""
    if checked_program(program).angles == "model":
        return program
    program.check(checked_robot(robot))
    return replace(program, tree=in_model_angles(program.tree, robot))


def checked_program(program: Program) -> Program:
    """The program; an error in one sentence where it is something else."""
    return checked_kind(program, Program, "a program", "program", "what load_program returns")


def checked_robot(robot: Robot) -> Robot:
    """The robot; an error in one sentence where it is something else."""
    return checked_kind(robot, Robot, "a robot", "robot", "what load_robot returns")


def checked_kind(value: object, kind: type[Kind], what: str, key: str, allowed: str) -> Kind:
    """A value of a kind; an error in one sentence where it is something else."""
    if not isinstance(value, kind):
        raise InputError(f"{shown(value)} is not {what}", key=key, allowed=allowed)
    return value
