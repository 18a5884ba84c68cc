"""Rigid bodies and where they are: the sums and turns that an arm's bodies are put together with.

Products and sums are written out term by term in one fixed order, that of Pinocchio (in products, the third row adds
from behind), so that no last bit depends on how a matrix library adds, and none differs between the two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, freeze

BODY_PARAMETERS = 10  # mass, first moments (3), inertia about the origin (6)
_EPSILON = float(np.finfo(float).eps)
_TRIANGLE = ((0, 0, 1, 0, 1, 2), (0, 1, 1, 2, 2, 2))  # order of the inertia's entries among the parameters


@dataclass(frozen=True, eq=False)
class Placement:
    """Where a frame is in another one.

    Attributes:
        rotation: From the frame's axes to the other's, shape (3, 3). [-]
        origin_m: The frame's origin in the other, shape (3,). [m]
    """

    rotation: Array
    origin_m: Array

    def __post_init__(self) -> None:
        freeze(self)

    @classmethod
    def of(cls, xyz_m: ArrayLike, rpy_rad: tuple[float, float, float]) -> Placement:
        """Placement by its origin (3,) [m] and turns about the fixed axes x, then y, then z [rad]."""
        x, y, z = ((math.cos(0.5 * angle), math.sin(0.5 * angle)) for angle in rpy_rad)
        turn = _quaternion_product((z[0], 0.0, 0.0, z[1]), (y[0], 0.0, y[1], 0.0))
        return cls(_rotation_of(_quaternion_product(turn, (x[0], x[1], 0.0, 0.0))), np.asarray(xyz_m, dtype=float))

    @classmethod
    def identity(cls) -> Placement:
        """The frame itself."""
        return cls(np.eye(3), np.zeros(3))

    def __matmul__(self, other: Placement) -> Placement:
        """Where a frame is that is placed in this one."""
        return Placement(product(self.rotation, other.rotation), self.at(other.origin_m))

    def at(self, point_m: ArrayLike) -> Array:
        """A point (3,) of the frame in the other one. [m]"""
        return self.origin_m + product(self.rotation, np.asarray(point_m, dtype=float)[:, None])[:, 0]


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Inertial figures of a body.

    Attributes:
        mass_kg: Mass. [kg]
        center_m: Centre of mass, shape (3,). [m]
        inertia_kg_m2: Inertia about the centre of mass, shape (3, 3). [kg m2]
    """

    mass_kg: float
    center_m: Array
    inertia_kg_m2: Array

    def __post_init__(self) -> None:
        freeze(self)

    @classmethod
    def nothing(cls) -> RigidBody:
        """A body without mass."""
        return cls(0.0, np.zeros(3), np.zeros((3, 3)))

    @classmethod
    def of_parameters(cls, parameters: Array) -> RigidBody:
        """Body with parameters of shape (10,), see `parameters`."""
        mass, inertia = float(parameters[0]), np.empty((3, 3))
        center = np.asarray(parameters[1:4] / mass if mass else np.zeros(3))
        inertia[_TRIANGLE] = inertia[_TRIANGLE[::-1]] = parameters[4:]
        return cls(mass, center, inertia - spread(mass, center))

    @property
    def parameters(self) -> Array:
        """What torques are linear in, shape (10,).

        Mass [kg], mass times centre (3) [kg m], and of the inertia about the origin xx, xy, yy, xz, yz, zz [kg m2].
        """
        inertia = self.inertia_kg_m2 + spread(self.mass_kg, self.center_m)
        return np.concatenate([[self.mass_kg], self.mass_kg * self.center_m, inertia[_TRIANGLE]])

    def heavier(self, share: float) -> RigidBody:
        """The same shape with a share more mass. [-]"""
        return RigidBody(self.mass_kg * (1.0 + share), self.center_m, self.inertia_kg_m2 * (1.0 + share))

    def placed(self, placement: Placement) -> RigidBody:
        """The body in the frame that another one is placed in."""
        return RigidBody(
            self.mass_kg, placement.at(self.center_m), _turned(self.inertia_kg_m2, placement.rotation.tolist())
        )

    def __add__(self, other: RigidBody) -> RigidBody:
        """Both bodies as one."""
        mass = self.mass_kg + other.mass_kg
        per_mass = 1.0 / max(mass, _EPSILON)
        apart = spread(self.mass_kg * other.mass_kg * per_mass, self.center_m - other.center_m)
        return RigidBody(
            mass,
            self.center_m * (self.mass_kg * per_mass) + (other.mass_kg * per_mass) * other.center_m,
            self.inertia_kg_m2 + other.inertia_kg_m2 + apart,
        )


