"""`robojoule_simulated`: plans on simulated profiles that are refined where plans are, with a proven bound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.source_plans import plan_on_source
from robojoule.profile.adaptive import AdaptiveProfiles


@dataclass(frozen=True)
class RobojouleSimulated:
    """Planning on few simulated runs of each motion."""

    variant: ClassVar[Variant] = Variant("robojoule_simulated")

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree; see `Method.plan`."""
        profiles = AdaptiveProfiles(batch.paths, batch.slowest_speed_limit)
        found = plan_on_source(profiles, batch, cycle_times_s)
        return MethodPlans(found.plans, costs=found.costs, runs_per_motion=float(profiles.runs.mean()))
