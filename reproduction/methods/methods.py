"""The methods that are compared: what each believes about a motion, and the rules that need no solver.

A method is either a rule (`unoptimized`, `uniform`, `greedy`) that returns plans at once, or a list of `VertexCosts`
that goes through the planning model (`krc_polynomial`, `predicted_three_segment`; `optimum` has a module of its own).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reproduction.methods.polynomial_profile import POWERS, fit_polynomial
from reproduction.methods.three_segment_profile import ThreeSegmentShape, three_segment_profile
from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.rule import rule_plan
from robojoule.planning.schedule import Schedule, check_cycle_time
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.sampled import SampledProfile, sampled_profile

PROFILING_RUNS = 5  # runs from which the original plug-in fits Eq. 3.1
PREDICTOR_RUNS = 2  # runs (fastest, slowest) from which the predictor takes its features
# Of plans that are equal for the three-segment profile, whose rising slope is its idle power, take the one that waits.
WAIT_PREFERENCE_W = 1e-4
_BISECTIONS = 45


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

    def fits(limits: Array) -> NDArray[np.bool_]:
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


def greedy(graph: OptimizationGraph, profiles: Sequence[SampledProfile], cycle_time_s: float) -> Schedule:
    """Slow the steepest motion (thesis Eq. 4.1) to its measured optimum, then the next; the last one partially.

    Args:
        graph: Graph of one robot.
        profiles: Measured runs of each vertex.
        cycle_time_s: Cycle time. [s]

    Raises:
        CycleTimeTooShort: The fastest cycle does not fit.
    """
    durations = np.array([profile.durations_s[0] for profile in profiles])
    check_cycle_time(graph, durations, cycle_time_s)
    left = max(cycle_time_s - graph.least_cycle_s(durations.tolist()), 0.0)
    for v in sorted(range(len(profiles)), key=lambda v: -profiles[v].steepness_j_per_s):  # stable: ties in tree order
        added = min(float(profiles[v].durations_s[profiles[v].optimum] - durations[v]), left)
        durations[v] += added
        left -= added
    return rule_plan(graph, durations, cycle_time_s)


def profiling_speed_limits(batch: TreeBatch, spacing: str) -> Array:
    """Speed limits of the five profiling runs of each motion, all giving distinct runs.

    `speed`: equidistant from the slowest speed limit to the lowest one that gives the fastest run (above it, all runs
    are the same). `duration`: those whose durations are equidistant from d_min to d_max.

    Args:
        batch: Trees.
        spacing: "speed" or "duration".

    Returns:
        Shape (M, 5). [-]

    Raises:
        InputError: Unknown spacing.
    """
    shares = np.linspace(0.0, 1.0, PROFILING_RUNS)
    slowest, top = batch.slowest_speed_limit, batch.saturating_speed_limits[:, np.newaxis]
    if spacing == "speed":
        return np.asarray(np.minimum(slowest + shares * (top - slowest), 1.0))
    if spacing != "duration":
        raise InputError(f"unknown spacing '{spacing}'", allowed="speed, duration")
    wanted = batch.d_min_s + shares[:, np.newaxis] * (batch.d_max_s - batch.d_min_s)
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

    return _costs([chords(profile) for profile in runs], idle_prior_w, idle_post_w)


def three_segment_costs(
    d_min_s: ArrayLike,
    d_opt_s: ArrayLike,
    d_max_s: ArrayLike,
    saving_j: ArrayLike,
    penalty_j: ArrayLike,
    shape: ThreeSegmentShape,
) -> list[VertexCosts]:
    """Costs as the thesis predicts them, for the vertices of one cycle in order: Eq. 5.11, idle power from its slope.

    A vertex whose profile has no rising line (a motion of zero length) takes the idle power of the vertex before it.

    Args:
        d_min_s: Duration at full speed, shape (V,). [s]
        d_opt_s: Predicted optimal duration, shape (V,). [s]
        d_max_s: Duration at the slowest speed limit, shape (V,). [s]
        saving_j: Predicted saving, shape (V,). [J]
        penalty_j: Predicted penalty, shape (V,). [J]
        shape: Constants of the form.

    Raises:
        InputError: No vertex has a rising line.
    """
    columns = np.array([d_min_s, d_opt_s, d_max_s, saving_j, penalty_j], dtype=float).T.tolist()
    built = [
        three_segment_profile(d_min, d_opt, d_max, saving, penalty, shape)
        for d_min, d_opt, d_max, saving, penalty in columns
    ]
    idle = [slope for _, slope in built]
    if not any(slope > 0.0 for slope in idle):
        raise InputError("no motion of the cycle has a rising energy profile, from which idle power could be taken")
    filled = []
    for v in range(len(idle)):
        before = (idle[(v - back) % len(idle)] for back in range(len(idle)))
        filled.append(next(slope for slope in before if slope > 0.0))
    return _costs([profile for profile, _ in built], filled, filled)


def sampled_profiles(durations_s: Array, energies_j: Array, speed_limits: Array) -> list[SampledProfile]:
    """Distinct runs of each motion; all arrays have shape (M, S)."""
    return [sampled_profile(d, e, p) for d, e, p in zip(durations_s, energies_j, speed_limits, strict=True)]


def _costs(
    profiles: Sequence[PiecewiseLinearProfile], idle_prior_w: ArrayLike, idle_post_w: ArrayLike
) -> list[VertexCosts]:
    prior, post = np.asarray(idle_prior_w, dtype=float).tolist(), np.asarray(idle_post_w, dtype=float).tolist()
    return [VertexCosts(profile, n, w) for profile, n, w in zip(profiles, prior, post, strict=True)]
