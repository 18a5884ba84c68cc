"""Programs without paths of the tool, for what knows straight lines of joint angles only."""

from __future__ import annotations

import numpy as np

from robojoule.formats.vendor.speeds import percent_for_duration
from robojoule.motion.tool_motions import ToolMotions
from robojoule.programs.operation_tree import CompoundOperation, MoveOperation, Operation, OperationTree
from robojoule.programs.tool_moves import tool_moves_of_tree
from robojoule.programs.tree_check import in_model_angles
from robojoule.robots.robot import Robot


def as_joint_motions(tree: OperationTree, robot: Robot | None = None) -> tuple[OperationTree, tuple[str, ...]]:
    """A tree in which moves along a path of the tool are joint motions between the same ends.

    Args:
        tree: The tree.
        robot: Robot that executes it, by whose figures these moves keep their durations; None: they keep their speed
            limits.

    Returns:
        The tree, and what it no longer says, a sentence each.

    Raises:
        InputError: The tool cannot follow its path.
    """
    paths = [move for move in tree.moves() if move.tool_path is not None]
    if not paths:
        return tree, ()
    percents = {move.name: move.speed_limit_percent for move in paths}
    if robot is not None:
        percents = _percents(in_model_angles(tree, robot), robot)

    def rewrite(operation: Operation) -> Operation:
        if isinstance(operation, CompoundOperation):
            return operation.model_copy(update={"operations": tuple(map(rewrite, operation.operations))})
        if isinstance(operation, MoveOperation) and operation.tool_path is not None:
            changes = {"path": "joint", "speed_limit_percent": percents[operation.name]}
            return operation.model_copy(update=changes | {"least_speed_percent": None, "most_speed_percent": None})
        return operation

    kept = "duration" if robot is not None else "speed limit"
    lost = tuple(
        f"the path of move '{move.name}' is left out: a joint motion of the same {kept} takes its place"
        for move in paths
    )
    return tree.model_copy(update={"operations": tuple(map(rewrite, tree.operations))}), lost


def _percents(tree: OperationTree, robot: Robot) -> dict[str, float]:
    """Speed limits at which joint motions take as long as the moves of the tool, by the names of these. [%]"""
    found: dict[str, float] = {}
    moves = zip([move for move in tree.moves() if move.is_fine], tool_moves_of_tree(tree), strict=True)
    payloads = {move.name: payload for move, payload in zip(tree.moves(), tree.payloads(), strict=True)}
    for move, of_tool in moves:
        if of_tool is None:
            continue
        payload = payloads[move.name]
        loaded = robot if payload is None else robot.carrying(payload)
        limits = np.array([[move.speed_limit_percent / 100.0]])
        seconds = float(ToolMotions(loaded, [of_tool]).durations(limits)[0, 0])
        found[move.name], _ = percent_for_duration(loaded, of_tool.start_rad, of_tool.end_rad, seconds)
    return found
