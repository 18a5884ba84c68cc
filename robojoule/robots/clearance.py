"""Clearance between robots that share space: capsules of placed arms, bounded between the places that are looked at.

While its joints turn by dq, a capsule moves by at most sum_j |dq_j| r_j, where r_j is the farthest that it can be from
joint j (`CollisionModel.levers_m`). So where two capsules are D apart in the middle of two stretches of their courses,
they come no closer on them than

    D - (how far the first moves from the middle) - (how far the second does) .

What is not decided by that is halved until it is, or until the capsules move by less than a resolution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array, Index, freeze
from robojoule.robots.collision import CollisionModel, segment_distances_m
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Robot

SWEPT_RESOLUTION_M = 5e-3  # courses that come as near as this to the least distance count as closer
RESOLUTION_M = 1e-3  # of a clearance over time
_CHUNK = 2048  # places looked at together: bounds memory

Places = Callable[[Index, Array], Array]  # path positions (N,) of pieces (N,) at times (N,) [s]


@dataclass(frozen=True, eq=False)
class Courses:
    """Straight joint-space paths of an arm; a pose is one without change.

    Attributes:
        start_rad: Shape (M, n). [rad]
        delta_rad: Shape (M, n). [rad]
    """

    start_rad: Array
    delta_rad: Array

    def __post_init__(self) -> None:
        freeze(self)

    def __len__(self) -> int:
        return len(self.start_rad)


class PlacedArm:
    """An arm somewhere in a cell.

    Args:
        robot: Robot with its payload.
        base: Where its base frame is in the cell.
    """

    def __init__(self, robot: Robot, base: Placement) -> None:
        self.base = base
        self.model = CollisionModel(robot)

    def segments_m(self, q: Array) -> Array:
        """Ends of the axes of its K capsules in the cell for configurations (N, n) [rad], shape (K, 2, N, 3). [m]"""
        return np.asarray(self.model.segments_m(q) @ self.base.rotation.T + self.base.origin_m)

    def travel_m(self, courses: Courses) -> Array:
        """How far each capsule moves along each course at most, shape (M, K). [m]"""
        return np.asarray(np.abs(courses.delta_rad) @ self.model.levers_m.T)


def gaps_m(first: PlacedArm, first_rad: Array, second: PlacedArm, second_rad: Array) -> Array:
    """Distances between the surfaces of all capsules of two arms, shape (K, L, N); negative where they overlap. [m]

    Args:
        first: One arm.
        first_rad: Its configurations, shape (N, n). [rad]
        second: The other arm.
        second_rad: Its configurations, shape (N, m). [rad]
    """
    a, b = first.segments_m(first_rad), second.segments_m(second_rad)
    apart = segment_distances_m(a[:, None, 0], a[:, None, 1], b[None, :, 0], b[None, :, 1])
    return np.asarray(apart - (first.model.radii_m[:, None] + second.model.radii_m)[..., None])


def come_close(
    first: PlacedArm, courses: Courses, second: PlacedArm, others: Courses, least_m: float
) -> NDArray[np.bool_]:
    """Which courses of two arms come closer to each other than a distance, wherever each arm is on its course.

    Args:
        first: One arm.
        courses: M courses of it.
        second: The other arm.
        others: L courses of that.
        least_m: The distance. [m]

    Returns:
        Shape (M, L). Pairs of which it could not be shown that they keep the distance and 5 mm count as closer.
    """
    found = np.zeros((len(courses), len(others)), dtype=bool)
    travel, other_travel = first.travel_m(courses), second.travel_m(others)
    i, j = (part.ravel() for part in np.indices(found.shape))
    open_ = np.stack([i, j, np.full(i.size, 0.5), np.full(i.size, 0.5), *np.full((2, i.size), 0.5)], axis=1)
    while len(open_):
        part, open_ = open_[:_CHUNK], open_[_CHUNK:]
        part = part[~found[part[:, 0].astype(int), part[:, 1].astype(int)]]
        if not len(part):
            continue
        i, j = part[:, 0].astype(int), part[:, 1].astype(int)
        s, t, half_s, half_t = part[:, 2:].T
        q = courses.start_rad[i] + s[:, None] * courses.delta_rad[i]
        p = others.start_rad[j] + t[:, None] * others.delta_rad[j]
        gaps = gaps_m(first, q, second, p)
        moves, other_moves = travel[i].T * half_s, other_travel[j].T * half_t  # (K, N), (L, N)
        closest = gaps.min(axis=(0, 1))
        sure = (gaps - moves[:, None] - other_moves[None]).min(axis=(0, 1))
        largest, other_largest = moves.max(axis=0), other_moves.max(axis=0)
        close = (closest < least_m) | ((sure < least_m) & (largest + other_largest < SWEPT_RESOLUTION_M))
        found[i[close], j[close]] = True
        rest = part[(sure < least_m) & ~close]
        along = (largest >= other_largest)[(sure < least_m) & ~close]
        open_ = np.concatenate([_halves(rest[along], 2), _halves(rest[~along], 3), open_])
    return found


def _halves(rows: Array, column: int) -> Array:
    """Both halves of stretches: the middle in one column, half their length two columns on."""
    both = []
    for sign in (-1.0, 1.0):
        half = rows.copy()
        half[:, column + 2] *= 0.5
        half[:, column] += sign * half[:, column + 2]
        both.append(half)
    return np.concatenate(both)


@dataclass(frozen=True, eq=False)
class TimedCourses:
    """What an arm does over some time: courses one after another, and where on them it is.

    Attributes:
        arm: The arm.
        courses: M courses.
        ends_s: End of each course, rising, shape (M,); the first one starts at 0. [s]
        places: Path positions of given courses at given times; they rise along each course.
    """

    arm: PlacedArm
    courses: Courses
    ends_s: Array
    places: Places

    def at(self, pieces: Index, time_s: Array) -> Array:
        """Configurations on given courses at given times, shape (N, n). [rad]"""
        s = self.places(pieces, time_s)
        return np.asarray(self.courses.start_rad[pieces] + s[:, None] * self.courses.delta_rad[pieces])


def least_clearance(first: TimedCourses, second: TimedCourses) -> tuple[float, float]:
    """The least distance between two arms over the time that both courses cover.

    Returns:
        A distance that they keep, at most 1 mm below the least one [m]; when they are so close [s].
    """
    edges = np.unique(np.concatenate([[0.0], first.ends_s, second.ends_s]))
    open_ = np.stack([edges[:-1], edges[1:]], axis=1)
    travel, other_travel = first.arm.travel_m(first.courses), second.arm.travel_m(second.courses)
    closest, kept, when = np.inf, np.inf, 0.0
    while len(open_):
        part, open_ = open_[:_CHUNK], open_[_CHUNK:]
        low, high = part.T
        middle = 0.5 * (low + high)
        i, j = (np.searchsorted(one.ends_s, middle).clip(max=len(one.ends_s) - 1) for one in (first, second))
        gaps = gaps_m(first.arm, first.at(i, middle), second.arm, second.at(j, middle))
        moves = travel[i].T * _spread(first, i, low, middle, high)
        other_moves = other_travel[j].T * _spread(second, j, low, middle, high)
        here = gaps.min(axis=(0, 1))
        sure = (gaps - moves[:, None] - other_moves[None]).min(axis=(0, 1))
        if here.min() < closest:
            closest, when = float(here.min()), float(middle[np.argmin(here)])
        done = sure >= closest - RESOLUTION_M
        kept = min(kept, float(sure[done].min(initial=np.inf)))
        rest = part[~done]
        middles = middle[~done]
        halves = [np.stack([rest[:, 0], middles], axis=1), np.stack([middles, rest[:, 1]], axis=1)]
        open_ = np.concatenate([*halves, open_])
    return min(kept, closest), when


def _spread(one: TimedCourses, pieces: Index, low: Array, middle: Array, high: Array) -> Array:
    """How far along its course an arm moves away from the middle of a time, shape (N,). [-]"""
    s = [one.places(pieces, time) for time in (low, middle, high)]
    return np.asarray(np.maximum(s[1] - s[0], s[2] - s[1]))
