"""Paths given as Chebyshev series, such as joints take that lead a tool along a course."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from robojoule.arrays import Array, Index

_SAMPLES = 33  # at which the steepest slope is looked for


@dataclass(frozen=True, eq=False)
class SeriesPath:
    """Chebyshev series q(s) over x = 2 s - 1 along which no joint turns back; see `robojoule.motion.path.Path`.

    Attributes:
        coefficients_rad: Coefficients, shape (M, n, K). [rad]
    """

    coefficients_rad: Array

    @property
    def start_rad(self) -> Array:
        """See `Path`. [rad]"""
        return _values(self.coefficients_rad, np.zeros(1))[:, :, 0]

    @property
    def delta_rad(self) -> Array:
        """See `Path`. [rad]"""
        odd = self.coefficients_rad[:, :, 1::2]
        return np.asarray(2.0 * odd.sum(axis=2))

    @property
    def travel_rad(self) -> Array:
        """See `Path`: a joint only turns one way. [rad]"""
        return np.abs(self.delta_rad)

    @property
    def steepest_rad(self) -> Array:
        """See `Path`. [rad]"""
        slopes = _values(_derivative(self.coefficients_rad), np.linspace(0.0, 1.0, _SAMPLES))
        return np.asarray(np.abs(slopes).max(axis=2))

    @property
    def degree(self) -> int:
        """See `Path`."""
        return int(self.coefficients_rad.shape[2]) - 1

    def of(self, rows: Index | slice) -> SeriesPath:
        """See `Path`."""
        return SeriesPath(self.coefficients_rad[rows])

    def positions_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`. [rad]"""
        return _values(self.coefficients_rad[rows], s).swapaxes(0, 1)

    def slopes_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`. [rad]"""
        return _values(self.slope_series_rad(rows), s)

    def slope_series_rad(self, rows: Index | slice) -> Array:
        """See `Path`. [rad]"""
        return _derivative(self.coefficients_rad[rows])

    def curvatures_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`. [rad]"""
        return _values(self.curvature_series_rad(rows), s)

    def curvature_series_rad(self, rows: Index | slice) -> Array:
        """See `Path`. [rad]"""
        return _derivative(self.slope_series_rad(rows))


def _derivative(coefficients: Array) -> Array:
    """Coefficients of the derivatives after s."""
    return np.asarray(chebyshev.chebder(coefficients, scl=2.0, axis=2))


def _values(coefficients: Array, s: Array) -> Array:
    """Values of series (M, n, K) at (P,) or (M, P), shape (M, n, P)."""
    basis = chebyshev.chebvander(2.0 * s - 1.0, coefficients.shape[2] - 1)
    return np.asarray(coefficients @ (basis.T if s.ndim == 1 else basis.swapaxes(1, 2)))
