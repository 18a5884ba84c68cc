"""`optimum`: the least energy that a cycle can take, to within a small proven gap: what every method is held against.

Profiles are simulated densely to begin with and refined where plans are until the proven lower bound is near, so that
all that separates this method from `robojoule_simulated` is its effort.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.source_plans import plan_on_source
from robojoule.profile.adaptive import AdaptiveProfiles

TARGET_GAP = 8e-5  # relative gap between plan and bound at which the refinement ends


@dataclass(frozen=True)
class Optimum:
    """Planning on densely simulated profiles.

    Attributes:
        speed_limits: Number of equidistant speed limits at which each motion is simulated to begin with.
    """

    speed_limits: int
    variant: ClassVar[Variant] = Variant("optimum")

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree, each plan with a proven bound; see `Method.plan`."""
        profiles = AdaptiveProfiles(batch.paths, batch.slowest_speed_limit, self.speed_limits)
        found = plan_on_source(profiles, batch, cycle_times_s, relative_gap=TARGET_GAP)
        return MethodPlans(found.plans, costs=found.costs, runs_per_motion=float(profiles.runs.mean()))
