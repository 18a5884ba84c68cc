"""`robojoule_predicted`: plans on predicted profiles and idle power; no run of a new motion is simulated for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.source_plans import plan_on_source
from robojoule.profile.source import ProfileSource


@dataclass(frozen=True, eq=False)
class RobojoulePredicted:
    """Planning on predicted profiles.

    Attributes:
        profiles: Profiles of the M motions.
    """

    profiles: ProfileSource
    variant: ClassVar[Variant] = Variant("robojoule_predicted")

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree; see `Method.plan`."""
        found = plan_on_source(self.profiles, batch, cycle_times_s)
        return MethodPlans(found.plans, costs=found.costs)
