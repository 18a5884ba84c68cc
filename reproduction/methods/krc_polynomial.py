"""`krc_polynomial`: the original plug-in, which plans on chords of Eq. 3.1 through five runs of each motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from reproduction.methods.method import MethodPlans, Planner, Variant, plans_by_costs
from reproduction.methods.polynomial_profile import POWERS, fit_polynomial
from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts, joined_costs
from robojoule.planning.solver import model_plans
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.sampled import SampledProfile, sampled_profiles

PROFILING_RUNS = 5  # runs from which the original plug-in fits Eq. 3.1
POINT_SPACINGS = ("speed", "duration")


@dataclass(frozen=True, eq=False)
class KrcPolynomial:
    """Planning on chords of the polynomial profile.

    Attributes:
        segments: Number of chords.
        point_spacing: How the profiling runs are spaced, see `profiling_speed_limits`.
        idle_end_w: Idle power at the end of each motion as the plug-in takes it, shape (M,). [W]
        slowest_profiling: Speed limit of the slowest profiling run, a fraction. The thesis does not state it.
        planner: Solves the planning model.
    """

    segments: int
    point_spacing: str
    idle_end_w: Array
    slowest_profiling: float
    planner: Planner = model_plans

    @property
    def variant(self) -> Variant:
        """Name, number of chords and spacing."""
        return Variant("krc_polynomial", self.segments, self.point_spacing)

    def plan(self, batch: TreeBatch, cycle_times_s: Array) -> MethodPlans:
        """Plan every tree; see `Method.plan`."""
        limits = profiling_speed_limits(batch, self.point_spacing, self.slowest_profiling)
        runs = batch.paths.simulate(limits)
        profiles = sampled_profiles(runs.duration_s, runs.energy_j, limits)
        prior = batch.predecessors(self.idle_end_w)
        costs = [
            polynomial_costs(profiles[rows], self.segments, prior[rows], self.idle_end_w[rows]) for rows in batch.rows
        ]
        return plans_by_costs(batch, costs, cycle_times_s, self.planner, runs_per_motion=PROFILING_RUNS)


def profiling_speed_limits(batch: TreeBatch, spacing: str, slowest: float) -> Array:
    """Speed limits of the five profiling runs of each motion, all giving distinct runs.

    `speed`: equidistant from the slowest to the lowest one that gives the fastest run (above it, all runs
    are the same). `duration`: those whose durations are equidistant from d_min to the slowest one's.

    Args:
        batch: Trees.
        spacing: "speed" or "duration".
        slowest: Speed limit of the slowest run, a fraction; not below that of the plans.

    Returns:
        Shape (M, 5). [-]

    Raises:
        InputError: Unknown spacing.
    """
    shares = np.linspace(0.0, 1.0, PROFILING_RUNS)
    slowest, top = max(slowest, batch.slowest_speed_limit), batch.saturating_speed_limits[:, np.newaxis]
    if spacing == "speed":
        return np.asarray(np.minimum(slowest + shares * (top - slowest), 1.0))
    if spacing != "duration":
        raise InputError(f"unknown spacing '{spacing}'", allowed="speed, duration")
    d_max_s = batch.paths.durations([slowest])[:, 0]
    wanted = batch.d_min_s + shares[:, np.newaxis] * (d_max_s - batch.d_min_s)
    limits = np.stack([batch.paths.speed_limits_for_durations(durations) for durations in wanted], axis=1)
    limits[:, -1] = slowest
    return np.asarray(np.clip(limits, slowest, top))


def polynomial_costs(
    runs: Sequence[SampledProfile], segments: int, idle_prior_w: ArrayLike, idle_post_w: ArrayLike
) -> list[VertexCosts]:
    """Costs as the original plug-in sees them: Eq. 3.1 through a few runs, cut into equidistant chords.

    Args:
        runs: Profiling runs of each vertex; with fewer distinct runs than coefficients, chords join the runs.
        segments: Number of chords.
        idle_prior_w: Idle power at the start of each vertex. [W]
        idle_post_w: Idle power at its end. [W]
    """

    def chords(profile: SampledProfile) -> PiecewiseLinearProfile:
        if len(profile) < POWERS.size:
            return profile.piecewise()
        return fit_polynomial(profile.durations_s, profile.energies_j).chords(segments)

    return joined_costs([chords(profile) for profile in runs], idle_prior_w, idle_post_w)
