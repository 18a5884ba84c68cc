"""Paths through joint space: what the physics of motions asks of them.

A motion follows a path q(s), s from 0 to 1, by a time law s(t). With the slope q' = dq/ds its joint velocities are
q' s', and its rigid-body torques

    tau(s) = m(s) s'' + c(s) s'^2 + g(s) ,   m = M q' ,   c = M q'' + C(q, q') q' ,   g = gravity .

Straight lines, the one kind so far, have a constant slope, so that q'' = 0. A kind whose slope changes adds q'' to c,
for the rotors too, and says between which places it is smooth: one Chebyshev series stands for one smooth piece.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
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

    def positions_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`. [rad]"""
        return np.asarray(self.start_rad[rows].T[..., None] + self.delta_rad[rows].T[..., None] * s)

    def slopes_rad(self, rows: Index | slice, s: Array) -> Array:
        """See `Path`: the same all along. [rad]"""
        return self.delta_rad[rows][:, :, None]

    def slope_series_rad(self, rows: Index | slice) -> Array:
        """See `Path`: one coefficient. [rad]"""
        return self.delta_rad[rows][:, :, None]
