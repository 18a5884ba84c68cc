"""Whether the paths of a tree touch the robot itself, its base or the floor.

A finding is a warning: capsules are wider than the links, and cells differ (a robot on a pedestal has no floor there).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.collision import CollisionModel, path_points_rad
from robojoule.robots.robot import Robot


def collision_warnings(tree: OperationTree, robot: Robot) -> tuple[str, ...]:
    """What touches what on the way, a sentence for each pair; nothing if the robot's file gives no capsules.

    Args:
        tree: A tree that fits the robot, in angles of its model.
        robot: The robot with its payload.
    """
    if not robot.file.capsules:
        return ()
    model = CollisionModel(robot)
    points = tree.configurations_rad()
    paths = [path_points_rad(start, end) for start, end in pairwise(points)]
    clearances = model.clearances_m(np.concatenate(paths))
    ends = np.cumsum([len(path) for path in paths])
    least = np.array([part.min(axis=0) for part in np.split(clearances, ends[:-1])])  # (moves, checks)
    found = []
    for check in np.flatnonzero((least <= 0.0).any(axis=0)):
        moves = [move.name for move, clearance in zip(tree.moves(), least[:, check], strict=True) if clearance <= 0.0]
        one, other = model.checks[check]
        others = f" and {len(moves) - 1} more" if len(moves) > 1 else ""
        depth_mm = -1e3 * float(least[:, check].min())
        found.append(
            f"{one} touches {other} in move '{moves[0]}'{others}, by up to {depth_mm:.0f} mm of their capsules"
        )
    return tuple(found)
