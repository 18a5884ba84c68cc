"""Adaptive profiles: few runs of each motion, between a profile above and one below the true curve E(d).

The next run goes where both may differ most (a sandwich algorithm; the error falls with the square of the number of
runs). See `robojoule.profile.enclosure` for what above and below mean and how far they hold.

Near d_min the energy may fall with a vertical tangent (duration has its least value there as a function of the speed
limit); equal steps of the speed limit resolve it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.arrays import Array
from robojoule.motion.motions import Motions
from robojoule.profile.enclosure import Enclosure, enclose
from robojoule.profile.sampled import sampled_profiles
from robojoule.progress import tell

LEAST_SPACING_S = 1e-6  # runs nearer to each other than this would have steep chords of pure noise
MAX_ROUNDS = 40
# Shares of the way from the fastest to the slowest speed limit of the first runs: denser where the curve bends.
_FIRST_SHARES = np.array([0.0, 0.12, 0.3, 0.48, 0.66, 0.84, 1.0])
_ROUND_KINKS = np.array([0.94, 1.0, 1.06])  # of their speed limits: the slopes on both sides
_MOST_RUNS_A_ROUND = 4  # of one motion
_EDGE = 0.1  # a new run keeps this share of the segment away from its ends


class AdaptiveProfiles:
    """Simulated profiles of M motions (a `ProfileSource`): runs are added in rounds, all motions together.

    Args:
        paths: The motions.
        slowest_speed_limit: Speed limit of the slowest run, one for all motions or shape (M,), fractions in (0, 1].
        first_runs: Number of runs at equidistant speed limits to begin with; a few where the curve bends if not given.
        highest_speed_limit: Speed limit of the fastest run, likewise.

    Attributes:
        profiles: Runs of each motion so far.
        runs: Number of simulated runs of each motion so far, shape (M,).
    """

    def __init__(
        self,
        paths: Motions,
        slowest_speed_limit: ArrayLike,
        first_runs: int | None = None,
        highest_speed_limit: ArrayLike = 1.0,
    ) -> None:
        self.paths = paths
        slowest, highest = (
            np.broadcast_to(np.asarray(limit, dtype=float), paths.motions)[:, np.newaxis]
            for limit in (slowest_speed_limit, highest_speed_limit)
        )
        shares = _FIRST_SHARES if first_runs is None else np.linspace(0.0, 1.0, first_runs)
        top = np.clip(paths.fastest_speed_limits()[:, np.newaxis], slowest, highest)
        limits = np.clip(top + shares * (slowest - top), slowest, 1.0)
        limits[:, -1] = slowest[:, 0]
        kinks = [np.outer(places, _ROUND_KINKS).ravel() for places in paths.kinks()]
        width = max((places.size for places in kinks), default=0)
        if width:
            at = np.array([np.append(places, np.ones(width - places.size)) for places in kinks])
            limits = np.concatenate([limits, np.clip(at, slowest, top)], axis=1)
        limits[~paths.moving] = 1.0
        runs = paths.simulate(limits)
        self.profiles = sampled_profiles(runs.duration_s, runs.energy_j, limits, LEAST_SPACING_S)
        self.runs: NDArray[np.intp] = np.array([np.unique(row).size for row in limits])

    @property
    def idle_start_w(self) -> Array:
        """True idle power at the start of each motion, shape (M,). [W]"""
        return self.paths.idle_power_start_w

    @property
    def idle_end_w(self) -> Array:
        """True idle power at the end of each motion, shape (M,). [W]"""
        return self.paths.idle_power_end_w

    def enclosure(self, motion: int) -> Enclosure:
        """Profiles above and below the true one of a motion."""
        return enclose(self.profiles[motion].piecewise())

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
            done = float(len(self.profiles) - len(open_motions))
            for motion in open_motions:
                profile = self.profiles[motion]
                if len(profile) < 2:
                    continue
                pair = self.enclosure(motion)
                allowed = max(relative_error * float(profile.energies_j.min()), absolute_error_j)
                slopes = profile.piecewise().slopes_w
                # One segment more: the profile below joins the low points of neighbouring segments.
                useful = np.append([True, True], slopes[:-2] <= highest[motion])[: slopes.size]
                worst = np.flatnonzero((pair.difference_j > allowed) & useful)
                worst = worst[np.argsort(-pair.difference_j[worst], kind="stable")][:_MOST_RUNS_A_ROUND]
                if worst.size:
                    wanted[motion] = pair.widest_s[worst]
                # The error falls with the square of the number of runs.
                done += math.sqrt(allowed / float(pair.difference_j[worst[0]])) if worst.size else 1.0
            tell("profiles of motions", done, len(self.profiles))
            open_motions = self.refine_near(wanted)
            if not open_motions:
                return

    def refine_near(self, durations_s: Mapping[int, Array]) -> list[int]:
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
            self.profiles[motion] = self.profiles[motion].joined(d, e, p, LEAST_SPACING_S)
            self.runs[motion] += limits[motion].size
        return motions

    def _limits_near(self, motion: int, durations_s: Array) -> Array:
        """Speed limits of new runs, one per segment that is asked for."""
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
