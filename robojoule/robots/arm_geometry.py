"""Where the axes of a six-axis arm are, and the joint positions of a pose that follow from that in closed form.

A pose is turned into equations with one unknown angle each (the subproblems of Paden and Kahan, as in B. Elias and J.
Wen, "IK-Geo: unified robot inverse kinematics using subproblem decomposition", 2022). All branches are carried along
together, one row each; a branch without a real angle turns into NaN.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from robojoule.arrays import Array, freeze
from robojoule.robots.mechanism import Mechanism
from robojoule.robots.rigid_body import Placement

_PARALLEL = 1e-7
_MEETING_M = 1e-6
_FREE = 1e-9  # below that size an equation does not hold its angle
_OUT_OF_REACH = 1e-5  # cosines up to that much above 1 come from rounded poses
_GRID = 720  # angles of joint 6 at which an arm with an offset wrist is looked at
_NEARLY = 0.02  # an equation that comes so near to zero between two of them may touch it


@dataclass(frozen=True, eq=False)
class ArmGeometry:
    """Axes of an arm of six joints with all joints at zero, in the base frame.

    Attributes:
        axes: Unit axes, shape (6, 3). [-]
        points_m: A point on each, shape (6, 3). [m]
        flange: Where the robot's own tool frame is.
        wrist_m: Where the last three axes meet, shape (3,); NaN where they do not. [m]
        last_meeting_m: Where the last two axes meet, shape (3,); NaN where they do not. [m]
        middle_meeting_m: Where axes 4 and 5 meet, shape (3,); NaN where they do not. [m]
        parallel: Whether axes 2 and 3, and whether axes 3 and 4 are parallel.
    """

    axes: Array
    points_m: Array
    flange: Placement
    wrist_m: Array
    last_meeting_m: Array
    middle_meeting_m: Array
    parallel: tuple[bool, bool]

    def __post_init__(self) -> None:
        freeze(self)

    @property
    def has_spherical_wrist(self) -> bool:
        """Whether the last three axes meet in one point."""
        return bool(np.isfinite(self.wrist_m).all())

    def solutions(self, flange: Placement, near: Array) -> Array | None:
        """Joint positions of a pose, those at the edge of reach included.

        Args:
            flange: Where the robot's own tool frame is to be.
            near: What joints that are free keep, shape (6,). [rad]

        Returns:
            Joint positions, shape (N, 6) [rad]; None where this arm has no closed form.
        """
        if not self.parallel[0]:
            return None
        turn = flange.rotation @ self.flange.rotation.T
        shift = flange.origin_m - turn @ self.flange.origin_m
        if self.has_spherical_wrist:
            q = self._arm(turn @ self.wrist_m + shift, self.wrist_m, _rows(near))
            return _finite(self._spherical_wrist(turn, q))
        if self.parallel[1] and np.isfinite(self.last_meeting_m).all():
            return _finite(self._three_parallel(turn, shift, near))
        if np.isfinite(self.middle_meeting_m).all():
            return self._offset_wrist(turn, shift, near)
        return None

    def _arm(self, target: Array, point: Array, q: Array) -> Array:
        """Joints 1 to 3 such that they bring a point to a target, four rows for each one of q, which holds the rest."""
        h, p = self.axes, self.points_m
        ahead = target - p[0]
        q = _branched(q, 0, _projected(-h[0], h[1], ahead, float(h[1] @ (point - p[0])), q[:, 0]))
        ahead = np.broadcast_to(ahead, (len(q) // 2, 3)) if ahead.ndim == 1 else ahead
        return self._elbow(p[0] + turned(h[0], -q[:, 0], np.vstack([ahead, ahead])), point, q)

    def _elbow(self, target: Array, point: Array, q: Array) -> Array:
        """Joints 2 and 3 such that they bring a point to targets, two rows for each one."""
        h, p = self.axes, self.points_m
        reach = np.linalg.norm(target - p[1], axis=1)
        arm, offset = point - p[2], p[1] - p[2]
        wanted = 0.5 * (arm @ arm + offset @ offset - reach**2)
        q = _branched(q, 2, _projected(h[2], offset, arm, wanted, q[:, 2]))
        target = np.vstack([target, target])
        straight = np.asarray(p[2] - p[1] + turned(h[2], q[:, 2], arm))
        q[:, 1] = _aligned(h[1], straight, target - p[1], q[:, 1])
        return q

    def _spherical_wrist(self, turn: Array, q: Array) -> Array:
        h = self.axes
        pointing = self._unturned((0, 1, 2), q, turn @ h[5])
        q = _branched(q, 4, _projected(h[4], h[3], h[5], pointing @ h[3], q[:, 4]))
        pointing = np.vstack([pointing, pointing])
        q[:, 3] = _aligned(h[3], turned(h[4], q[:, 4], h[5]), pointing, q[:, 3])
        across = _across(h[5])
        q[:, 5] = _aligned(h[5], across, self._unturned((0, 1, 2, 3, 4), q, turn @ across), q[:, 5])
        return q

    def _three_parallel(self, turn: Array, shift: Array, near: Array) -> Array:
        h, p = self.axes, self.points_m
        meeting = self.last_meeting_m
        q, ahead = _rows(near), turn @ meeting + shift - p[0]
        q = _branched(q, 0, _projected(-h[0], h[1], ahead, float(h[1] @ (meeting - p[0])), q[:, 0]))
        q = _branched(q, 4, _projected(h[4], h[1], h[5], self._unturned((0,), q, turn @ h[5]) @ h[1], q[:, 4]))
        standing = turned(h[0], q[:, 0], h[1]) @ turn
        q[:, 5] = _aligned(-h[5], turned(h[4], -q[:, 4], h[1]), standing, q[:, 5])
        fourth = p[4] + turned(h[4], -q[:, 4], p[3] - p[4])
        fourth = p[5] + turned(h[5], -q[:, 5], fourth - p[5])
        target = p[0] + turned(h[0], -q[:, 0], fourth @ turn.T + shift - p[0])
        q = self._elbow(target, p[3], q)
        across = _across(h[3])
        tip = turned(h[5], -q[:, 5], turned(h[4], -q[:, 4], across))
        q[:, 3] = _aligned(h[3], across, self._unturned((0, 1, 2), q, tip @ turn.T), q[:, 3])
        return q

    def _offset_wrist(self, turn: Array, shift: Array, near: Array) -> Array:
        """Near every zero in the angle of joint 6 of what axes 4 and 5 must keep between them."""
        h, p = self.axes, self.points_m
        grid = np.linspace(0.0, math.tau, _GRID, endpoint=False)
        q = np.tile(near, (_GRID, 1))
        q[:, 5] = grid
        point = self.middle_meeting_m
        q = self._arm((p[5] + turned(h[5], -grid, point - p[5])) @ turn.T + shift, point, q)
        fifth = self._unturned((0, 1, 2), q, turned(h[5], -q[:, 5], h[4]) @ turn.T)
        missing = (fifth @ h[3] - h[3] @ h[4]).reshape(-1, _GRID)
        after, before = np.roll(missing, -1, axis=1), np.roll(missing, 1, axis=1)
        with np.errstate(invalid="ignore"):
            crossing = missing * after <= 0.0
            touching = (np.abs(missing) <= np.fmin(np.abs(after), np.abs(before))) & (np.abs(missing) < _NEARLY)
        edge = np.isfinite(missing) & ~(np.isfinite(after) & np.isfinite(before))
        rows = np.flatnonzero((crossing | np.roll(crossing, 1, axis=1) | touching | edge).ravel())
        q, fifth = q[rows], fifth[rows]
        q[:, 3] = _aligned(h[3], h[4], fifth, q[:, 3])
        across = _across(h[4])
        tip = turned(h[5], -q[:, 5], across) @ turn.T
        q[:, 4] = _aligned(h[4], across, self._unturned((0, 1, 2, 3), q, tip), q[:, 4])
        return _finite(q)

    def _unturned(self, joints: tuple[int, ...], q: Array, vectors: Array) -> Array:
        """Vectors, shape (3,) or (N, 3), turned back by joints, the one nearest to the base first."""
        for joint in joints:
            vectors = turned(self.axes[joint], -q[:, joint], vectors)
        return vectors


@lru_cache(maxsize=64)
def geometry_of(mechanism: Mechanism) -> ArmGeometry:
    """Geometry of an arm of six joints."""
    rotations, origins = (part[..., 0] for part in mechanism.body_placements(np.zeros((1, mechanism.joint_count))))
    axes = np.einsum("jrc,jc->jr", rotations[1:], mechanism.axes)
    points = origins[1:]
    at = mechanism.tool_body
    last, middle = (_meeting(axes[i : i + 2], points[i : i + 2]) for i in (4, 3))
    wrist = _meeting(axes[3:], points[3:])
    return ArmGeometry(
        axes=axes,
        points_m=points,
        flange=Placement(rotations[at], origins[at]) @ mechanism.tool,
        wrist_m=wrist,
        last_meeting_m=last,
        middle_meeting_m=middle,
        parallel=(_are_parallel(axes[1], axes[2]), _are_parallel(axes[2], axes[3])),
    )


def _are_parallel(first: Array, second: Array) -> bool:
    return bool(np.linalg.norm(np.cross(first, second)) < _PARALLEL)


def _meeting(axes: Array, points: Array) -> Array:
    """Where lines meet, shape (3,); NaN where they do not. [m]"""
    across = np.eye(3) - np.einsum("ji,jk->jik", axes, axes)
    normal = across.sum(axis=0)
    if np.linalg.eigvalsh(normal)[0] < _PARALLEL:
        return np.full(3, np.nan)
    point = np.linalg.solve(normal, np.einsum("jik,jk->i", across, points))
    apart = np.linalg.norm(np.einsum("jik,jk->ji", across, point - points), axis=1)
    return np.asarray(point) if apart.max() < _MEETING_M else np.full(3, np.nan)


def _rows(near: Array) -> Array:
    return np.array(near, dtype=float)[None]


def _finite(q: Array) -> Array:
    return np.asarray(q[np.isfinite(q).all(axis=1)])


def _branched(q: Array, joint: int, angles: tuple[Array, Array]) -> Array:
    """All rows twice, each time with one of the two angles of a joint."""
    q = np.vstack([q, q])
    q[:, joint] = np.concatenate(angles)
    return q


def _across(axis: Array) -> Array:
    """A unit vector across a unit axis, shape (3,)."""
    least = np.eye(3)[int(np.argmin(np.abs(axis)))]
    across = np.cross(axis, least)
    return np.asarray(across / np.linalg.norm(across))


def turned(axis: Array, angles: Array, vectors: Array) -> Array:
    """Vectors, shape (3,) or (N, 3), turned about a unit axis by N angles [rad], shape (N, 3)."""
    sine, cosine = np.sin(angles)[:, None], np.cos(angles)[:, None]
    along = (vectors @ axis)[..., None] * axis
    return np.asarray(vectors * cosine + np.cross(axis, vectors) * sine + along * (1.0 - cosine))


def _projected(axis: Array, onto: Array, vector: Array, wanted: Array | float, free: Array) -> tuple[Array, Array]:
    """Both angles about an axis at which a vector has the wanted projection onto another one.

    Args:
        axis: Unit axis, shape (3,).
        onto: Shape (3,).
        vector: Shape (3,) or (N, 3).
        wanted: Scalar products, shape (N,) or one.
        free: Angles where every one will do, shape (N,). [rad]

    Returns:
        Angles, shape (N,) each; NaN where there is none. [rad]
    """
    sine = np.cross(axis, vector) @ onto
    along = (vector @ axis) * float(onto @ axis)
    cosine = vector @ onto - along
    size = np.hypot(sine, cosine)
    missing = wanted - along
    is_free = (size < _FREE) & (np.abs(missing) < _OUT_OF_REACH)
    ratio = missing / np.maximum(size, _FREE)
    with np.errstate(invalid="ignore"):
        half = np.arccos(np.where(np.abs(ratio) <= 1.0 + _OUT_OF_REACH, np.clip(ratio, -1.0, 1.0), np.nan))
    middle = np.arctan2(sine, cosine)
    low, high = (np.broadcast_to(np.where(is_free, free, middle + sign * half), free.shape) for sign in (-1.0, 1.0))
    return low, high


def _aligned(axis: Array, vector: Array, target: Array, free: Array) -> Array:
    """Angles about an axis that bring vectors to targets as far as turning can, shape (N,). [rad]

    Args:
        axis: Unit axis, shape (3,).
        vector: Shape (3,) or (N, 3).
        target: Shape (N, 3).
        free: Angles where every one will do, shape (N,). [rad]
    """
    sine = np.einsum("...i,...i->...", np.cross(vector, target), axis)
    cosine = np.einsum("...i,...i->...", vector, target) - (vector @ axis) * (target @ axis)
    return np.where(np.hypot(sine, cosine) < _FREE, free, np.arctan2(sine, cosine))
