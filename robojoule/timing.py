"""The controller's rule: speed limit -> time law of a straight joint-space motion.

The speed limit p in (0, 1] scales the joint velocity limits, hence the peak path velocity
v(p) = p min_j(v_max,j / |dq_j|). The path acceleration a(v) is the largest constant that keeps every joint torque
within `torque_use` of its effort limit at every path node, at standstill and at v (but `torque_floor` of the effort
limit is always left for acceleration), and jerk = a / filter time. As a(v) falls with v, a faster peak need not give a
shorter motion: the controller raises the peak velocity towards v(p) as long as that shortens the motion and the torques
of steady motion (gravity, friction, centrifugal) leave `torque_floor` within the effort limits. Speed limits above give
the same run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.drive import Array
from robojoule.dynamics import PathTorques
from robojoule.errors import InputError
from robojoule.robots.robot import Robot
from robojoule.trajectory import ROUNDING, PathLaw, duration_at_peak_s, path_law, reachable_velocity

Index = NDArray[np.intp]

DURATION_TOLERANCE_S = 1e-9
_SEARCH_GRID = np.linspace(0.05, 1.0, 20)
_BISECTIONS = 50


@dataclass(frozen=True)
class _TorqueLimits:
    """Torque limits of M motions, padded to K each: |inertia a + standing + viscous v + centrifugal v^2| <= usable.

    `steady_velocity`, shape (M,), is the peak velocity up to which steady torques leave the floor within the effort
    limits of all joints. Where gravity and Coulomb friction alone exceed that, a lower velocity would not help. [1/s]
    """

    steady_velocity: Array
    inertia: Array
    standing: Array
    viscous: Array
    centrifugal: Array
    usable: Array
    floor: Array


class PathTiming:
    """Time laws of M motions as the controller plans them with the model it has of the robot.

    Args:
        robot: The controller's model of the robot and its payload.
        torques: Path torques of that model along the motions.
        delta_rad: Joint changes, shape (M, n). [rad]
    """

    def __init__(self, robot: Robot, torques: PathTorques, delta_rad: Array) -> None:
        self.robot = robot
        self.torques = torques
        self.delta_rad = delta_rad
        self.motions = len(delta_rad)
        self.travel_rad = np.abs(delta_rad).max(axis=1)
        self.moving = self.travel_rad > 0.0
        with np.errstate(divide="ignore"):
            self.full_velocity = np.min(robot.velocity_rad_s / np.abs(delta_rad), axis=1)

    def acceleration(self, velocity: Array, rows: Index) -> Array:
        """Path acceleration that the drives allow at peak velocities, shapes (M', ...) -> (M', ...). [1/s2]"""
        columns = velocity.reshape(len(velocity), -1).T
        return np.stack([self._acceleration_and_slope(v, rows)[0] for v in columns], axis=-1).reshape(velocity.shape)

    def _acceleration_and_slope(self, velocity: Array, rows: Index) -> tuple[Array, Array]:
        """Allowed path acceleration [1/s2] and its derivative after the peak velocity [1/s], shapes (M',)."""
        limits = self._limits
        standing, viscous, centrifugal = limits.standing[rows], limits.viscous[rows], limits.centrifugal[rows]
        v = velocity[:, None]
        moving = standing + v * (viscous + v * centrifugal)
        left = limits.usable[rows] - np.maximum(np.abs(standing), np.abs(moving))
        floor, inertia = limits.floor[rows], limits.inertia[rows]
        with np.errstate(divide="ignore"):  # a joint that does not move sets no limit
            ratio = np.maximum(left, floor) / inertia
        number, tightest = np.arange(len(rows)), ratio.argmin(axis=1)
        at = (number, tightest)
        falls = (left[at] > floor[at]) & (np.abs(moving[at]) > np.abs(standing[at]))
        slope = -np.sign(moving[at]) * (2.0 * centrifugal[at] * velocity + viscous[at]) / inertia[at]
        return np.asarray(ratio[at]), np.where(falls, slope, 0.0)

    @cached_property
    def _limits(self) -> _TorqueLimits:
        """Torque limits (a joint at a node) that can be the tightest one at some peak velocity.

        A limit whose worst acceleration over all velocities exceeds what another allows at standstill never binds.
        """
        drives, effort, torques = self.robot.drives, self.robot.effort_nm, self.torques
        shape = torques.at_nodes[2].shape
        centrifugal = torques.at_nodes[1]
        inertia = np.abs(torques.at_nodes[0] + (drives.reflected_inertia_kg_m2 * self.delta_rad)[:, None, :])
        standing = torques.at_nodes[2] + (drives.coulomb_nm * np.sign(self.delta_rad))[:, None, :]
        viscous = np.broadcast_to((drives.viscous_nm_s_per_rad * self.delta_rad)[:, None, :], shape)
        usable = np.broadcast_to(drives.torque_use * effort, shape)
        floor = np.broadcast_to(drives.torque_floor * effort, shape)
        top = np.where(self.moving, self.full_velocity, 0.0)[:, None, None]
        worst = np.abs(standing) + top * (np.abs(viscous) + top * np.abs(centrifugal))
        room = (1.0 - drives.torque_floor) * effort
        steady = np.full(shape, np.inf)
        near = worst > room
        terms = (centrifugal[near], viscous[near], standing[near])
        steady[near] = _first_reached(*terms, np.broadcast_to(room, shape)[near])
        with np.errstate(divide="ignore", invalid="ignore"):
            least = np.maximum(usable - worst, floor) / inertia
            most = np.maximum(usable - np.abs(standing), floor) / inertia
        binding = (least <= most.min(axis=(1, 2), keepdims=True)).reshape(self.motions, -1)
        width = max(int(binding.sum(axis=1).max(initial=0)), 1)
        chosen = np.argsort(~binding, axis=1, kind="stable")[:, :width]

        def take(values: Array) -> Array:
            return np.take_along_axis(values.reshape(self.motions, -1), chosen, axis=1)

        limits = (take(x) for x in (inertia, standing, viscous, centrifugal, usable, floor))
        return _TorqueLimits(steady.min(axis=(1, 2)), *limits)

    @cached_property
    def fastest_velocity(self) -> Array:
        """Peak path velocity at full speed, shape (M,); 0 for motions of zero length. [1/s]

        The controller raises the peak velocity towards the limit as long as that shortens the motion.
        """
        fastest = np.zeros(self.motions)
        rows = np.flatnonzero(self.moving)
        if rows.size == 0:
            return fastest
        # Above `top` the peak is not reached on the path, so that it shortens nothing.
        highest = np.minimum(self.full_velocity, self._limits.steady_velocity)[rows]
        top = self._bisect(lambda v: ~self._reachable(v, rows), np.zeros(len(rows)), highest)
        candidates = top[:, None] * _SEARCH_GRID
        low, high = self._first_rise(candidates, rows)
        floors = self._floor_velocities(rows)
        floored = np.flatnonzero((floors < top[:, None]).any(axis=1))
        if floored.size:
            narrow = np.minimum(floors[floored] * (1.0 - ROUNDING), top[floored, None])
            both = np.sort(np.concatenate([candidates[floored], narrow], axis=1), axis=1)
            low[floored], high[floored] = self._first_rise(both, rows[floored])
        fastest[rows] = self._bisect(lambda v: self._duration_slope(v, rows) > 0.0, low, high)
        return fastest

    def _first_rise(self, candidates: Array, rows: Index) -> tuple[Array, Array]:
        """Neighbouring candidates between which the duration begins to rise; the last two where it never does.

        Args:
            candidates: Rising peak velocities, shape (M', C). [1/s]
            rows: Which motions, shape (M',).
        """
        low, high = np.zeros(len(rows)), candidates[:, -1].copy()
        open_rows = np.ones(len(rows), dtype=bool)
        for v in candidates.T:
            rises = self._duration_slope(v, rows) > 0.0
            low = np.where(open_rows & ~rises, v, low)
            high = np.where(open_rows & rises, v, high)
            open_rows &= ~rises
        return low, high

    def _floor_velocities(self, rows: Index) -> Array:
        """Peak velocities at which a torque limit falls to its floor, shape (M', K); infinite if it never does. [1/s]

        Until there, the duration by one limit alone falls and then rises; behind it, it may fall again. A rise that is
        too narrow for the search grid therefore ends in one of these.
        """
        limits = self._limits
        a, b, c = limits.centrifugal[rows], limits.viscous[rows], limits.standing[rows]
        return _first_reached(a, b, c, limits.usable[rows] - limits.floor[rows])

    @staticmethod
    def _bisect(beyond: Callable[[Array], NDArray[np.bool_]], low: Array, high: Array) -> Array:
        """Largest values from which `beyond` is false; `high` itself where it is false there."""
        result = np.where(beyond(high), low, high)
        low, high = result.copy(), high.copy()
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            outside = beyond(middle)
            low, high = np.where(outside, low, middle), np.where(outside, middle, high)
        return low

    def _reachable(self, velocity: Array, rows: Index) -> NDArray[np.bool_]:
        acceleration = self.acceleration(velocity, rows)
        return np.asarray(reachable_velocity(acceleration, self.robot.drives.filter_time_s) >= velocity, dtype=np.bool_)

    def _duration_slope(self, velocity: Array, rows: Index) -> Array:
        """Derivative of the duration 1/v + T_a(v) after the peak velocity, shapes (M',). [s2]"""
        filter_s = self.robot.drives.filter_time_s
        a, slope = self._acceleration_and_slope(velocity, rows)
        with_plateau = 1.0 / a - velocity * slope / a**2
        without = np.sqrt(filter_s / (velocity * a)) - np.sqrt(velocity * filter_s / a**3) * slope
        return np.where(velocity >= a * filter_s, with_plateau, without) - 1.0 / velocity**2

    def _duration_at(self, velocity: Array, rows: Index) -> Array:
        filter_s = self.robot.drives.filter_time_s
        return duration_at_peak_s(velocity, self.acceleration(velocity, rows), filter_s)

    def peak_velocities(self, speed_limits: ArrayLike) -> Array:
        """Peak path velocity under speed limits.

        Args:
            speed_limits: Fractions in (0, 1], shape (S,) for all motions or (M, S). [-]

        Returns:
            Shape (M, S); 0 for motions of zero length. [1/s]

        Raises:
            InputError: A speed limit is not in (0, 1].
        """
        limits = np.asarray(speed_limits, dtype=float)
        if not np.all((limits > 0.0) & (limits <= 1.0)):
            raise InputError("a speed limit is out of range", allowed="above 0 and at most 1 (100 %)")
        limits = np.broadcast_to(limits, (self.motions, limits.shape[-1]))
        full = np.where(self.moving, self.full_velocity, 0.0)
        return np.asarray(np.minimum(limits * full[:, None], self.fastest_velocity[:, None]))

    def durations(self, speed_limits: ArrayLike) -> Array:
        """Durations under speed limits, shapes as in `peak_velocities`. [s]"""
        velocity = self.peak_velocities(speed_limits)
        result = np.zeros_like(velocity)
        rows = np.flatnonzero(self.moving)
        if rows.size:
            result[rows] = self._duration_at(velocity[rows], rows)
        return result

    def minimum_durations(self) -> Array:
        """Durations at full speed, shape (M,). [s]"""
        return self.durations(np.ones(1))[:, 0]

    def fastest_speed_limits(self) -> Array:
        """Lowest speed limits that give the fastest runs, shape (M,); 1 for motions of zero length. [-]"""
        limits = np.ones(self.motions)
        limits[self.moving] = np.minimum(self.fastest_velocity[self.moving] / self.full_velocity[self.moving], 1.0)
        return limits

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest speed limits that give at most the requested durations (the inverse of `durations`).

        Args:
            durations_s: Requested durations, shape (M,). [s]

        Returns:
            Speed limits, shape (M,); 1 where the fastest run is needed and for motions of zero length. [-]

        Raises:
            InputError: A duration is shorter than the motion's fastest.
        """
        wanted = np.asarray(durations_s, dtype=float)
        fastest = self.minimum_durations()
        short = np.flatnonzero(wanted < fastest - DURATION_TOLERANCE_S)
        if short.size:
            i = int(short[0])
            raise InputError(
                f"motion {i + 1} cannot take {wanted[i]:.6g} s", allowed=f"at least {fastest[i]:.6g} s (full speed)"
            )
        rows = np.flatnonzero(self.moving)
        result = np.ones(self.motions)
        if rows.size == 0:
            return result
        target = np.maximum(wanted[rows], fastest[rows])
        high = self.fastest_velocity[rows]
        low = np.minimum(1.0 / target, high)  # d > 1/v always, so 1/d is slower than wanted
        for _ in range(80):
            middle = (low + high) / 2.0
            fast_enough = self._duration_at(middle, rows) <= target
            high = np.where(fast_enough, middle, high)
            low = np.where(fast_enough, low, middle)
        limits = high / self.full_velocity[rows]
        result[rows] = np.minimum(np.where(high >= self.fastest_velocity[rows], 1.0, limits), 1.0)
        return result

    def law(self, index: int, peak_velocity: float) -> PathLaw:
        """Time law of motion `index` at a peak path velocity [1/s]."""
        return self.laws(np.array([[peak_velocity]]), np.array([index]))[0]

    def laws(self, peak_velocity: Array, rows: Index) -> list[PathLaw]:
        """Time laws of some motions at peak path velocities.

        Args:
            peak_velocity: Peak path velocities, shape (M', S). [1/s]
            rows: Which motions, shape (M',).

        Returns:
            M' S laws, motion by motion.
        """
        acceleration = self.acceleration(peak_velocity, rows)
        filter_s = self.robot.drives.filter_time_s
        return [
            path_law(float(self.travel_rad[m]), float(v), float(a), float(a) / filter_s)
            for m, vs, accelerations in zip(rows, peak_velocity, acceleration, strict=True)
            for v, a in zip(vs, accelerations, strict=True)
        ]


def _first_reached(centrifugal: Array, viscous: Array, standing: Array, room: Array) -> Array:
    """Least velocity at which |standing + viscous v + centrifugal v^2| reaches `room`; infinite if it never does.

    Also infinite where it is beyond already at standstill. All of one shape. [1/s]
    """
    found = np.full(standing.shape, np.inf)
    for side in (-1.0, 1.0):
        offset = standing + side * room
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(viscous**2 - 4.0 * centrifugal * offset)
            for q in (-(viscous + root) / 2.0, -(viscous - root) / 2.0):  # the two ways that lose no digits
                for v in (q / centrifugal, offset / q):
                    found = np.where((v > 0.0) & (v < found), v, found)
    return np.where(np.abs(standing) < room, found, np.inf)
