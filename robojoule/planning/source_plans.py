"""Plans on energy profiles of any source, with a proven bound where the source encloses the true profiles.

Profiles need not be known everywhere, only where plans are. Each round plans every cycle time on the profiles below
the true ones (all cycle times at once, see `robojoule.planning.pareto`) and asks the source for more where the profiles
above and below differ at that plan. As the plan could be executed on the profiles above, the sum of these differences
bounds the gap; when it is small enough, or the source has no more to tell, the planning model gives the final plan on
the profiles above.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.chain import chain_plans
from robojoule.planning.costs import VertexCosts, joined_costs
from robojoule.planning.graph import process_energy_j
from robojoule.planning.pareto import pareto_curve
from robojoule.planning.schedule import Schedule
from robojoule.profile.enclosure import Enclosure
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.source import ProfileSource
from robojoule.progress import tell

RELATIVE_GAP = 5e-4  # of a plan to its proven bound, at which no more is asked of the source
MAX_ROUNDS = 15
_MILP_GAP = 1e-7


@dataclass(frozen=True, eq=False)
class SourcePlans:
    """Plans of all trees with the costs that they were made from.

    Attributes:
        plans: R plans for each tree. By what the source knows, `energy_j` is met or undercut, and `bound_j` bounds the
            energy of every plan of that cycle time from below; both hold the energy of process steps.
        costs: Costs of each tree's vertices: profiles above the true ones, idle power.
    """

    plans: list[list[Schedule]]
    costs: list[list[VertexCosts]]


def plan_on_source(
    source: ProfileSource, batch: TreeBatch, cycle_times_s: Array, *, relative_gap: float = RELATIVE_GAP
) -> SourcePlans:
    """Plan every tree at its cycle times.

    Args:
        source: Profiles of the motions of the batch.
        batch: Trees.
        cycle_times_s: Cycle times of each tree, shape (T, R). [s]
        relative_gap: Proven gap of each plan at which no more is asked of the source. [-]

    Raises:
        CycleTimeTooShort: A cycle time in which the fastest cycle does not fit.
        PlanningError: The solver failed.
    """
    times = np.asarray(cycle_times_s, dtype=float)
    search = _Search(source, batch, times, relative_gap)
    for _ in range(MAX_ROUNDS):
        if not search.refine():
            break
    plans, costs = [], []
    for tree in range(len(batch.trees)):
        of_tree = search.costs(tree, [known.above for known in search.enclosures(tree)])
        step = process_energy_j(batch.trees[tree])
        found = chain_plans(batch.graphs[tree], of_tree, times[tree], relative_gap=_MILP_GAP)
        bounds = search.bounds_j(tree)
        # Where only one plan is possible, all at full speed, it is its own bound, with the energies that are known: the
        # profile above may lie higher there.
        only = times[tree] <= batch.least_cycles_s[tree] * (1.0 + 1e-12)
        excess = search.excess_at_full_speed_j(tree)
        plans.append(
            [
                replace(
                    plan,
                    energy_j=plan.energy_j - (excess if alone else 0.0) + step,
                    bound_j=(plan.energy_j - excess if alone else bound) + step,
                )
                for plan, bound, alone in zip(found, bounds.tolist(), only.tolist(), strict=True)
            ]
        )
        costs.append(of_tree)
    return SourcePlans(plans, costs)


class _Search:
    """Profiles of a batch, refined where plans are."""

    def __init__(self, source: ProfileSource, batch: TreeBatch, times: Array, relative_gap: float) -> None:
        self.source = source
        self.batch = batch
        self.times = times
        self.relative_gap = relative_gap
        self._known: dict[int, Enclosure] = {}
        self._open = list(range(len(batch.trees)))
        self._motions = batch.planned.motions
        self._missing = 0.0  # share of the work on these that is left

    def enclosures(self, tree: int) -> list[Enclosure]:
        """What is known of the profiles of a tree's motions."""
        rows = self.batch.rows[tree]
        for motion in range(rows.start, rows.stop):
            if motion not in self._known:
                self._known[motion] = self.source.enclosure(motion)
        return [self._known[motion] for motion in range(rows.start, rows.stop)]

    def costs(self, tree: int, profiles: list[PiecewiseLinearProfile]) -> list[VertexCosts]:
        """Costs of a tree's vertices with the source's idle power."""
        rows = self.batch.rows[tree]
        return joined_costs(profiles, self.source.idle_start_w[rows], self.source.idle_end_w[rows])

    def excess_at_full_speed_j(self, tree: int) -> float:
        """By how much the profiles above exceed the energy of the fastest runs of a tree. [J]"""
        return sum(float(known.above.energies_j[0] - known.fastest_j) for known in self.enclosures(tree))

    def bounds_j(self, tree: int) -> Array:
        """Lower bound of the energy at each cycle time, without process steps, shape (R,). [J]"""
        below = self.costs(tree, [known.below for known in self.enclosures(tree)])
        return pareto_curve(self.batch.graphs[tree], below).energy_j(self.times[tree])

    def refine(self) -> bool:
        """One round for all trees that are not near enough to their bounds; false if there is nothing to do."""
        wanted: dict[int, Array] = {}
        self._missing = 0.0
        trees = {tree: self._wanted(tree) for tree in self._open}
        for found in trees.values():
            wanted.update(found)
        tell("profiles near the plan", self._motions - self._missing, self._motions)
        refined = self.source.refine_near(wanted)
        for motion in refined:
            del self._known[motion]
        self._open = [tree for tree, found in trees.items() if not found.keys().isdisjoint(refined)]
        return bool(self._open)

    def _wanted(self, tree: int) -> dict[int, Array]:
        """Durations at which more must be known, by motion."""
        known, graph, times = self.enclosures(tree), self.batch.graphs[tree], self.times[tree]
        below = pareto_curve(graph, self.costs(tree, [one.below for one in known]))
        above = pareto_curve(graph, self.costs(tree, [one.above for one in known]))
        bounds, energies = below.energy_j(times), above.energy_j(times)
        loose = (energies - bounds > self.relative_gap * energies) & (times > self.batch.least_cycles_s[tree])
        planned = below.plan_durations_s(times[loose])
        allowed = self.relative_gap * energies[loose] / len(known)
        wanted = {}
        for vertex, one in enumerate(known):
            at = planned[:, vertex]
            difference = one.above.value(at) - one.below.value(at)
            missing = difference > allowed
            if missing.any():
                wanted[self.batch.rows[tree].start + vertex] = np.unique(at[missing])
                self._missing += 1.0 - float(np.sqrt((allowed[missing] / difference[missing]).min()))
        return wanted
