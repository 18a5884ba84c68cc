"""The optimisation graph (thesis 3.1): vertices, their order within and between robots, possible collisions.

A vertex is a fine move, or a group of coarse moves with the fine move that ends it: between two stops the robot cannot
wait, and has one speed limit, which each move takes as far as its own range allows. Vertices with moves of one speed
group have one speed limit, too. Wait operations, process steps and waits that stand at a move become least waits of the
neighbouring vertex; a plan may only lengthen them. Waits that an earlier plan added (`added_wait_after_s`) are none of
them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from robojoule.arrays import Index
from robojoule.errors import InputError
from robojoule.programs.operation_tree import MoveOperation, OperationTree, ProcessOperation, WaitOperation


class Phase(Enum):
    """Phase of a vertex in which it occupies space."""

    PRIOR = "N"  # waits at its start
    MOVE = "M"
    POST = "W"  # waits at its end


@dataclass(frozen=True)
class Vertex:
    """A movement between two stops of one robot.

    Attributes:
        name: Unique name (that of its fine move).
        robot: Name of the robot that executes it.
        moves: Names of its moves in order; the last one is fine.
        least_prior_wait_s: Least wait before the movement. [s]
        least_post_wait_s: Least wait after the movement. [s]
        leader: First of the vertices that have the same speed limit; None: itself.
    """

    name: str
    robot: str
    moves: tuple[str, ...] = ()
    least_prior_wait_s: float = 0.0
    least_post_wait_s: float = 0.0
    leader: str | None = None


@dataclass(frozen=True)
class Arc:
    """Order of two vertices: an edge of E within one robot, a link of L between two robots.

    Attributes:
        tail: Vertex u that comes first.
        head: Vertex v that comes after it.
        cycle_shift: h_uv: 1 if v belongs to the next cycle, else 0.
    """

    tail: str
    head: str
    cycle_shift: int = 0


@dataclass(frozen=True)
class Collision:
    """A quadruple of CR: two vertices of different robots that may not be in these phases at the same time.

    Attributes:
        first: Name of the one vertex.
        first_phase: Its phase.
        second: Name of the other vertex.
        second_phase: Its phase.
    """

    first: str
    first_phase: Phase
    second: str
    second_phase: Phase


@dataclass(frozen=True)
class OptimizationGraph:
    """G = (V, E + L, CR).

    Attributes:
        vertices: V, in order of execution for each robot.
        edges: E, order within a robot; every robot's edges close its cycle.
        links: L, order between robots.
        collisions: CR; empty for one robot.

    Raises:
        InputError: Duplicate vertex, unknown vertex, an edge between robots, a link or a collision within one robot.
    """

    vertices: tuple[Vertex, ...]
    edges: tuple[Arc, ...]
    links: tuple[Arc, ...] = ()
    collisions: tuple[Collision, ...] = ()
    index: dict[str, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        index: dict[str, int] = {}
        for position, vertex in enumerate(self.vertices):
            if vertex.name in index:
                raise InputError(f"the vertex '{vertex.name}' appears twice", key="vertices")
            index[vertex.name] = position
        object.__setattr__(self, "index", index)
        for key, pairs, same_robot in (
            ("edges", [(arc.tail, arc.head) for arc in self.edges], True),
            ("links", [(arc.tail, arc.head) for arc in self.links], False),
            ("collisions", [(pair.first, pair.second) for pair in self.collisions], False),
        ):
            for u, v in pairs:
                for name in (u, v):
                    if name not in index:
                        raise InputError(f"'{name}' is not a vertex of the graph", key=key, allowed=", ".join(index))
                if (self.robot_of(u) == self.robot_of(v)) != same_robot:
                    demand = "the same robot" if same_robot else "different robots"
                    raise InputError(f"'{u}' and '{v}' must belong to {demand}", key=key)

    @property
    def leaders(self) -> Index:
        """Of each vertex, the place of the first one that has the same speed limit, shape (V,)."""
        places = [place if v.leader is None else self.index[v.leader] for place, v in enumerate(self.vertices)]
        return np.array(places, dtype=np.intp)

    def robot_of(self, vertex: str) -> str:
        """Robot that executes a vertex."""
        return self.vertices[self.index[vertex]].robot

    @property
    def robots(self) -> tuple[str, ...]:
        """R, in the order of their first vertices."""
        return tuple(dict.fromkeys(vertex.robot for vertex in self.vertices))

    def least_cycle_s(self, least_durations_s: Sequence[float]) -> float:
        """Longest of the robots' shortest cycles: movements at least duration plus least waits. [s]

        A lower bound of the cycle time; with one robot, without collisions and links, the least cycle time itself.

        Args:
            least_durations_s: Shortest duration of each vertex, in the order of `vertices`. [s]
        """
        totals = dict.fromkeys(self.robots, 0.0)
        for vertex, duration in zip(self.vertices, least_durations_s, strict=True):
            totals[vertex.robot] += duration + vertex.least_prior_wait_s + vertex.least_post_wait_s
        return max(totals.values())


def graph_of_tree(tree: OperationTree, robot: str | None = None) -> OptimizationGraph:
    """Transform an operation tree into the optimisation graph of one robot.

    A wait or process step belongs to the movement that ends where it takes place; what comes before the first move
    belongs to the start of that one.

    Args:
        tree: Operation tree.
        robot: Name of the robot; that of the tree unless given.
    """
    name = robot or tree.robot or "robot"
    groups: list[list[MoveOperation]] = [[]]
    standing: list[float] = [0.0]  # before the first vertex, after the first, after the second ...
    for operation in tree.atomic():
        if isinstance(operation, (WaitOperation, ProcessOperation)):
            standing[-1] += operation.duration_s
        if not isinstance(operation, MoveOperation):
            continue
        groups[-1].append(operation)
        if operation.is_fine:
            groups.append([])
            standing.append(0.0)
    leaders = _leaders(groups[:-1])
    vertices = [
        Vertex(
            name=moves[-1].name,
            robot=name,
            moves=tuple(move.name for move in moves),
            least_prior_wait_s=moves[0].wait_before_s + (standing[0] if position == 0 else 0.0),
            least_post_wait_s=moves[-1].wait_after_s + standing[position + 1],
            leader=None if leaders[position] == position else groups[leaders[position]][-1].name,
        )
        for position, moves in enumerate(groups[:-1])
    ]
    edges = [
        Arc(u.name, v.name, cycle_shift=int(position == len(vertices) - 1))
        for position, (u, v) in enumerate(zip(vertices, vertices[1:] + vertices[:1], strict=True))
    ]
    return OptimizationGraph(tuple(vertices), tuple(edges))


def _leaders(groups: Sequence[Sequence[MoveOperation]]) -> list[int]:
    """Of each group of moves, the first one that it shares speed groups with, directly or through others."""
    leaders = list(range(len(groups)))
    first: dict[str, int] = {}
    for position, moves in enumerate(groups):
        for name in dict.fromkeys(move.speed_group for move in moves if move.speed_group is not None):
            one, other = leaders[first.setdefault(name, position)], leaders[position]
            low, high = min(one, other), max(one, other)
            leaders = [low if leader == high else leader for leader in leaders]
    return leaders


def process_energy_j(tree: OperationTree) -> float:
    """Energy of the process steps themselves, which no plan changes. [J]"""
    return sum(step.power_w * step.duration_s for step in tree.atomic() if isinstance(step, ProcessOperation))
