"""Whether a program does what its cell asks for: everything but speeds, added waits and poses must be as programmed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robojoule.formats.program import Program
from robojoule.formats.robot_cell import PlacedRobot, RobotCell, move_before
from robojoule.programs.operation_tree import PLANNED, OperationTree

_SAME_RAD = 1e-9
_SAME_PERCENT = 1e-9


def program_violations(placed: PlacedRobot, program: Program) -> list[str]:
    """What a program does differently from the one that its robot has in the cell, a sentence each."""
    asked, found = placed.program.tree, program.tree
    if _shape(asked) != _shape(found) or asked.angles != found.angles:
        return [f"the program of {placed.name} does not have the operations that the cell asks for"]
    problems = []
    if not np.allclose(asked.start_rad, found.start_rad, rtol=0.0, atol=_SAME_RAD):
        problems.append(f"the program of {placed.name} starts elsewhere")
    for given, planned in zip(asked.moves(), found.moves(), strict=True):
        where = f"move '{given.name}' of {placed.name}"
        if pose_of(placed, program, given.name) is None:
            problems.append(f"{where} ends elsewhere than the cell allows")
        too_fast = planned.speed_limit_percent > given.speed_limit_percent + _SAME_PERCENT
        least = given.speed_limit_percent if given.fixed else given.least_speed_percent or 0.0
        if too_fast or planned.speed_limit_percent < least - _SAME_PERCENT:
            problems.append(f"{where} has a speed limit of {planned.speed_limit_percent:g} %, which is not allowed")
    return problems


def pose_of(placed: PlacedRobot, program: Program, move: str) -> str | None:
    """Name of the pose in which a move of a program ends; none if the cell knows no such pose."""
    targets = {one.name: one.target_rad for one in program.tree.moves()}
    given = {one.name: one.target_rad for one in placed.program.tree.moves()}
    found = placed.alternatives.get(move)
    poses = {placed.poses(move)[0]: given[move], **(found.poses_rad if found is not None else {})}
    for name, target in poses.items():
        if (
            move in targets
            and len(target) == len(targets[move])
            and np.allclose(target, targets[move], rtol=0.0, atol=_SAME_RAD)
        ):
            return name
    return None


def pose_violations(cell: RobotCell, programs: Sequence[Program]) -> list[str]:
    """Hand-overs whose poses do not fit together, a sentence each."""
    by_name = dict(zip((one.name for one in cell.robots), programs, strict=True))
    problems = []
    for one in cell.handovers:
        if one.poses is None:
            continue
        poses = []
        for place in (one.first, one.second):
            placed = cell.robot(place.robot)
            poses.append(pose_of(placed, by_name[place.robot], move_before(placed.program, place.operation)))
        if tuple(poses) not in one.poses:
            problems.append(f"the poses {poses[0]} and {poses[1]} of {one.first} and {one.second} do not fit together")
    return problems


def _shape(tree: OperationTree) -> list[object]:
    """Operations without what plans change."""
    kept = {name for name in PLANNED if name.startswith("wait")}
    left_out = (set(PLANNED) - kept) | {"target_rad", "operations"}
    return [(key, operation.model_dump(exclude=left_out)) for key, operation in tree.walk()]
