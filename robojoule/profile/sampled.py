"""Profiles from single runs: speed limits that reach the same run are one point.

A higher speed limit need not give a shorter run: limited torque may leave less acceleration at a higher peak speed.
Such runs are left out, so that energy is a function of the duration.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, frozen
from robojoule.profile.parameters import optimal_run, profile_parameters, steepness
from robojoule.profile.piecewise import PiecewiseLinearProfile

SAME_DURATION_S = 1e-9  # runs closer than this are the same run


@dataclass(frozen=True, eq=False)
class SampledProfile:
    """Distinct runs of one motion, ordered by rising duration.

    Attributes:
        durations_s: Shape (B,), rising strictly. [s]
        energies_j: Shape (B,). [J]
        speed_limits: Lowest speed limit that gives the run, shape (B,), fractions in (0, 1].
    """

    durations_s: Array
    energies_j: Array
    speed_limits: Array

    def __post_init__(self) -> None:
        for field in ("durations_s", "energies_j", "speed_limits"):
            object.__setattr__(self, field, frozen(getattr(self, field)))

    def __len__(self) -> int:
        return int(self.durations_s.size)

    @cached_property
    def optimum(self) -> int:
        """Index of the run with the least energy (the fastest of several)."""
        return int(optimal_run(self.durations_s[np.newaxis], self.energies_j[np.newaxis])[0])

    @cached_property
    def _parameters(self) -> Array:
        return profile_parameters(self.durations_s[np.newaxis], self.energies_j[np.newaxis])

    @property
    def saving_j(self) -> float:
        """Energy of the fastest run less that of the best one. [J]"""
        return float(self._parameters[0, 0])

    @property
    def penalty_j(self) -> float:
        """Energy of the slowest run less that of the best one. [J]"""
        return float(self._parameters[0, 2])

    @property
    def steepness_j_per_s(self) -> float:
        """Saving per added second up to the best run (thesis Eq. 4.1); zero if the fastest run is the best. [J/s]"""
        return float(steepness(self._parameters, self.durations_s[:1])[0])

    def joined(
        self, durations_s: ArrayLike, energies_j: ArrayLike, speed_limits: ArrayLike, spacing_s: float
    ) -> SampledProfile:
        """The profile with further runs; see `sampled_profile`."""
        return sampled_profile(
            np.append(self.durations_s, durations_s),
            np.append(self.energies_j, energies_j),
            np.append(self.speed_limits, speed_limits),
            spacing_s,
        )

    def piecewise(self) -> PiecewiseLinearProfile:
        """Chords through the runs."""
        return PiecewiseLinearProfile(self.durations_s, self.energies_j)


def sampled_profile(
    durations_s: ArrayLike, energies_j: ArrayLike, speed_limits: ArrayLike, spacing_s: float = SAME_DURATION_S
) -> SampledProfile:
    """Keep the runs that are shorter than those of every lower speed limit, ordered by rising duration.

    Args:
        durations_s: Shape (S,). [s]
        energies_j: Shape (S,). [J]
        speed_limits: Shape (S,), fractions in (0, 1].
        spacing_s: Runs closer than this are the same run; of those nearest to d_min, the fastest is kept. [s]

    Raises:
        ValueError: Shapes differ, or a value is not finite.
    """
    d, e, p = (np.asarray(x, dtype=float) for x in (durations_s, energies_j, speed_limits))
    if not (d.ndim == 1 and d.shape == e.shape == p.shape and d.size):
        raise ValueError("durations, energies and speed limits must be lists of the same length")
    if not (np.isfinite(d).all() and np.isfinite(e).all() and np.isfinite(p).all()):
        raise ValueError("durations, energies and speed limits must be finite")
    order = np.lexsort((d, p))
    d, e, p = d[order], e[order], p[order]
    shortest_before = np.concatenate([[np.inf], np.minimum.accumulate(d)[:-1]])
    keep = np.flatnonzero(d < shortest_before - spacing_s)[::-1]
    keep[0] = np.argmin(d)  # the fastest run itself, not one that is nearly as fast
    return SampledProfile(d[keep], e[keep], p[keep])


def sampled_profiles(
    durations_s: Array, energies_j: Array, speed_limits: Array, spacing_s: float = SAME_DURATION_S
) -> list[SampledProfile]:
    """Profiles of M motions; all arrays have shape (M, S), see `sampled_profile`."""
    rows = zip(durations_s, energies_j, speed_limits, strict=True)
    return [sampled_profile(d, e, p, spacing_s) for d, e, p in rows]
