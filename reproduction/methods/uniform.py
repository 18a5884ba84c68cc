"""`uniform`: one speed limit for the whole tree, the lowest that meets the cycle time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reproduction.methods.method import MethodPlans, Variant
from robojoule.arrays import Array, Mask
from robojoule.planning.batch import TreeBatch
from robojoule.planning.rule import rule_plans

_BISECTIONS = 45


@dataclass(frozen=True)
class Uniform:
    """One speed limit for all motions of a tree."""

    variant: ClassVar[Variant] = Variant("uniform")

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree; see `Method.plan`."""
        common = uniform_speed_limits(batch, cycle_times_s)
        limits = np.repeat(common, [rows.stop - rows.start for rows in batch.rows], axis=0)
        return MethodPlans(rule_plans(batch, batch.paths.durations(limits), cycle_times_s), limits)


def uniform_speed_limits(batch: TreeBatch, cycle_times_s: Array) -> Array:
    """Lowest common speed limit of all motions of a tree that meets the cycle time.

    Args:
        batch: Trees.
        cycle_times_s: Cycle times of each tree, shape (T, R). [s]

    Returns:
        Speed limits, shape (T, R); not below the batch's slowest one. [-]
    """
    fastest = np.array([batch.d_min_s[rows].sum() for rows in batch.rows])
    required_waits = batch.least_cycles_s - fastest
    budget = np.asarray(cycle_times_s, dtype=float) - required_waits[:, np.newaxis]
    counts = [rows.stop - rows.start for rows in batch.rows]

    def fits(limits: Array) -> Mask:
        durations = batch.paths.durations(np.repeat(limits, counts, axis=0))
        return np.asarray(np.array([durations[rows].sum(axis=0) for rows in batch.rows]) <= budget)

    low, high = np.full_like(budget, batch.slowest_speed_limit), np.ones_like(budget)
    slow_enough = fits(low)
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        fast_enough = fits(middle)
        high = np.where(fast_enough, middle, high)
        low = np.where(fast_enough, low, middle)
    return np.where(slow_enough, batch.slowest_speed_limit, high)
