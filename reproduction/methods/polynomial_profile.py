"""The polynomial energy profile of the original plug-in (thesis Eq. 3.1) and its chords (thesis 3.2.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.profile.piecewise import PiecewiseLinearProfile

POWERS = np.array([-2.0, -1.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class PolynomialProfile:
    """E(d) = sum of a_i d^i for i = -2 .. 1 on [d_min, d_max].

    Attributes:
        coefficients: a_-2 [J s2], a_-1 [J s], a_0 [J], a_1 [W], shape (4,).
        d_min_s: Shortest duration. [s]
        d_max_s: Longest duration. [s]
    """

    coefficients: Array
    d_min_s: float
    d_max_s: float

    def __post_init__(self) -> None:
        array = np.array(self.coefficients, dtype=float)
        array.setflags(write=False)
        object.__setattr__(self, "coefficients", array)

    def value(self, durations_s: ArrayLike) -> Array:
        """Energy at durations > 0, any shape. [J]"""
        durations = np.asarray(durations_s, dtype=float)
        return np.asarray((durations[..., np.newaxis] ** POWERS) @ self.coefficients)

    def chords(self, segments: int) -> PiecewiseLinearProfile:
        """Linear interpolation between `segments` + 1 equidistant durations from d_min to d_max.

        Raises:
            ValueError: Less than one segment.
        """
        if segments < 1:
            raise ValueError("a profile needs at least one segment")
        durations = np.linspace(self.d_min_s, self.d_max_s, segments + 1)
        return PiecewiseLinearProfile(durations, self.value(durations))


def fit_polynomial(durations_s: ArrayLike, energies_j: ArrayLike) -> PolynomialProfile:
    """Fit Eq. 3.1 to runs; by least squares where there are more runs than the four coefficients.

    Args:
        durations_s: Distinct durations > 0, shape (B,) with B >= 4. [s]
        energies_j: Energies, shape (B,). [J]

    Raises:
        ValueError: Fewer than four distinct durations, or a duration that is not positive.
    """
    durations, energies = np.asarray(durations_s, dtype=float), np.asarray(energies_j, dtype=float)
    if durations.ndim != 1 or durations.shape != energies.shape or np.unique(durations).size < POWERS.size:
        raise ValueError("the polynomial profile needs runs of at least four distinct durations")
    if not (durations > 0).all():
        raise ValueError("the polynomial profile needs positive durations")
    shortest = float(durations.min())
    # Durations relative to the shortest one keep the columns of the same magnitude.
    scaled, *_ = np.linalg.lstsq((durations / shortest)[:, np.newaxis] ** POWERS, energies, rcond=None)
    return PolynomialProfile(scaled / shortest**POWERS, shortest, float(durations.max()))
