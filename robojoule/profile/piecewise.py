"""The piecewise linear energy profile: the form in which every profile reaches the planning model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, frozen

# Energies differ from a convex profile by up to this share of the largest energy without counting as not convex:
# numerical noise of simulated energies must not split a profile.
CONVEXITY_TOLERANCE = 1e-8


@dataclass(frozen=True, eq=False)
class PiecewiseLinearProfile:
    """Energy over duration, linear between breakpoints; immutable.

    A single breakpoint is a motion whose duration cannot be chosen (a motion of zero length: 0 s, 0 J).

    Attributes:
        durations_s: Durations of the breakpoints, rising strictly, shape (B,) with B >= 1. [s]
        energies_j: Energies at the breakpoints, shape (B,). [J]

    Raises:
        ValueError: Wrong shape, not finite, negative or not strictly rising durations.
    """

    durations_s: Array
    energies_j: Array

    def __post_init__(self) -> None:
        for field in ("durations_s", "energies_j"):
            object.__setattr__(self, field, frozen(getattr(self, field)))
        if self.durations_s.ndim != 1 or self.durations_s.size < 1 or self.durations_s.shape != self.energies_j.shape:
            raise ValueError("a profile needs as many energies as durations, at least one")
        if not (np.isfinite(self.durations_s).all() and np.isfinite(self.energies_j).all()):
            raise ValueError("the breakpoints of a profile must be finite")
        if self.durations_s[0] < 0 or (np.diff(self.durations_s) <= 0).any():
            raise ValueError("the durations of a profile must not be negative and must rise strictly")

    @property
    def d_min_s(self) -> float:
        """Shortest duration. [s]"""
        return float(self.durations_s[0])

    @property
    def d_max_s(self) -> float:
        """Longest duration. [s]"""
        return float(self.durations_s[-1])

    @property
    def segments(self) -> int:
        """Number of linear segments."""
        return int(self.durations_s.size) - 1

    @cached_property
    def slopes_w(self) -> Array:
        """Slope of each segment, shape (B - 1,). [W]"""
        return np.asarray(np.diff(self.energies_j) / np.diff(self.durations_s))

    @cached_property
    def intercepts_j(self) -> Array:
        """Energy of each segment's line at duration zero, shape (B - 1,). [J]"""
        return np.asarray(self.energies_j[:-1] - self.slopes_w * self.durations_s[:-1])

    def value(self, durations_s: ArrayLike) -> Array:
        """Energy at given durations.

        Args:
            durations_s: Durations within [d_min, d_max], any shape. [s]

        Returns:
            Energies of the same shape. [J]

        Raises:
            ValueError: A duration lies outside the profile by more than 1e-9 s.
        """
        durations = np.asarray(durations_s, dtype=float)
        if ((durations < self.d_min_s - 1e-9) | (durations > self.d_max_s + 1e-9)).any():
            raise ValueError(f"the profile is defined from {self.d_min_s:.9g} s to {self.d_max_s:.9g} s only")
        return np.asarray(np.interp(durations, self.durations_s, self.energies_j))

    def marginal_power_w(self, durations_s: ArrayLike) -> Array:
        """Slope at given durations, any shape; at a breakpoint that of the segment behind it. [W]"""
        durations = np.asarray(durations_s, dtype=float)
        if self.segments == 0:
            return np.zeros_like(durations)
        place = np.searchsorted(self.durations_s, durations, side="right") - 1
        return np.asarray(self.slopes_w[np.clip(place, 0, self.segments - 1)])

    def duration_at(self, power_w: float) -> float:
        """Shortest duration from which on a convex profile rises by at least a power. [s]"""
        return float(self.durations_s[np.searchsorted(self.slopes_w, power_w)])

    @cached_property
    def is_convex(self) -> bool:
        """Whether the profile is its own lower hull (up to numerical noise)."""
        above = self.energies_j - np.interp(self.durations_s, self.lower_hull.durations_s, self.lower_hull.energies_j)
        return bool(above.max() <= self._tolerance_j)

    @property
    def _tolerance_j(self) -> float:
        return CONVEXITY_TOLERANCE * max(float(np.abs(self.energies_j).max()), 1.0)

    def convex_pieces(self) -> list[PiecewiseLinearProfile]:
        """Convex profiles that join end to end and together are this one (up to numerical noise).

        Split at the concave breakpoints, those that lie above their neighbours' chord. Slopes within a piece rise.
        """
        if self.is_convex:
            return [self.lower_hull]
        d, e = self.durations_s, self.energies_j
        chord = e[:-2] + (e[2:] - e[:-2]) * (d[1:-1] - d[:-2]) / (d[2:] - d[:-2])
        concave = np.flatnonzero(e[1:-1] - chord > self._tolerance_j / d.size) + 1
        return [
            PiecewiseLinearProfile(d[a : b + 1], e[a : b + 1]).lower_hull
            for a, b in pairwise([0, *concave.tolist(), d.size - 1])
        ]

    @cached_property
    def lower_hull(self) -> PiecewiseLinearProfile:
        """Largest convex profile that lies nowhere above this one (Andrew's monotone chain)."""
        d, e = self.durations_s, self.energies_j
        hull: list[int] = []
        for point in range(d.size):
            while len(hull) >= 2:
                a, b = hull[-2], hull[-1]
                if (e[b] - e[a]) * (d[point] - d[a]) < (e[point] - e[a]) * (d[b] - d[a]):
                    break
                hull.pop()
            hull.append(point)
        return PiecewiseLinearProfile(d[hull], e[hull])
