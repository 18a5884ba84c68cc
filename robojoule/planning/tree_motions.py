"""The motions of operation trees: single lines, chains through coarse zones, paths of the tool, and their payloads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.motion.blends import BlendedPaths
from robojoule.motion.corners import Chain
from robojoule.motion.groups import Load, LoadedMotions
from robojoule.motion.motions import MovedMotions
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.tool_motions import ToolMotions
from robojoule.programs.operation_tree import (
    AtomicOperation,
    CoarseZone,
    MoveOperation,
    OperationTree,
    PayloadOperation,
    ShareZone,
)
from robojoule.programs.tool_moves import tool_moves_of_tree
from robojoule.robots.robot import Payload, Robot

SAME_POSITION_RAD = 1e-6


def chains_of_tree(tree: OperationTree) -> list[Chain]:
    """Chains of moves from stop to stop, in order of execution."""
    points = tree.configurations_rad()
    chains: list[Chain] = []
    first = 0
    moves = tree.moves()
    for place, move in enumerate(moves):
        if move.is_fine:
            zones = [_zone(one) for one in moves[first:place]]
            radii, shares = np.array(zones, dtype=float).reshape(-1, 2).T
            chains.append(Chain(points[first : place + 2], radii, shares))
            first = place + 1
    return chains


def _zone(move: MoveOperation) -> tuple[float, float]:
    """Radius [m] and share of the legs beside it of a coarse zone."""
    if isinstance(move.zone, CoarseZone):
        return move.zone.radius_m, 1.0
    return np.inf, move.zone.path_share if isinstance(move.zone, ShareZone) else 0.0


def motions_of_trees(robot: Robot, trees: Sequence[OperationTree], move_range: tuple[Array, Array]) -> MovedMotions:
    """The motions of trees, tree after tree.

    Args:
        robot: Robot with the payload that it is given.
        trees: The trees, in angles of the robot's model.
        move_range: Lowest and highest speed limit of each move, each of shape (K,). [-]

    Raises:
        InputError: A payload above the rated one, poses that the arm cannot hold, or a path that it cannot follow.
    """
    is_plain = all(move.is_fine and move.tool_path is None for tree in trees for move in tree.moves())
    if is_plain and not _changes_payload(trees):
        points = [tree.configurations_rad() for tree in trees]
        return MotionPaths(robot, np.concatenate([p[:-1] for p in points]), np.concatenate([p[1:] for p in points]))
    chains = [chain for tree in trees for chain in chains_of_tree(tree)]
    counts = np.array([len(chain.points_rad) - 1 for chain in chains])
    of_move = np.repeat(np.arange(len(chains)), counts)
    payloads = [payload for tree in trees for payload in tree.payloads()]
    carried = [payloads[move] for move in np.cumsum(counts) - 1]
    of_tool = [one for tree in trees for one in tool_moves_of_tree(tree)]
    kinds = [(payload, one is not None) for payload, one in zip(carried, of_tool, strict=True)]
    loads = []
    for payload, is_of_tool in dict.fromkeys(kinds):
        rows = np.array([row for row, one in enumerate(kinds) if one == (payload, is_of_tool)], dtype=np.intp)
        moves = np.flatnonzero(np.isin(of_move, rows))
        loaded = robot if payload is None else robot.carrying(payload)
        bounds = move_range[0][moves], move_range[1][moves]
        if is_of_tool:
            found: MovedMotions = ToolMotions(loaded, [one for row in rows if (one := of_tool[row]) is not None])
        else:
            found = _along(loaded, [chains[row] for row in rows], bounds)
        loads.append(Load(rows, moves, found))
    if len(loads) == 1:
        return loads[0].motions
    return LoadedMotions(loads, _before(trees))


def check_single_moves(tree: OperationTree) -> None:
    """Refuse trees whose motions are not single moves, for what knows these alone.

    Raises:
        InputError: A coarse zone, a path of the tool, a speed group or a change of payload; names it.
    """
    found = next((_joining(one) for one in tree.atomic() if _joining(one)), None)
    if found:
        raise InputError(
            f"{found}: cells of robots and measured runs know single moves with one payload only",
            allowed="fine moves with speed limits of their own",
        )


def _joining(operation: AtomicOperation) -> str:
    """What makes an operation more than a single move."""
    if isinstance(operation, PayloadOperation):
        return f"operation '{operation.name}' changes the payload"
    if not isinstance(operation, MoveOperation):
        return ""
    if not operation.is_fine:
        return f"move '{operation.name}' has a coarse zone"
    if operation.tool_path is not None:
        return f"move '{operation.name}' has a path of the tool"
    return f"move '{operation.name}' is in a speed group" if operation.speed_group is not None else ""


def _along(robot: Robot, chains: Sequence[Chain], move_range: tuple[Array, Array]) -> MovedMotions:
    if all(len(chain.points_rad) == 2 for chain in chains):
        ends = np.array([chain.points_rad for chain in chains])
        return MotionPaths(robot, ends[:, 0], ends[:, 1])
    return BlendedPaths(robot, chains, move_range)


def _changes_payload(trees: Sequence[OperationTree]) -> bool:
    return any(payload is not None for tree in trees for payload in tree.payloads())


def _before(trees: Sequence[OperationTree]) -> Index:
    """Motion before each one in its cycle; itself at the start of a cycle that ends elsewhere."""
    found, first = [], 0
    for tree in trees:
        count = sum(move.is_fine for move in tree.moves())
        start = first + count - 1 if closes(tree) else first
        found += [start, *range(first, first + count - 1)]
        first += count
    return np.array(found, dtype=np.intp)


def closes(tree: OperationTree) -> bool:
    """Whether a cycle ends where it starts."""
    start, *_, end = tree.configurations_rad()
    return bool(np.allclose(start, end, rtol=0.0, atol=SAME_POSITION_RAD))


def tree_payloads(robot: Robot, tree: OperationTree) -> list[Payload]:
    """What the robot carries in each motion from stop to stop."""
    found = [payload for payload, move in zip(tree.payloads(), tree.moves(), strict=True) if move.is_fine]
    return [robot.payload if payload is None else payload for payload in found]
