"""Where a tool goes in space: along a straight line or a circle, while it turns evenly from one orientation to another.

Position and orientation share one coordinate s from 0 to 1: the way and the angle are passed in equal shares. The tool
turns about one axis that stands still in space (spherical linear interpolation), by the shorter way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.robots.rigid_body import Placement

ON_A_LINE_M2 = 1e-9  # twice the area between three points that count as on a line


@dataclass(frozen=True, eq=False)
class ToolCourse:
    """A line or a circle in space.

    Attributes:
        start: Where the tool starts.
        shift_m: From the start to the end of a line; zero on circles, shape (3,). [m]
        center_m: From the start to the centre of a circle; None: it is a line. [m]
        axis: Direction about which the circle turns, shape (3,). [-]
        angle_rad: What the circle spans. [rad]
        turn_rad: By what the tool turns in space, along the axis of the turn, shape (3,). [rad]
    """

    start: Placement
    shift_m: Array
    center_m: Array | None
    axis: Array
    angle_rad: float
    turn_rad: Array

    @classmethod
    def between(cls, start: Placement, end: Placement, via_m: Sequence[float] | Array | None = None) -> ToolCourse:
        """The line between two places, or the circle from one through a point to the other.

        Raises:
            InputError: The three points of a circle are on a line, and that through the point is not the way; or it
                ends where it starts.
        """
        turn = _rotation_vector(end.rotation @ start.rotation.T)
        shift = end.origin_m - start.origin_m
        if via_m is not None:
            first = np.asarray(via_m, dtype=float) - start.origin_m
            normal = np.cross(first, shift)
            area = float(np.linalg.norm(normal))
            if area >= ON_A_LINE_M2:
                return cls._circle(start, first, shift, normal / area, turn)
            if float(first @ first) > float(shift @ shift) + ON_A_LINE_M2 and float(shift @ shift) <= ON_A_LINE_M2:
                raise InputError("the circle ends where it starts")
            if not -ON_A_LINE_M2 <= float(first @ shift) <= float(shift @ shift) + ON_A_LINE_M2:
                raise InputError("the three points of the circle are on a line")
        return cls(start, shift, None, np.zeros(3), 0.0, turn)

    @classmethod
    def _circle(cls, start: Placement, first: Array, second: Array, axis: Array, turn: Array) -> ToolCourse:
        normal = np.cross(first, second)
        center = (second @ second) * np.cross(normal, first) + (first @ first) * np.cross(second, normal)
        center = center / (2.0 * (normal @ normal))
        out = second - center
        sine, cosine = float(np.cross(-center, out) @ axis), float(-center @ out)
        angle = float(np.arctan2(sine, cosine)) % (2.0 * np.pi)
        return cls(start, np.zeros(3), center, axis, angle, turn)

    @property
    def length_m(self) -> float:
        """Length of the way. [m]"""
        if self.center_m is None:
            return float(np.linalg.norm(self.shift_m))
        return float(np.linalg.norm(self.center_m)) * self.angle_rad

    @property
    def turned_rad(self) -> float:
        """Angle by which the tool turns. [rad]"""
        return float(np.linalg.norm(self.turn_rad))

    def at(self, s: Array) -> tuple[Array, Array]:
        """Rotations (N, 3, 3) and positions (N, 3) [m] of the tool at shares of the way, shape (N,)."""
        shares = np.asarray(s, dtype=float)
        rotations = rotations_by(shares[:, None] * self.turn_rad) @ self.start.rotation
        if self.center_m is None:
            return rotations, self.start.origin_m + shares[:, None] * self.shift_m
        about = rotations_by(shares[:, None] * (self.angle_rad * self.axis))
        return rotations, self.start.origin_m + self.center_m - np.einsum("Nij,j->Ni", about, self.center_m)


def rotations_by(vectors_rad: Array) -> Array:
    """Rotations about axes by angles, given as vectors (N, 3) [rad], shape (N, 3, 3). [-]"""
    angle = np.linalg.norm(vectors_rad, axis=1)
    x, y, z = (vectors_rad / np.where(angle > 0.0, angle, 1.0)[:, None]).T
    none = np.zeros_like(x)
    cross = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=1).reshape(-1, 3, 3)
    sine, versine = np.sin(angle)[:, None, None], (2.0 * np.sin(angle / 2.0) ** 2)[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + versine * (cross @ cross))


def _rotation_vector(rotation: Array) -> Array:
    """Axis times angle of a rotation, shape (3,); the angle is from 0 to pi. [rad]

    The unit quaternion of a rotation R is the eigenvector of the largest eigenvalue of a symmetric matrix that is
    linear in R (Bar-Itzhack 2000, "New method for extracting the quaternion from a rotation matrix").
    """
    r = rotation
    away = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    table = np.empty((4, 4))
    table[:3, :3] = r + r.T - np.trace(r) * np.eye(3)
    table[3, :3] = table[:3, 3] = away
    table[3, 3] = np.trace(r)
    x, y, z, w = np.linalg.eigh(table)[1][:, -1].tolist()
    vector = np.array([x, y, z]) * (1.0 if w >= 0.0 else -1.0)
    sine = float(np.linalg.norm(vector))
    return vector * (2.0 * np.arctan2(sine, abs(w)) / sine) if sine > 0.0 else np.zeros(3)
