"""`robojoule_simulated`: plans on simulated profiles that are refined where plans are, with a proven bound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.source_plans import RELATIVE_GAP, plan_on_source
from robojoule.profile.adaptive import AdaptiveProfiles


@dataclass(frozen=True)
class RobojouleSimulated:
    """Planning on few simulated runs of each motion.

    Attributes:
        first_runs: Runs of each motion to begin with, at equidistant speed limits; a few if not given.
        relative_gap: Gap between plan and proven bound at which the refinement ends. [-]
    """

    first_runs: int | None = None
    relative_gap: float = RELATIVE_GAP
    variant: ClassVar[Variant] = Variant("robojoule_simulated")

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree, each plan with a proven bound; see `Method.plan`."""
        profiles = AdaptiveProfiles(batch.paths, batch.slowest_speed_limit, self.first_runs)
        found = plan_on_source(profiles, batch, cycle_times_s, relative_gap=self.relative_gap)
        return MethodPlans(found.plans, costs=found.costs, runs_per_motion=float(profiles.runs.mean()))
