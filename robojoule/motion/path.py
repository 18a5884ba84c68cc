"""Paths through joint space: what the physics of motions asks of them.

A motion follows a path q(s), s from 0 to 1, by a time law s(t). With the slope q' = dq/ds its joint velocities are
q' s', and its rigid-body torques

    tau(s) = m(s) s'' + c(s) s'^2 + g(s) ,   m = M q' ,   c = M q'' + C(q, q') q' ,   g = gravity .

Straight lines have a constant slope, so that q'' = 0. Curves add q'' to c, for the rotors too. A path is smooth, as one
Chebyshev series stands for it, and no joint turns back on it, as friction changes its sign there: what is not so comes
in pieces (`robojoule.motion.corners`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index


class Path(Protocol):
    """M paths of one kind for n joints."""

    @property
    def start_rad(self) -> Array:
        """Configurations at s = 0, shape (M, n). [rad]"""

    @property
    def delta_rad(self) -> Array:
        """Joint changes from s = 0 to s = 1, shape (M, n). [rad]"""

    @property
    def travel_rad(self) -> Array:
        """How far each joint turns along the path, to and fro, shape (M, n). [rad]"""

    @property
    def steepest_rad(self) -> Array:
        """Largest |dq/ds| of each joint, shape (M, n). [rad]"""

    def positions_rad(self, rows: Index | slice, s: Array) -> Array:
        """Joint positions of M' of the paths at path positions (K,) [-], shape (n, M', K). [rad]"""

    def slopes_rad(self, rows: Index | slice, s: Array) -> Array:
        """Slopes dq/ds of M' of the paths at path positions (K,) or (M', K) [-].

        Returns:
            Shape (M', n, K), or (M', n, 1) where they are the same all along. [rad]
        """

    def slope_series_rad(self, rows: Index | slice) -> Array:
        """Chebyshev coefficients (over 2 s - 1) of the slopes of M' of the paths, shape (M', n, L). [rad]"""

    @property
    def degree(self) -> int:
        """Degree of the paths as polynomials in s; their curvature is zero if it is 1."""

    def curvatures_rad(self, rows: Index | slice, s: Array) -> Array:
        """Second derivatives d2q/ds2 of M' of the paths at path positions (K,) [-], shape (M', n, K). [rad]"""

    def curvature_series_rad(self, rows: Index | slice) -> Array:
        """Chebyshev coefficients (over 2 s - 1) of the curvatures of M' of the paths, shape (M', n, L). [rad]"""

    def of(self, rows: Index | slice) -> Path:
        """Some of the paths."""


@dataclass(frozen=True, eq=False)
class StraightPath:
    """Straight lines q(s) = q0 + s dq, as point-to-point motions with fine zones follow them; see `Path`.

    Attributes:
        start_rad: Start configurations q0, shape (M, n). [rad]
        delta_rad: Joint changes dq, shape (M, n). [rad]
    """

    start_rad: Array
    delta_rad: Array

    @classmethod
    def between(cls, start_rad: ArrayLike, end_rad: ArrayLike) -> StraightPath:
        """Lines between configurations, each of shape (M, n) or (n,). [rad]"""
        start = np.atleast_2d(np.asarray(start_rad, dtype=float))
        return cls(start, np.atleast_2d(np.asarray(end_rad, dtype=float)) - start)

    @property
    def travel_rad(self) -> Array:
        """See `Path`: a joint only turns one way. [rad]"""
        return np.abs(self.delta_rad)

    @property
    def steepest_rad(self) -> Array:
        """See `Path`. [rad]"""
        return np.abs(self.delta_rad)

    @property
    def degree(self) -> int:
        """See `Path`."""
        return 1

    def of(self, rows: Index | slice) -> StraightPath:
        """See `Path`."""
        return StraightPath(self.start_rad[rows], self.delta_rad[rows])

    def positions_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`. [rad]"""
        return np.asarray(self.start_rad[rows].T[..., None] + self.delta_rad[rows].T[..., None] * s)

    def slopes_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`: the same all along. [rad]"""
        return self.delta_rad[rows][:, :, None]

    def slope_series_rad(self, rows: Index | slice) -> Array:
        """See `Path`: one coefficient. [rad]"""
        return self.delta_rad[rows][:, :, None]

    def curvatures_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`: none. [rad]"""
        return np.zeros((*self.delta_rad[rows].shape, 1))

    def curvature_series_rad(self, rows: Index | slice) -> Array:
        """See `Path`: none. [rad]"""
        return np.zeros((*self.delta_rad[rows].shape, 1))


@dataclass(frozen=True, eq=False)
class CurvedPath:
    """Polynomials q(s) = sum_k c_k s^k along which no joint turns back; see `Path`.

    Slopes must have their extremes at the ends, as those of corners have.

    Attributes:
        coefficients_rad: c_k, shape (M, n, K). [rad]
    """

    coefficients_rad: Array

    @property
    def start_rad(self) -> Array:
        """See `Path`. [rad]"""
        return self.coefficients_rad[:, :, 0]

    @property
    def delta_rad(self) -> Array:
        """See `Path`. [rad]"""
        return np.asarray(self.coefficients_rad[:, :, 1:].sum(axis=2))

    @property
    def travel_rad(self) -> Array:
        """See `Path`: a joint only turns one way. [rad]"""
        return np.abs(self.delta_rad)

    @property
    def steepest_rad(self) -> Array:
        """See `Path`. [rad]"""
        ends = np.abs(_values(_derivative(self.coefficients_rad), np.array([0.0, 1.0])))
        return np.asarray(ends.max(axis=2))

    @property
    def degree(self) -> int:
        """See `Path`."""
        return int(self.coefficients_rad.shape[2]) - 1

    def of(self, rows: Index | slice) -> CurvedPath:
        """See `Path`."""
        return CurvedPath(self.coefficients_rad[rows])

    def positions_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`. [rad]"""
        return _values(self.coefficients_rad[rows], s).swapaxes(0, 1)

    def slopes_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`. [rad]"""
        return _values(_derivative(self.coefficients_rad[rows]), s)

    def slope_series_rad(self, rows: Index | slice) -> Array:
        """See `Path`. [rad]"""
        return _series(_derivative(self.coefficients_rad[rows]))

    def curvatures_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`. [rad]"""
        return _values(_derivative(_derivative(self.coefficients_rad[rows])), s)

    def curvature_series_rad(self, rows: Index | slice) -> Array:
        """See `Path`. [rad]"""
        return _series(_derivative(_derivative(self.coefficients_rad[rows])))


def _derivative(coefficients: Array) -> Array:
    """Coefficients of the derivatives of polynomials, (M, n, K) -> (M, n, K - 1)."""
    return np.asarray(coefficients[:, :, 1:] * np.arange(1.0, coefficients.shape[2]))


def _values(coefficients: Array, s: Array) -> Array:
    """Values of polynomials (M, n, K) at (P,) or (M, P), shape (M, n, P)."""
    at = s[None, None] if s.ndim == 1 else s[:, None]
    total = np.zeros(np.broadcast_shapes((*coefficients.shape[:2], 1), at.shape))
    for k in range(coefficients.shape[2] - 1, -1, -1):
        total = total * at + coefficients[:, :, k, None]
    return total


def _series(coefficients: Array) -> Array:
    """Chebyshev coefficients over x = 2 s - 1 of polynomials in s, same shape."""
    size = coefficients.shape[2]
    table, power = np.zeros((size, size)), np.array([1.0])
    for k in range(size):
        table[k, : k + 1] = power
        power = chebyshev.chebmul(power, [0.5, 0.5])
    return np.asarray(coefficients @ table)
