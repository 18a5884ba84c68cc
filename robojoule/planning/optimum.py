"""The true optimum of a cycle: the planning problem on densely simulated profiles with true idle power.

The dense runs of a motion are points of its true profile E(d). Chords through them give plans whose energy is met or
undercut by the simulation; the profile is sampled ever finer round the plans until the proven lower bound is as near.
The bound comes from the same model on profiles that lie below the true ones: where neighbouring chords bend upwards
(E is convex there), E lies above both of them extended, so their crossing replaces each chord; where they bend
downwards, E lies above the chord itself; where they bend upwards at one end only, the neighbour there is extended to
the middle. This holds as long as the curvature of E does not change its sign unseen between two samples.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch
from robojoule.planning.chain import chain_plans
from robojoule.planning.costs import VertexCosts
from robojoule.planning.graph import process_energy_j
from robojoule.planning.schedule import Schedule
from robojoule.planning.writeback import stacked_durations
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.sampled import SAME_DURATION_S, sampled_profile

TARGET_GAP = 8e-5  # relative gap between plan and bound at which the refinement ends
MAX_REFINEMENTS = 6
LEAST_SPACING_S = 1e-6  # samples nearer to each other than this would have steep chords of pure noise
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
        limits = batch.speed_limits(speed_limits)
        runs = batch.paths.simulate(limits)
        self.profiles = [
            sampled_profile(d, e, p, LEAST_SPACING_S)
            for d, e, p in zip(runs.duration_s, runs.energy_j, limits, strict=True)
        ]

    def refine(self, durations_s: Array, motions: NDArray[np.intp]) -> None:
        """Sample motions more densely between the neighbours of given durations.

        Args:
            durations_s: K durations of each of these motions, shape (M', K). [s]
            motions: Which motions, shape (M',).
        """
        shares = np.linspace(0.0, 1.0, 2 * _NEW_POINTS + 1)[1:-1]
        limits = np.ones((*durations_s.shape, shares.size))
        for row, motion in enumerate(motions):
            profile = self.profiles[motion]
            if len(profile) < 2:
                continue
            at = np.clip(np.searchsorted(profile.durations_s, durations_s[row] - SAME_DURATION_S), 0, len(profile) - 1)
            slower = profile.speed_limits[np.minimum(at + 1, len(profile) - 1)]
            faster = profile.speed_limits[np.maximum(at - 1, 0)]
            limits[row] = slower[:, np.newaxis] + shares * (faster - slower)[:, np.newaxis]
        flat = limits.reshape(len(motions), -1)
        runs = self.batch.paths.subset(motions).simulate(flat)
        for motion, d, e, p in zip(motions, runs.duration_s, runs.energy_j, flat, strict=True):
            self.profiles[motion] = self.profiles[motion].joined(d, e, p, LEAST_SPACING_S)

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
    samples = profile.energies_j
    both = from_left & from_right
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(both, (right - own) / (right - left), 0.5)
    at = d[1:-2] + share * width
    crossing = samples[1:-2] + left * share * width
    bend = np.where(from_left, own - left, right - own)
    value = np.where(both, crossing, (samples[1:-2] + samples[2:-1]) / 2.0 - bend * width / 2.0)
    crossed = from_left | from_right
    # A sample between two crossings (or lowered ends) lies above the line that joins them.
    beside = np.concatenate([[lowered[0]], crossed, [lowered[1]]])
    keep = np.concatenate([[True], ~(beside[:-1] & beside[1:]), [True]])
    durations, energies = np.concatenate([d[keep], at[crossed]]), np.concatenate([e[keep], value[crossed]])
    order = np.argsort(durations, kind="stable")
    durations, energies = durations[order], energies[order]
    distinct = np.concatenate([[True], np.diff(durations) > 0.0])
    return PiecewiseLinearProfile(durations[distinct], energies[distinct])


def optimal_plans(batch: TreeBatch, cycle_times_s: Array, *, speed_limits: int) -> list[list[Schedule]]:
    """Plans of `solve_optimum` alone, R for each tree."""
    return solve_optimum(batch, cycle_times_s, speed_limits=speed_limits)[0]


def solve_optimum(
    batch: TreeBatch, cycle_times_s: Array, *, speed_limits: int, prove: bool = True
) -> tuple[list[list[Schedule]], list[list[VertexCosts]]]:
    """Plans with the least true energy, each with a proven lower bound.

    Args:
        batch: Trees.
        cycle_times_s: Cycle times of each tree, shape (T, R). [s]
        speed_limits: Speed limits of the dense profiles before refinement.
        prove: Compute bounds, and refine the profiles of those trees whose gap is larger than `TARGET_GAP`, at most
            `MAX_REFINEMENTS` times (a larger gap may remain). Without, `bound_j` is NaN.

    Returns:
        R plans for each tree, and the costs of each tree's vertices with which they were found. `bound_j` bounds the
        true energy of every plan of that cycle time from below; both hold the energy of process steps.

    Raises:
        CycleTimeTooShort: A cycle time in which the fastest cycle does not fit.
        PlanningError: The solver failed.
    """
    dense = DenseProfiles(batch, speed_limits)
    times = np.asarray(cycle_times_s, dtype=float)
    everything = range(len(batch.trees))
    plans = {tree: _solve(dense, times, tree) for tree in everything}
    loose = list(everything) if prove else []
    bounds = {tree: [replace(plan, bound_j=float("nan")) for plan in plans[tree]] for tree in everything}
    for refinement in range(MAX_REFINEMENTS + 1):
        for tree in loose:
            if refinement:
                plans[tree] = _solve(dense, times, tree)
            bounds[tree] = _bounds(dense, times, tree, plans[tree])
        loose = [tree for tree in loose if _largest_gap(plans[tree], bounds[tree]) > TARGET_GAP]
        if not loose or refinement == MAX_REFINEMENTS:
            break
        _refine(dense, {tree: plans[tree] + bounds[tree] for tree in loose})
    steps = [process_energy_j(tree) for tree in batch.trees]
    proven = [
        [
            replace(plan, energy_j=plan.energy_j + steps[tree], bound_j=bound.bound_j + steps[tree])
            for plan, bound in zip(plans[tree], bounds[tree], strict=True)
        ]
        for tree in everything
    ]
    return proven, [dense.costs(tree) for tree in everything]


def _refine(dense: DenseProfiles, plans: dict[int, list[Schedule]]) -> None:
    """Sample the motions of some trees more densely round plans, equally many for each tree."""
    motions = np.concatenate([np.arange(rows.start, rows.stop) for rows in (dense.batch.rows[tree] for tree in plans)])
    dense.refine(stacked_durations(list(plans.values())), motions)


def _largest_gap(plans: list[Schedule], bounds: list[Schedule]) -> float:
    return max(1.0 - bound.bound_j / plan.energy_j for plan, bound in zip(plans, bounds, strict=True))


def _bounds(dense: DenseProfiles, cycle_times_s: Array, tree: int, plans: list[Schedule]) -> list[Schedule]:
    """Plans on the profiles below; at the least cycle time there is one plan only, which is its own bound."""
    only = cycle_times_s[tree] <= dense.batch.least_cycles_s[tree] * (1.0 + 1e-12)
    below = _solve(dense, cycle_times_s, tree, below=True)
    return [
        replace(plan, bound_j=plan.energy_j) if alone else bound
        for plan, bound, alone in zip(plans, below, only, strict=True)
    ]


def _solve(dense: DenseProfiles, cycle_times_s: Array, tree: int, *, below: bool = False) -> list[Schedule]:
    costs = dense.costs(tree, below=below)
    return chain_plans(dense.batch.graphs[tree], costs, cycle_times_s[tree], relative_gap=_MILP_GAP)
