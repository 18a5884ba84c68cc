"""What every planning method that is compared offers: a name with its settings, and plans for trees and cycle times."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.schedule import Schedule

Planner = Callable[[OptimizationGraph, Sequence[VertexCosts], Array, float], list[Schedule]]
"""Plans one tree by costs for R cycle times [s], with a preference [W] for waiting; `model_plans` or `chain_plans`."""


@dataclass(frozen=True)
class Variant:
    """A method with its settings.

    Attributes:
        method: Name of the method.
        krc_segments: Number of chords of `krc_polynomial`, else none.
        point_spacing: "speed" or "duration": how its profiling runs are spaced; else none.
    """

    method: str
    krc_segments: int | None = None
    point_spacing: str | None = None

    @property
    def name(self) -> str:
        """Name in tables, where one spacing is quoted: `krc_polynomial_6`."""
        return self.method + (f"_{self.krc_segments}" if self.krc_segments else "")


@dataclass(frozen=True, eq=False)
class MethodPlans:
    """Plans of a method.

    Attributes:
        plans: R plans for each tree.
        speed_limits: Speed limits of the motions, shape (M, R), where the method chooses them itself; else the lowest
            that keep the plans' durations are taken. [-]
        costs: What the method believes of each tree's vertices; none for rules.
        runs_per_motion: Runs of the controller's simulation that the method needs for a new motion, on average.
    """

    plans: list[list[Schedule]]
    speed_limits: Array | None = None
    costs: list[list[VertexCosts]] | None = None
    runs_per_motion: float = 0.0


class Method(Protocol):
    """A planning method with what it knows of the motions of a batch."""

    @property
    def variant(self) -> Variant:
        """Its name and settings."""
        ...

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree.

        Args:
            batch: Trees.
            cycle_times_s: Cycle times of each tree, shape (T, R). [s]
        """
        ...


def plans_by_costs(
    batch: TreeBatch,
    costs: list[list[VertexCosts]],
    cycle_times_s: Array,
    planner: Planner,
    *,
    runs_per_motion: float,
    preference_w: float = 0.0,
) -> MethodPlans:
    """Plans of a method that believes in costs, a list per tree; see `Planner` and `MethodPlans`."""
    plans = [
        planner(graph, of_tree, row, preference_w)
        for graph, of_tree, row in zip(batch.graphs, costs, cycle_times_s, strict=True)
    ]
    return MethodPlans(plans, costs=costs, runs_per_motion=runs_per_motion)
