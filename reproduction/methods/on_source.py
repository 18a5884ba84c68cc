"""Plans on profiles of any source: `robojoule_predicted` on predicted ones, without a run of a new motion."""

from __future__ import annotations

from dataclasses import dataclass

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.source_plans import plan_on_source
from robojoule.profile.source import ProfileSource


@dataclass(frozen=True, eq=False)
class OnSource:
    """A method that is nothing but a source of profiles.

    Attributes:
        variant: Its name.
        profiles: Profiles of the M motions.
    """

    variant: Variant
    profiles: ProfileSource

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree; see `Method.plan`."""
        found = plan_on_source(self.profiles, batch, cycle_times_s)
        return MethodPlans(found.plans, costs=found.costs)
