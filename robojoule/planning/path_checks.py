"""Whether the paths of a tree touch the robot itself, its base or the floor.

A finding is a warning: capsules are wider than the links, and cells differ (a robot on a pedestal has no floor there).
"""

from __future__ import annotations

import numpy as np

from robojoule.arrays import Array
from robojoule.motion.corners import Chain, Corners
from robojoule.planning.tree_motions import chains_of_tree, tree_payloads
from robojoule.programs.operation_tree import OperationTree
from robojoule.programs.tool_moves import tool_moves_of_tree
from robojoule.robots.collision import PATH_STEP_RAD, CollisionModel, path_points_rad
from robojoule.robots.robot import Robot


def collision_warnings(tree: OperationTree, robot: Robot) -> tuple[str, ...]:
    """What touches what on the way, a sentence for each pair; nothing if the robot's file gives no capsules.

    Args:
        tree: A tree that fits the robot, in angles of its model.
        robot: The robot with its payload.
    """
    if not robot.file.capsules:
        return ()
    names = [move.name for move in tree.moves() if move.is_fine]
    paths = [
        _points_rad(chain, robot) if of_tool is None else of_tool.followed(robot).points_rad(PATH_STEP_RAD)
        for chain, of_tool in zip(chains_of_tree(tree), tool_moves_of_tree(tree), strict=True)
    ]
    payloads = tree_payloads(robot, tree)
    found: list[str] = []
    for payload in dict.fromkeys(payloads):
        rows = [row for row, one in enumerate(payloads) if one == payload]
        loaded = robot if payload == robot.payload else robot.carrying(payload)
        found += _touching(CollisionModel(loaded), [names[row] for row in rows], [paths[row] for row in rows])
    return tuple(dict.fromkeys(found))


def _points_rad(chain: Chain, robot: Robot) -> Array:
    """Configurations along a chain of moves, near to each other, shape (N, n). [rad]"""
    if len(chain.points_rad) == 2:
        return path_points_rad(*chain.points_rad)
    return Corners.of(robot, [chain]).points_rad(0, PATH_STEP_RAD)


def _touching(model: CollisionModel, names: list[str], paths: list[Array]) -> list[str]:
    """A sentence for each pair that touches on motions with names."""
    clearances = model.clearances_m(np.concatenate(paths))
    ends = np.cumsum([len(path) for path in paths])
    least = np.array([part.min(axis=0) for part in np.split(clearances, ends[:-1])])  # (moves, checks)
    found = []
    for check in np.flatnonzero((least <= 0.0).any(axis=0)):
        moves = [name for name, clearance in zip(names, least[:, check], strict=True) if clearance <= 0.0]
        one, other = model.checks[check]
        others = f" and {len(moves) - 1} more" if len(moves) > 1 else ""
        depth_mm = -1e3 * float(least[:, check].min())
        found.append(
            f"{one} touches {other} in move '{moves[0]}'{others}, by up to {depth_mm:.0f} mm of their capsules"
        )
    return found
