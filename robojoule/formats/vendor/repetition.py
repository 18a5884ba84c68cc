"""Motions whose statement runs more than once: they have one speed, as there is one place where it stands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set

import numpy as np
from numpy.typing import ArrayLike

from robojoule.formats.vendor.speed_limits import Execution
from robojoule.formats.vendor.speeds import leading_share
from robojoule.formats.vendor.zones import Step
from robojoule.programs.operation_tree import MoveOperation
from robojoule.robots.robot import Robot

_SAME = 1e-9  # of positions [rad], and of shares of the limits [s/rad]


def tied(
    operations: Sequence[Step],
    executions: Mapping[str, Execution],
    elsewhere: Set[int],
    note: Callable[[int, str], None],
    robot: Robot | None = None,
) -> tuple[Step, ...]:
    """Operations in which executions of one statement are a speed group, or keep their speed if they cannot be.

    Args:
        operations: Operations of a cycle.
        executions: Motions by the names of their moves.
        elsewhere: Statements that run where the position of the robot is not known, too: they keep their speed.
        note: Tells something about a line.
        robot: Robot that executes them, if it is known.
    """
    groups: dict[int, list[MoveOperation]] = {}
    for operation in operations:
        if isinstance(operation, MoveOperation):
            groups.setdefault(executions[operation.name].motion.statement, []).append(operation)
    changes: dict[str, MoveOperation] = {}
    settings: dict[str, object]
    for statement, moves in groups.items():
        motion = executions[moves[0].name].motion
        line = motion.line
        if len(moves) == 1 and statement not in elsewhere:
            if motion.kind == "joint" and not motion.speed.writable:
                note(line, "the motion keeps its speed, which plans cannot write there")
            continue
        if statement in elsewhere:
            note(line, "the motion also runs where the position of the robot is not known: its speed is kept")
            changes |= {move.name: move.model_copy(update={"fixed": True}) for move in moves}
            continue
        reason = _why_kept(moves, [executions[move.name] for move in moves], robot)
        if not reason:
            said, settings = ": one speed counts for all", {"speed_group": f"line {line}: {moves[0].name}"}
        else:
            said, settings = f"{reason}: its speed is kept", {"fixed": True}
        note(line, f"the motion runs {len(moves)} times{said}")
        changes |= {move.name: move.model_copy(update=settings) for move in moves}
    return tuple(changes.get(one.name, one) if isinstance(one, MoveOperation) else one for one in operations)


def _why_kept(moves: Sequence[MoveOperation], executions: Sequence[Execution], robot: Robot | None) -> str:
    """Why no one figure in the program can say the new speed of all executions; empty: one can."""
    if any(move.fixed for move in moves):
        is_joint = executions[0].motion.kind == "joint"
        return " with a speed that plans cannot write" if is_joint else " along a path of the tool"
    differ = len({move.speed_limit_percent for move in moves}) > 1
    speeds = [one.motion.speed for one in executions]
    if all(speed.percent is not None for speed in speeds):
        return " at different speeds" if differ else ""
    # Where the same figure is another share of the limits on each way, no new one can stand for the same share.
    if robot is not None and all(speed.duration_s is None and speed.leading_rad_s for speed in speeds):
        spread = float(np.ptp([leading_share(one.start_rad, one.target_rad, robot) for one in executions]))
    else:
        spread = float(np.ptp([[one.start_rad, one.target_rad] for one in executions], axis=0).max())
    if spread > _SAME:
        return " on different ways, on which one figure means different speeds"
    return " at different speeds" if differ else ""


def six_moments(inertia_kg_m2: ArrayLike) -> tuple[float, ...]:
    """xx, yy, zz, xy, xz, yz of an inertia, shape (3, 3). [kg m2]"""
    matrix = np.asarray(inertia_kg_m2, dtype=float)
    return tuple(matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist())
