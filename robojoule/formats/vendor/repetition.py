"""Motions whose statement runs more than once: they have one speed, as there is one place where it stands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set

import numpy as np
from numpy.typing import ArrayLike

from robojoule.formats.vendor.speed_limits import Execution
from robojoule.formats.vendor.zones import Step
from robojoule.programs.operation_tree import MoveOperation

_SAME_RAD = 1e-9


def tied(
    operations: Sequence[Step],
    executions: Mapping[str, Execution],
    elsewhere: Set[int],
    note: Callable[[int, str], None],
) -> tuple[Step, ...]:
    """Operations in which executions of one statement are a speed group, or keep their speed if they cannot be.

    Args:
        operations: Operations of a cycle.
        executions: Motions by the names of their moves.
        elsewhere: Statements that run where the position of the robot is not known, too: they keep their speed.
        note: Tells something about a line.
    """
    groups: dict[int, list[MoveOperation]] = {}
    for operation in operations:
        if isinstance(operation, MoveOperation):
            groups.setdefault(executions[operation.name].motion.statement, []).append(operation)
    changes: dict[str, MoveOperation] = {}
    settings: dict[str, object]
    for statement, moves in groups.items():
        if len(moves) == 1 and statement not in elsewhere:
            continue
        line = executions[moves[0].name].motion.line
        if statement in elsewhere:
            note(line, "the motion also runs where the position of the robot is not known: its speed is kept")
            changes |= {move.name: move.model_copy(update={"fixed": True}) for move in moves}
            continue
        if _have_one_speed(moves, [executions[move.name] for move in moves]):
            said, settings = "one speed counts for all", {"speed_group": f"line {line}: {moves[0].name}"}
        else:
            said, settings = "its speed is kept", {"fixed": True}
        note(line, f"the motion runs {len(moves)} times: {said}")
        changes |= {move.name: move.model_copy(update=settings) for move in moves}
    return tuple(changes.get(one.name, one) if isinstance(one, MoveOperation) else one for one in operations)


def _have_one_speed(moves: Sequence[MoveOperation], executions: Sequence[Execution]) -> bool:
    """Whether one figure in the program can say the new speed of all executions."""
    if len({move.speed_limit_percent for move in moves}) > 1 or any(move.fixed for move in moves):
        return False
    if all(one.motion.speed.percent is not None for one in executions):
        return True
    ways = np.array([[one.start_rad, one.target_rad] for one in executions])
    return bool(np.ptp(ways, axis=0).max() <= _SAME_RAD)  # else the same figure is another share of the limits


def six_moments(inertia_kg_m2: ArrayLike) -> tuple[float, ...]:
    """xx, yy, zz, xy, xz, yz of an inertia, shape (3, 3). [kg m2]"""
    matrix = np.asarray(inertia_kg_m2, dtype=float)
    return tuple(matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist())
