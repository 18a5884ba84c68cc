"""`unoptimized`: every motion at full speed, then wait at HOME (the baseline of thesis Eq. 6.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.rule import rule_plans


@dataclass(frozen=True)
class Unoptimized:
    """Full speed, then wait."""

    variant: ClassVar[Variant] = Variant("unoptimized")

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree; see `Method.plan`."""
        shape = batch.paths.motions, cycle_times_s.shape[1]
        durations = np.broadcast_to(batch.d_min_s[:, np.newaxis], shape)
        return MethodPlans(rule_plans(batch, durations, cycle_times_s), np.ones(shape))
