"""What comes of a method's plans: they are written into the trees, simulated, and refused where they cannot be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array
from robojoule.errors import PlanningError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, simulate_trees
from robojoule.planning.writeback import speed_limits_of_plans, write_plans

BELOW_OPTIMUM = 1e-4  # no plan may be better than the optimum by more than this share
LATE_S = 1e-6  # nor longer than its cycle time by more than this


@dataclass(frozen=True, eq=False)
class Outcome:
    """Plans of a method and their simulation.

    Attributes:
        planned: R plans for each of T trees.
        runs: What the simulation of the written trees gave, R for each tree.
    """

    planned: MethodPlans
    runs: list[list[CycleRun]]

    @cached_property
    def energy_j(self) -> Array:
        """Simulated energies of the cycles, shape (T, R). [J]"""
        return np.array([[run.energy_j for run in of_tree] for of_tree in self.runs])


def cycle_times_s(batch: TreeBatch, cycle_times_percent: Sequence[float]) -> Array:
    """Cycle times of each tree from shares of its least one [%], shape (T, R). [s]"""
    return np.asarray(batch.least_cycles_s[:, np.newaxis] * np.asarray(cycle_times_percent) / 100.0)


def simulate_plans(batch: TreeBatch, planned: Sequence[MethodPlans]) -> list[Outcome]:
    """Write the plans of some methods into their trees and simulate these, all in one call."""
    by_tree = [[plan for one in planned for plan in one.plans[tree]] for tree in range(len(batch.trees))]
    limits = [
        speed_limits_of_plans(batch, one.plans) if one.speed_limits is None else one.speed_limits for one in planned
    ]
    runs = simulate_trees(batch, write_plans(batch, by_tree, np.concatenate(limits, axis=1)))
    ends = np.cumsum([of_method.shape[1] for of_method in limits]).tolist()
    return [
        Outcome(one, [of_tree[end - of_method.shape[1] : end] for of_tree in runs])
        for one, of_method, end in zip(planned, limits, ends, strict=True)
    ]


def joined_outcomes(pieces: Sequence[Outcome]) -> Outcome:
    """Outcome of a method for the trees of several batches, in their order."""
    planned = [piece.planned for piece in pieces]
    costs = [piece.costs for piece in planned if piece.costs is not None]
    limits = [piece.speed_limits for piece in planned if piece.speed_limits is not None]
    motions = [sum(len(of_tree[0].durations_s) for of_tree in piece.plans) for piece in planned]
    runs = sum(piece.runs_per_motion * count for piece, count in zip(planned, motions, strict=True))
    together = MethodPlans(
        [of_tree for piece in planned for of_tree in piece.plans],
        np.concatenate(limits) if limits else None,
        [of_tree for piece in costs for of_tree in piece] if costs else None,
        runs / sum(motions),
    )
    return Outcome(together, [of_tree for piece in pieces for of_tree in piece.runs])


def full_speed_energies_j(batch: TreeBatch) -> Array:
    """EC_dmin: energy of each tree's fastest cycle, shape (T,): motions at full speed and required waits. [J]"""
    energies = batch.paths.simulate([1.0]).energy_j[:, 0]
    prior, post = (
        np.array([getattr(vertex, name) for graph in batch.graphs for vertex in graph.vertices])
        for name in ("least_prior_wait_s", "least_post_wait_s")
    )
    total = energies + prior * batch.idle_prior_w + post * batch.idle_post_w
    return np.array([total[rows].sum() for rows in batch.rows])


def verify(outcomes: Mapping[Variant, Outcome], cycle_times_percent: Sequence[float]) -> None:
    """Refuse results that cannot be: late cycles, plans better than the proven optimum.

    Args:
        outcomes: Outcomes of all methods, the optimum among them.
        cycle_times_percent: Their R cycle times as shares of the least one. [%]

    Raises:
        PlanningError: With the method, the tree and the cycle time.
    """
    best = outcomes[Variant("optimum")]
    for variant, outcome in outcomes.items():
        for tree, (plans, runs) in enumerate(zip(outcome.planned.plans, outcome.runs, strict=True)):
            for r, (plan, run) in enumerate(zip(plans, runs, strict=True)):
                case = f"{variant.method}, tree {tree + 1}, {cycle_times_percent[r]:g} %"
                late = run.cycle_time_s - plan.cycle_time_s
                if not abs(late) <= LATE_S:
                    raise PlanningError(f"the simulated cycle differs from the planned one by {late:.3g} s ({case})")
                optimum_j = best.runs[tree][r].energy_j
                if run.energy_j < (1.0 - BELOW_OPTIMUM) * optimum_j:
                    raise PlanningError(
                        f"a plan takes {run.energy_j:.3f} J, less than the optimum, {optimum_j:.3f} J ({case})"
                    )
                if outcome is best and plan.bound_j < (1.0 - BELOW_OPTIMUM) * run.energy_j:
                    raise PlanningError(
                        f"the proven bound {plan.bound_j:.3f} J is too far below the optimum's simulated "
                        f"{run.energy_j:.3f} J ({case})"
                    )