def product(left: Array, right: Array) -> Array:
    """Matrix product of stacks, shapes (3, 3, ...) and (3, k, ...) -> (3, k, ...)."""
    first, second, third = (left[:, i, None] * right[None, i] for i in range(3))
    total = first + second + third
    total[2] = first[2] + (second[2] + third[2])
    return np.asarray(total)


def spread(mass_kg: float, center_m: Array) -> Array:
    """What a point mass adds to the inertia about the origin, shape (3, 3). [kg m2]"""
    x, y, z = center_m.tolist()
    xy, xz, yz = -mass_kg * x * y, -mass_kg * x * z, -mass_kg * y * z
    xx, yy, zz = mass_kg * (y * y + z * z), mass_kg * (x * x + z * z), mass_kg * (x * x + y * y)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _turned(inertia: Array, turn: list[list[float]]) -> Array:
    """R I R^T of a symmetric I: by I - Izz 1 in its place, so that two columns of R are enough."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tolist()
    (a, b), (c, d), (e, f) = (xx - zz, xy), (xy, yy - zz), (2.0 * xz, 2.0 * yz)
    partly = [(p * a + q * c + r * e, p * b + q * d + r * f) for p, q, r in turn[1:]]
    second, third = ([u * row[0] + v * row[1] for row in turn] for u, v in partly)
    shear = [xz * row[1] - yz * row[0] for row in turn]
    xy, xz, yz = second[0] + shear[2], third[0] - shear[1], third[1] + shear[0]
    xx = a + d - second[1] - third[2] + zz
    return np.array([[xx, xy, xz], [xy, second[1] + zz, yz], [xz, yz, third[2] + zz]])


def _quaternion_product(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    """Product of quaternions w, x, y, z: the turn b, then the turn a."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
    )


def _rotation_of(quaternion: tuple[float, ...]) -> Array:
    """Rotation matrix of a unit quaternion w, x, y, z, shape (3, 3). [-]"""
    w, x, y, z = quaternion
    xx, yy, zz = (2.0 * part * part for part in (x, y, z))
    xy, xz, yz, wx, wy, wz = 2.0 * y * x, 2.0 * z * x, 2.0 * z * y, 2.0 * x * w, 2.0 * y * w, 2.0 * z * w
    return np.array(
        [[1.0 - (yy + zz), xy - wz, xz + wy], [xy + wz, 1.0 - (xx + zz), yz - wx], [xz - wy, yz + wx, 1.0 - (xx + yy)]]
    )


def quaternions(rotations: Array) -> Array:
    """Unit quaternions w, x, y, z with w >= 0 of rotations, shapes (3, 3, N) -> (N, 4). [-]"""
    m, diagonal = rotations, rotations[range(3), range(3)]
    trace = diagonal[0] + (diagonal[1] + diagonal[2])
    result = np.empty((rotations.shape[2], 4))
    rows = trace > 0.0  # the part that is large there is the one to begin with: it loses no digits
    root = np.sqrt(trace[rows] + 1.0)
    result[rows, 0] = 0.5 * root
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[rows, 1 + i] = (m[k, j] - m[j, k])[rows] * (0.5 / root)
    largest = diagonal.argmax(axis=0)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        at = ~rows & (largest == i)
        root = np.sqrt((m[i, i] - m[j, j] - m[k, k])[at] + 1.0)
        result[at, 1 + i] = 0.5 * root
        for place, part in ((0, m[k, j] - m[j, k]), (1 + j, m[j, i] + m[i, j]), (1 + k, m[k, i] + m[i, k])):
            result[at, place] = part[at] * (0.5 / root)
    return np.where(result[:, :1] >= 0.0, result, -result)
