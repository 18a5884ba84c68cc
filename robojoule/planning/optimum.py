"""The true optimum of a cycle: the planning problem on densely simulated profiles with true idle power.

The dense runs of a motion are points of its true profile E(d). Chords through them give plans whose energy is met or
undercut by the simulation; the profile is sampled ever finer round the plans until the proven lower bound is as near.
The bound comes from the same model on profiles that lie below the true ones: where neighbouring chords bend upwards
(E is convex there), E lies above both of them extended, so their crossing replaces each chord; where they bend
downwards, E lies above the chord itself. This holds for every E that does not change its curvature twice between two
samples.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robojoule.planning.batch import TreeBatch
from robojoule.planning.graph import process_energy_j
from robojoule.planning.model import VertexCosts
from robojoule.planning.solve import PlanSolver, SpeedPlan
from robojoule.planning.writeback import stacked_durations
from robojoule.profile import PiecewiseLinearProfile, measured_profile
from robojoule.profile.piecewise import Array

TARGET_GAP = 9e-5  # relative gap between plan and bound at which the refinement ends
MORE_REFINEMENTS = 3
_NEW_POINTS = 6  # speed limits added on either side of a planned duration, a round
_MILP_GAP = 1e-6


class DenseProfiles:
    """True profiles of all motions of a batch, sampled where it matters.

    Args:
        batch: Trees.
        speed_limits: Number of equidistant speed limits to begin with, from the slowest one to the lowest one that
            gives the fastest run.
    """

    def __init__(self, batch: TreeBatch, speed_limits: int) -> None:
        self.batch = batch
        shares = np.linspace(0.0, 1.0, speed_limits)
        top = batch.saturating_speed_limits[:, np.newaxis]
        limits = np.minimum(batch.slowest_speed_limit + shares * (top - batch.slowest_speed_limit), 1.0)
        runs = batch.paths.simulate(limits)
        self.profiles = [
            measured_profile(d, e, p) for d, e, p in zip(runs.duration_s, runs.energy_j, limits, strict=True)
        ]

    def refine(self, durations_s: Array) -> None:
        """Sample each motion more densely between the neighbours of given durations.

        Args:
            durations_s: K durations of each motion, shape (M, K). [s]
        """
        shares = np.linspace(0.0, 1.0, 2 * _NEW_POINTS + 1)[1:-1]
        limits = np.ones((len(self.profiles), durations_s.shape[1], shares.size))
        for motion, profile in enumerate(self.profiles):
            if len(profile) < 2:
                continue
            at = np.clip(np.searchsorted(profile.durations_s, durations_s[motion] - 1e-9), 0, len(profile) - 1)
            slower = profile.speed_limits[np.minimum(at + 1, len(profile) - 1)]
            faster = profile.speed_limits[np.maximum(at - 1, 0)]
            limits[motion] = slower[:, np.newaxis] + shares * (faster - slower)[:, np.newaxis]
        flat = limits.reshape(len(self.profiles), -1)
        runs = self.batch.paths.simulate(flat)
        self.profiles = [
            measured_profile(
                np.append(profile.durations_s, d),
                np.append(profile.energies_j, e),
                np.append(profile.speed_limits, p),
            )
            for profile, d, e, p in zip(self.profiles, runs.duration_s, runs.energy_j, flat, strict=True)
        ]

    def costs(self, tree: int, *, below: bool = False) -> list[VertexCosts]:
        """Costs of one tree's vertices with true idle power.

        Args:
            tree: Index of the tree.
            below: Profiles that lie nowhere above the true ones, instead of chords.
        """
        rows = self.batch.rows[tree]
        prior, post = self.batch.idle_prior_w[rows].tolist(), self.batch.idle_post_w[rows].tolist()
        profiles = [profile.piecewise() for profile in self.profiles[rows]]
        if below:
            profiles = [profile_below(profile) for profile in profiles]
        return [VertexCosts(profile, n, w) for profile, n, w in zip(profiles, prior, post, strict=True)]


def profile_below(profile: PiecewiseLinearProfile) -> PiecewiseLinearProfile:
    """Profile below a function that is known at the breakpoints only (see the module's text).

    Args:
        profile: Samples of the function.

    Returns:
        Profile through the crossings; samples remain where a segment beside them has none. Convex if the samples are.
    """
    d, e, slopes = profile.durations_s, profile.energies_j.copy(), profile.slopes_w
    if slopes.size < 2:
        return profile
    # The first and the last segment have one neighbour: its line, extended to the end, replaces them.
    lowered = bool(slopes[0] < slopes[1]), bool(slopes[-2] < slopes[-1])
    if lowered[0]:
        e[0] = e[1] - slopes[1] * (d[1] - d[0])
    if lowered[1]:
        e[-1] = e[-2] + slopes[-2] * (d[-1] - d[-2])
    left, own, right, width = slopes[:-2], slopes[1:-1], slopes[2:], np.diff(d)[1:-1]
    from_left, from_right = left < own, own < right
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(from_left & from_right, (right - own) / (right - left), 0.5)
    at = d[1:-2] + share * width
    samples = profile.energies_j
    value = np.where(from_left, samples[1:-2] + left * share * width, samples[2:-1] - right * (1.0 - share) * width)
    crossed = from_left | from_right
    # A sample between two crossings (or lowered ends) lies above the line that joins them.
    beside = np.concatenate([[lowered[0]], crossed, [lowered[1]]])
    keep = np.concatenate([[True], ~(beside[:-1] & beside[1:]), [True]])
    durations, energies = np.concatenate([d[keep], at[crossed]]), np.concatenate([e[keep], value[crossed]])
    order = np.argsort(durations, kind="stable")
    durations, energies = durations[order], energies[order]
    distinct = np.concatenate([[True], np.diff(durations) > 0.0])
    return PiecewiseLinearProfile(durations[distinct], energies[distinct])


def optimal_plans(
    batch: TreeBatch, cycle_times_s: Array, *, speed_limits: int, refinements: int = 1
) -> list[list[SpeedPlan]]:
    """Plans of `solve_optimum` alone, R for each tree."""
    return solve_optimum(batch, cycle_times_s, speed_limits=speed_limits, refinements=refinements)[0]


def solve_optimum(
    batch: TreeBatch, cycle_times_s: Array, *, speed_limits: int, refinements: int = 1
) -> tuple[list[list[SpeedPlan]], list[list[VertexCosts]]]:
    """Plans with the least true energy, each with a proven lower bound.

    Args:
        batch: Trees.
        cycle_times_s: Cycle times of each tree, shape (T, R). [s]
        speed_limits: Speed limits of the dense profiles before refinement.
        refinements: Refinements round the plans before the bound is computed. If a gap is then larger than
            `TARGET_GAP`, up to `MORE_REFINEMENTS` follow; a larger gap may remain.

    Returns:
        R plans for each tree, and the costs of each tree's vertices with which they were found. `bound_j` bounds the
        true energy of every plan of that cycle time from below; both hold the energy of process steps.

    Raises:
        CycleTimeTooShort: A cycle time in which the fastest cycle does not fit.
        PlanningError: The solver failed.
    """
    dense = DenseProfiles(batch, speed_limits)
    times = np.asarray(cycle_times_s, dtype=float)
    plans = _solve(dense, times, below=False)
    for _ in range(refinements):
        dense.refine(stacked_durations(plans))
        plans = _solve(dense, times, below=False)
    bounds = _solve(dense, times, below=True)
    for _ in range(MORE_REFINEMENTS):
        if _largest_gap(plans, bounds) <= TARGET_GAP:
            break
        dense.refine(np.concatenate([stacked_durations(plans), stacked_durations(bounds)], axis=1))
        plans, bounds = _solve(dense, times, below=False), _solve(dense, times, below=True)
    steps = [process_energy_j(tree) for tree in batch.trees]
    proven = [
        [
            replace(plan, energy_j=plan.energy_j + fixed, bound_j=bound.bound_j + fixed)
            for plan, bound in zip(row, lower, strict=True)
        ]
        for row, lower, fixed in zip(plans, bounds, steps, strict=True)
    ]
    return proven, [dense.costs(tree) for tree in range(len(batch.trees))]


def _largest_gap(plans: list[list[SpeedPlan]], bounds: list[list[SpeedPlan]]) -> float:
    pairs = ((p, b) for row, lower in zip(plans, bounds, strict=True) for p, b in zip(row, lower, strict=True))
    return max(1.0 - bound.bound_j / plan.energy_j for plan, bound in pairs)


def _solve(dense: DenseProfiles, cycle_times_s: Array, *, below: bool) -> list[list[SpeedPlan]]:
    plans = []
    for tree, graph in enumerate(dense.batch.graphs):
        solver = PlanSolver(graph, dense.costs(tree, below=below), relative_gap=_MILP_GAP)
        plans.append([solver.solve(float(time)) for time in cycle_times_s[tree]])
    return plans
