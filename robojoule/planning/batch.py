"""Many operation trees of one robot, their motions simulated together: one call for all is far cheaper than many."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.motion.groups import TiedMotions
from robojoule.motion.motions import Motions, MovedMotions
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.graph import OptimizationGraph, graph_of_tree
from robojoule.planning.tree_motions import check_single_moves, motions_of_trees
from robojoule.programs.operation_tree import MoveOperation, OperationTree
from robojoule.programs.tree_check import check_tree
from robojoule.robots.robot import Robot

SLOWEST_SPEED_LIMIT = 0.01  # the least whole percent, which controllers take


class TreeBatch:
    """Trees, their graphs and the motions of all of them.

    The M motions of all trees, each from stop to stop, stand in one list, tree after tree; every array "of motions" has
    that order. `executed` are the motions as they run; in `planned` those of one speed limit count as one
    (`robojoule.motion.groups.TiedMotions`).

    Args:
        robot: Robot that executes every tree.
        trees: Operation trees.
        slowest_speed_limit: Least speed limit of a plan, a fraction in (0, 1].

    Attributes:
        speed_range: Lowest and highest speed limit of each motion that the trees allow, each of shape (M,). [-]

    Raises:
        InputError: A tree does not fit the robot.
    """

    def __init__(
        self, robot: Robot, trees: Sequence[OperationTree], slowest_speed_limit: float = SLOWEST_SPEED_LIMIT
    ) -> None:
        for tree in trees:
            check_tree(tree, robot)
            if tree.angles != "model":
                problem = f"tree '{tree.name}' is in angles of the pendant"
                raise InputError(problem, key="angles", allowed="angles of the model (`in_model_angles`)")
        self.robot = robot
        self.trees = tuple(trees)
        self.slowest_speed_limit = slowest_speed_limit
        self.graphs: tuple[OptimizationGraph, ...] = tuple(graph_of_tree(tree, robot.name) for tree in trees)
        ends = np.cumsum([len(graph.vertices) for graph in self.graphs])
        self.rows = tuple(
            slice(int(end) - len(graph.vertices), int(end)) for graph, end in zip(self.graphs, ends, strict=True)
        )
        moves = [move for tree in trees for move in tree.moves()]
        of_moves = speed_range(moves, slowest_speed_limit)
        self.executed: MovedMotions = motions_of_trees(robot, trees, of_moves)
        self.leaders: Index = np.concatenate(
            [graph.leaders + rows.start for graph, rows in zip(self.graphs, self.rows, strict=True)]
        )
        self.is_tied = bool((self.leaders != np.arange(len(self.leaders))).any())
        alone: Index = np.arange(len(self.leaders))
        of_motion = np.repeat(alone, self._move_counts())
        self.planned: Motions = self.executed
        if self.is_tied:
            own_range = _of_motions(of_moves, of_motion, alone)
            self.planned = TiedMotions(self.executed, self.leaders, own_range=own_range)
        self.speed_range = _of_motions(of_moves, self.leaders[of_motion], self.leaders)

    def _move_counts(self) -> list[int]:
        """Number of moves of each motion."""
        return [len(vertex.moves) for graph in self.graphs for vertex in graph.vertices]

    @property
    def paths(self) -> MotionPaths:
        """The motions, where each is one fine move with a speed limit and the given payload.

        Raises:
            InputError: There are coarse zones, speed groups or changes of payload.
        """
        for tree in self.trees:
            check_single_moves(tree)
        assert isinstance(self.planned, MotionPaths)
        return self.planned

    @paths.setter
    def paths(self, paths: MotionPaths) -> None:
        self.executed = self.planned = paths

    @cached_property
    def d_min_s(self) -> Array:
        """Duration of each motion at its highest speed limit, shape (M,). [s]"""
        return np.asarray(self.planned.durations(self.speed_range[1][:, np.newaxis])[:, 0])

    @cached_property
    def d_max_s(self) -> Array:
        """Duration of each motion at its lowest speed limit, shape (M,). [s]"""
        return np.asarray(self.planned.durations(self.speed_range[0][:, np.newaxis])[:, 0])

    @cached_property
    def idle_prior_w(self) -> Array:
        """True idle power at the start of each motion, shape (M,). [W]"""
        return self.planned.idle_power_start_w

    @cached_property
    def idle_post_w(self) -> Array:
        """True idle power at the end of each motion, shape (M,). [W]"""
        return self.planned.idle_power_end_w

    @cached_property
    def saturating_speed_limits(self) -> Array:
        """Lowest speed limit that gives the fastest run that is allowed, shape (M,). [-]"""
        return np.clip(self.planned.fastest_speed_limits(), *self.speed_range)

    def speed_limits(self, count: int) -> Array:
        """Equidistant speed limits of each motion from the slowest to the lowest of full speed, shape (M, S). [-]"""
        shares = np.linspace(0.0, 1.0, count)
        top, slowest = self.saturating_speed_limits[:, np.newaxis], self.speed_range[0][:, np.newaxis]
        return np.minimum(slowest + shares * (top - slowest), 1.0)

    @cached_property
    def least_cycles_s(self) -> Array:
        """Least cycle time of each tree, shape (T,): motions at full speed plus required waits. [s]"""
        return np.array(
            [g.least_cycle_s(self.d_min_s[rows].tolist()) for g, rows in zip(self.graphs, self.rows, strict=True)]
        )

    def predecessors(self, values: ArrayLike) -> Array:
        """Values of each motion's predecessor in its cycle, shape (M,) -> (M,)."""
        array = np.asarray(values, dtype=float)
        return np.concatenate([np.roll(array[rows], 1) for rows in self.rows])


def speed_range(moves: Sequence[MoveOperation], slowest_speed_limit: float) -> tuple[Array, Array]:
    """Lowest and highest speed limit that each of M moves may get, each of shape (M,), fractions in (0, 1].

    A given speed limit is the highest one, and a move that is given less than the slowest speed limit keeps its own.
    """
    highest = np.array([move.speed_limit_percent / 100.0 for move in moves])
    least = np.array([(move.least_speed_percent or 0.0) / 100.0 for move in moves])
    fixed = np.array([move.fixed for move in moves], dtype=bool)
    lowest = np.minimum(np.maximum(least, slowest_speed_limit), highest)
    return np.where(fixed, highest, lowest), highest


def _of_motions(of_moves: tuple[Array, Array], owner: Index, leaders: Index) -> tuple[Array, Array]:
    """Lowest and highest speed limit of motions, within which one of their moves may differ.

    Args:
        of_moves: Lowest and highest speed limits of K moves.
        owner: Motion whose speed limit each move has, shape (K,).
        leaders: The same of each motion, shape (M,).
    """
    lowest, highest = np.full(len(leaders), np.inf), np.zeros(len(leaders))
    np.minimum.at(lowest, owner, of_moves[0])
    np.maximum.at(highest, owner, of_moves[1])
    return lowest[leaders], highest[leaders]


def percent_of(speed_limit: float, given_percent: float | None = None) -> float:
    """A speed limit as it is written: as it was given, or in few digits, where that is the very same number. [%]"""
    plain = (given_percent, round(100.0 * speed_limit, 6))
    return next((p for p in plain if p is not None and p / 100.0 == speed_limit), 100.0 * speed_limit)
