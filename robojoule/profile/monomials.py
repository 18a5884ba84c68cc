"""Convex energy profiles that are given as sums of powers of the duration, as published cells have them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.inputs import LARGEST, shown

_LEAST_S = 1e-5  # of a movement: powers below zero grow beyond all bounds towards a duration of zero
_STEEPEST = 20.0  # degree; published functions go from -4 to 2
_STEPS = 60  # of a bisection: double precision is reached


@dataclass(frozen=True)
class MonomialProfile:
    """E(d) = sum of c d^n over the terms (n, c), convex within [d_min, d_max]; immutable.

    Attributes:
        d_min_s: Shortest duration. [s]
        d_max_s: Longest duration. [s]
        terms: Degree n and coefficient c of each term; c in J/s^n.

    Raises:
        InputError: The window is not usable, the sum is not convex by its terms, or an energy is negative.
    """

    d_min_s: float
    d_max_s: float
    terms: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if not _LEAST_S <= self.d_min_s <= self.d_max_s < float("inf"):
            raise InputError(
                f"the window from {shown(self.d_min_s)} s to {shown(self.d_max_s)} s holds no duration of a movement",
                allowed=f"{_LEAST_S:g} s or more, the shortest first",
            )
        if not self.terms or not np.isfinite(self.terms).all():
            raise InputError("an energy function needs terms with finite degrees and coefficients")
        for degree, coefficient in self.terms:
            if abs(degree) > _STEEPEST:
                problem = f"the degree {shown(degree)} of a term is out of range"
                raise InputError(problem, allowed=f"-{_STEEPEST:g} to {_STEEPEST:g}")
            if 0.0 < degree < 1.0 and coefficient > 0.0:
                problem = f"the term of degree {degree:g} makes the energy function concave"
                raise InputError(problem, allowed="degrees of 0 or less, or of 1 or more")
            if coefficient < 0.0 and (degree < 0.0 or degree > 1.0):
                problem = f"the coefficient {coefficient:g} of degree {degree:g} makes the energy function concave"
                raise InputError(problem, allowed="0 or more, unless the degree is 0 or 1")
        ends = [self.d_min_s, self.d_max_s]
        with np.errstate(over="ignore", invalid="ignore"):
            largest = float(np.abs([self.value(ends), self.marginal_power_w(ends)]).max())
        if not largest <= LARGEST:
            problem = f"the energy function reaches {shown(largest)} J, or W of slope, at an end of its window"
            raise InputError(problem, allowed=f"up to {LARGEST:g}")
        least = float(self.value(self.duration_at(0.0)))
        if least < 0.0:
            raise InputError(f"the energy function falls to {shown(least)} J", allowed="0 J or more")

    def value(self, durations_s: ArrayLike) -> Array:
        """Energy at given durations, any shape. [J]"""
        d = np.asarray(durations_s, dtype=float)
        return np.asarray(sum(c * d**n for n, c in self.terms), dtype=float)

    def marginal_power_w(self, durations_s: ArrayLike) -> Array:
        """Slope of the energy at given durations, any shape. [W]"""
        d = np.asarray(durations_s, dtype=float)
        return np.asarray(sum(n * c * d ** (n - 1.0) for n, c in self.terms if n != 0.0) + 0.0 * d, dtype=float)

    def duration_at(self, power_w: float) -> float:
        """Duration at which the slope of the energy reaches a power, within the window. [s]"""
        low, high = self.d_min_s, self.d_max_s
        if self.marginal_power_w(low) >= power_w:
            return low
        if self.marginal_power_w(high) <= power_w:
            return high
        for _ in range(_STEPS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.marginal_power_w(middle) < power_w else (low, middle)
        return 0.5 * (low + high)
