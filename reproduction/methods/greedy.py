"""`greedy`: slow the steepest motions first, to the optimum of their simulated runs (thesis 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.rule import rule_plan
from robojoule.planning.schedule import Schedule, check_cycle_time
from robojoule.profile.sampled import SampledProfile


@dataclass(frozen=True, eq=False)
class Greedy:
    """Slowing in the order of steepness.

    Attributes:
        profiles: Simulated runs of each of the M motions.
        runs_per_motion: How many were simulated.
    """

    profiles: Sequence[SampledProfile]
    runs_per_motion: int
    variant: ClassVar[Variant] = Variant("greedy")

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree; see `Method.plan`."""
        plans = [
            [greedy_plan(graph, self.profiles[rows], float(time)) for time in row]
            for graph, rows, row in zip(batch.graphs, batch.rows, cycle_times_s, strict=True)
        ]
        return MethodPlans(plans, runs_per_motion=self.runs_per_motion)


def greedy_plan(graph: OptimizationGraph, profiles: Sequence[SampledProfile], cycle_time_s: float) -> Schedule:
    """Slow the steepest motion (thesis Eq. 4.1) to its simulated optimum, then the next; the last one partially.

    Args:
        graph: Graph of one robot.
        profiles: Simulated runs of each vertex.
        cycle_time_s: Cycle time. [s]

    Raises:
        CycleTimeTooShort: The fastest cycle does not fit.
    """
    durations = np.array([profile.durations_s[0] for profile in profiles])
    check_cycle_time(graph, durations, cycle_time_s)
    left = max(cycle_time_s - graph.least_cycle_s(durations.tolist()), 0.0)
    for v in sorted(range(len(profiles)), key=lambda v: -profiles[v].steepness_j_per_s):  # stable: ties in tree order
        added = min(float(profiles[v].durations_s[profiles[v].optimum] - durations[v]), left)
        durations[v] += added
        left -= added
    return rule_plan(graph, durations, cycle_time_s)
