"""Adaptive profiles: few runs of each motion, between a profile above and one below the true curve E(d).

Runs are points of E(d). Where neighbouring chords bend upwards (E is convex there), E lies below its chord and above
both neighbours extended: their crossing shows where and by how much E may lie below the chord. The next run goes there
(a sandwich algorithm; error falls with the square of the number of runs). Where chords bend downwards the same holds
with above and below exchanged: the runs themselves are kept, so a stretch that is not convex stays as it is and the
planning model gives it a binary. In a segment that bends upwards at one end only, the neighbour there is extended over
most of it. Above and below hold as long as the curvature of E does not change its sign unseen between two runs.

They enclose the curve up to the error of the simulated energies: where two zeros of the bus power lie between the same
two quadrature nodes, the simulation misses both, the energy comes out too low and neighbouring runs differ by a step.
Among 20 000 runs of 100 random motions of a KR16 with 10 kg it was too low by up to 4e-4 of its value, by more than
1e-6 in 2 % of the runs. At a stated error of 1e-3 the curve rose above the upper profile by up to 3e-4 of its value, by
more than 1e-6 for 16 motions, and fell below the lower profile for none. With four times as many nodes it lay between.

Near d_min the energy may fall with a vertical tangent (duration has its least value there as a function of the speed
limit); equal steps of the speed limit resolve it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.arrays import Array
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.sampled import SampledProfile, sampled_profile

LEAST_SPACING_S = 1e-6  # runs nearer to each other than this would have steep chords of pure noise
MAX_ROUNDS = 40
# Shares of the way from the fastest to the slowest speed limit of the first runs: denser where the curve bends.
_FIRST_SHARES = np.array([0.0, 0.12, 0.3, 0.48, 0.66, 0.84, 1.0])
_MOST_RUNS_A_ROUND = 4  # of one motion
_EDGE = 0.1  # a new run keeps this share of the segment away from its ends
_ONE_SIDED = 0.8  # share of a segment that bends upwards at one end only, over which the neighbour is extended


@dataclass(frozen=True, eq=False)
class Sandwich:
    """A profile nowhere below the curve and one nowhere above it, and their difference in each segment between runs.

    Attributes:
        above: Energies at which a plan can be executed.
        below: Energies that no plan can undercut.
        difference_j: Largest difference of both within each segment, shape (B - 1,). [J]
        widest_s: Duration at which it occurs, shape (B - 1,). [s]
    """

    above: PiecewiseLinearProfile
    below: PiecewiseLinearProfile
    difference_j: Array
    widest_s: Array


def sandwich(samples: PiecewiseLinearProfile) -> Sandwich:
    """Enclose a function that is known at the breakpoints only (see the module's text)."""
    d, e = samples.durations_s, samples.energies_j
    if samples.segments < 2:  # nothing is known about the bend
        middle = (d[:-1] + d[1:]) / 2.0
        return Sandwich(samples, samples, np.full(samples.segments, np.inf), middle)
    at_low, low = _supports(d, e)
    at_high, high = _supports(d, -e)
    above, below = _lowered(d, -e, at_high, high, -1.0), _lowered(d, e, at_low, low, 1.0)
    corners = np.unique(np.concatenate([d, above.durations_s, below.durations_s]))
    apart = above.value(corners) - below.value(corners)
    first = np.searchsorted(corners, d)
    difference = np.maximum(np.maximum.reduceat(apart, first[:-1]), apart[first[1:]])
    return Sandwich(above, below, difference, np.where(low >= high, at_low, at_high))


def _supports(d: Array, e: Array) -> tuple[Array, Array]:
    """Where in each segment the curve may lie furthest below its chord [s], and how far (0: nowhere) [J]."""
    slopes, width = np.diff(e) / np.diff(d), np.diff(d)
    rise = np.maximum(np.diff(slopes), 0.0)
    left, right = np.append(0.0, rise), np.append(rise, 0.0)  # bend at the left and at the right end of a segment
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where((left > 0.0) & (right > 0.0), right / (left + right), np.where(left > 0.0, _ONE_SIDED, 0.2))
    # The first and the last segment have one neighbour: its line counts up to the end.
    share[0], share[-1] = 0.0, 1.0
    depth = np.where(left > 0.0, left * share, right * (1.0 - share)) * width
    return d[:-1] + share * width, depth


def _lowered(d: Array, e: Array, at: Array, depth: Array, sign: float) -> PiecewiseLinearProfile:
    """Profile through the lowered points; samples remain where a segment beside them has none."""
    slopes = np.diff(e) / np.diff(d)
    value = e[:-1] + slopes * (at - d[:-1]) - depth
    low = depth > 0.0
    beside = np.concatenate([[low[0]], low[:-1] & low[1:], [low[-1]]])
    durations, energies = np.concatenate([d[~beside], at[low]]), np.concatenate([e[~beside], value[low]])
    order = np.argsort(durations, kind="stable")
    durations, energies = durations[order], energies[order]
    distinct = np.append(True, np.diff(durations) > 0.0)
    return PiecewiseLinearProfile(durations[distinct], sign * energies[distinct])


class AdaptiveProfiles:
    """Profiles of M motions from runs that are added in rounds, all motions together.

    Args:
        paths: The motions.
        slowest_speed_limit: Speed limit of the slowest run, a fraction in (0, 1].

    Attributes:
        profiles: Runs of each motion so far.
        runs: Number of simulated runs of each motion so far, shape (M,).
    """

    def __init__(self, paths: MotionPaths, slowest_speed_limit: float) -> None:
        self.paths = paths
        self.slowest_speed_limit = slowest_speed_limit
        top = np.maximum(paths.fastest_speed_limits(), slowest_speed_limit)[:, np.newaxis]
        limits = np.clip(top + _FIRST_SHARES * (slowest_speed_limit - top), slowest_speed_limit, 1.0)
        limits[:, -1] = slowest_speed_limit
        limits[~paths.moving] = 1.0
        runs = paths.simulate(limits)
        self.profiles: list[SampledProfile] = [
            sampled_profile(d, e, p, LEAST_SPACING_S)
            for d, e, p in zip(runs.duration_s, runs.energy_j, limits, strict=True)
        ]
        self.runs: NDArray[np.intp] = np.array([np.unique(row).size for row in limits])

    def sandwich(self, motion: int) -> Sandwich:
        """Profiles above and below the true one of a motion."""
        return sandwich(self.profiles[motion].piecewise())

    def refine(
        self, relative_error: float, *, absolute_error_j: float = 0.0, highest_slope_w: ArrayLike = np.inf
    ) -> None:
        """Add runs until the profiles above and below differ nowhere by more than the stated error.

        Args:
            relative_error: Allowed difference as a share of the least energy of the motion. [-]
            absolute_error_j: Allowed difference if that is larger. [J]
            highest_slope_w: Slope from which on a profile is of no interest, one number or shape (M,): a robot that may
                stand still for this power never moves slower. Segments beyond are not refined. [W]

        Raises:
            ValueError: Neither error is positive.
        """
        if not (relative_error > 0.0 or absolute_error_j > 0.0):
            raise ValueError("the error of a profile must be positive")
        highest = np.broadcast_to(np.asarray(highest_slope_w, dtype=float), len(self.profiles))
        open_motions = list(range(len(self.profiles)))
        for _ in range(MAX_ROUNDS):
            wanted: dict[int, Array] = {}
            for motion in open_motions:
                profile = self.profiles[motion]
                if len(profile) < 2:
                    continue
                pair = self.sandwich(motion)
                allowed = max(relative_error * float(profile.energies_j.min()), absolute_error_j)
                slopes = profile.piecewise().slopes_w
                # One segment more: the profile below joins the low points of neighbouring segments.
                useful = np.append([True, True], slopes[:-2] <= highest[motion])[: slopes.size]
                worst = np.flatnonzero((pair.difference_j > allowed) & useful)
                worst = worst[np.argsort(-pair.difference_j[worst], kind="stable")][:_MOST_RUNS_A_ROUND]
                if worst.size:
                    wanted[motion] = pair.widest_s[worst]
            open_motions = self.add(wanted)
            if not open_motions:
                return

    def add(self, durations_s: Mapping[int, Array]) -> list[int]:
        """Simulate one round of further runs near given durations.

        Args:
            durations_s: Durations by motion. A run keeps clear of the runs that are known; in the first segment it
                halves the speed limits instead. [s]

        Returns:
            Motions that got runs; none where the runs would be nearer to known ones than is meaningful.
        """
        limits = {motion: self._limits_near(motion, wanted) for motion, wanted in durations_s.items()}
        motions = [motion for motion, found in limits.items() if found.size]
        if not motions:
            return []
        width = max(limits[motion].size for motion in motions)
        table = np.array([np.resize(limits[motion], width) for motion in motions])
        runs = self.paths.subset(np.array(motions)).simulate(table)
        for motion, d, e, p in zip(motions, runs.duration_s, runs.energy_j, table, strict=True):
            known = self.profiles[motion]
            self.profiles[motion] = sampled_profile(
                np.append(known.durations_s, d),
                np.append(known.energies_j, e),
                np.append(known.speed_limits, p),
                LEAST_SPACING_S,
            )
            self.runs[motion] += limits[motion].size
        return motions

    def _limits_near(self, motion: int, durations_s: Array) -> Array:
        """Speed limits of new runs, one a segment that is asked for."""
        known = self.profiles[motion]
        d, p = known.durations_s, known.speed_limits
        segments = np.clip(np.searchsorted(d, durations_s, side="right") - 1, 0, max(d.size - 2, 0))
        segments, first = np.unique(segments, return_index=True)
        wide = np.diff(d)[segments] > 4.0 * LEAST_SPACING_S if d.size > 1 else np.zeros(segments.size, dtype=bool)
        segments, wanted = segments[wide], np.asarray(durations_s)[first][wide]
        share = np.clip((wanted - d[segments]) / (d[segments + 1] - d[segments]), _EDGE, 1.0 - _EDGE)
        # Between two runs the speed limit is nearly linear in the inverse of the duration; no exact one is needed.
        inverse = 1.0 / (d[segments] + share * (d[segments + 1] - d[segments]))
        low, high = 1.0 / d[segments + 1], 1.0 / d[segments]
        limit = p[segments + 1] + (p[segments] - p[segments + 1]) * (inverse - low) / (high - low)
        middle = (p[segments] + p[segments + 1]) / 2.0
        return np.asarray(np.where(segments == 0, middle, limit))
