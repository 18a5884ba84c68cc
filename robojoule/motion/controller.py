"""The controller's rule: speed limit -> time law of a motion along a joint-space path.

The speed limit p in (0, 1] scales the joint velocity limits, hence the peak path velocity
v(p) = p min_j(v_max,j / |q'_j|) with the steepest slopes q'_j. Every motion has one path acceleration a, whatever its
speed limit: the largest constant that keeps each joint torque within `torque_use` of its peak limit at every path node,
at standstill and at the peak velocity of full speed; jerk = a / filter time. The peak velocity of full speed is the
highest one, up to v(1), at which the run still cruises for a share c = `least_cruise_share` of its duration,

    v T_a(v) <= (1 - c) / (1 + c) ,      T_a = v / a(v) + T_f  (time to reach v) ,

as planners of industrial controllers choose peak velocities with the acceleration they have, and do not search the
velocity at which torque and time balance. Speed limits above v_1 / v(1) give the same run.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.motion.dynamics import PathTorques
from robojoule.motion.inverse import check_durations
from robojoule.motion.path import Path
from robojoule.motion.time_laws import (
    PathLaw,
    duration_at_peak_s,
    path_law,
    ramp_time_s,
    reachable_velocity,
)
from robojoule.motion.torque_limits import NEVER_BINDS, TorqueLimits
from robojoule.robots.robot import Robot

_BISECTIONS = (4, 6, 42)
_BLOCK = 128  # motions whose torque limits are looked at together: keeps the work arrays in the processor's cache


class PathTiming:
    """Time laws of M motions as the controller plans them with the model it has of the robot.

    Args:
        robot: The controller's model of the robot and its payload.
        torques: Path torques of that model along the motions.
        path: The motions' paths.
    """

    def __init__(self, robot: Robot, torques: PathTorques, path: Path) -> None:
        self.robot = robot
        self.torques = torques
        self.path = path
        self.travel_rad = path.travel_rad.max(axis=1)
        self.motions = len(self.travel_rad)
        self.moving = self.travel_rad > 0.0
        with np.errstate(divide="ignore"):
            self.full_velocity = np.min(robot.velocity_rad_s / path.steepest_rad, axis=1)

    @cached_property
    def _limits(self) -> tuple[TorqueLimits, Array]:
        """Torque limits that can bind below the highest peak velocities, and these, shape (M,). [1/s]"""
        top = np.where(self.moving, self.full_velocity, 0.0)
        parts = []
        for first in range(0, max(self.motions, 1), _BLOCK):
            block = slice(first, first + _BLOCK)
            parts.append(self._binding_limits(block, top[block]))
        return TorqueLimits.joined(parts), top

    def torque_limits(self, block: slice = slice(None)) -> TorqueLimits:
        """All torque limits of a block of motions.

        Raises:
            InputError: Gravity and friction take all that a joint has in a motion's poses.
        """
        drives, peak = self.robot.drives, self.robot.peak_effort_nm[:, None]
        inertia, centrifugal, gravity = np.split(self.torques.values[block], 3, axis=1)
        slope = self.path.slopes_rad(block, self.torques.values_s[block])

        def limits(values: Array) -> Array:
            return np.broadcast_to(values, gravity.shape).reshape(len(gravity), -1)

        standing = gravity + drives.coulomb_nm[:, None] * np.sign(self.path.delta_rad[block])[:, :, None]
        self._check_standing(block, np.abs(standing).max(axis=2))
        return TorqueLimits(
            inertia=np.maximum(np.abs(limits(inertia + drives.reflected_inertia_kg_m2[:, None] * slope)), NEVER_BINDS),
            standing=limits(standing),
            viscous=limits(drives.viscous_nm_s_per_rad[:, None] * slope),
            centrifugal=limits(centrifugal),
            peak=limits(peak),
            usable=limits(drives.torque_use * peak),
            floor=limits(drives.torque_floor * peak),
        )

    def _binding_limits(self, block: slice, top: Array) -> TorqueLimits:
        """Limits of a block of motions that can bind up to the velocities `top` (M',) [1/s], which it lowers."""
        every, none = self.torque_limits(block), np.zeros(len(top))
        within = reachable_velocity(every.acceleration(none), self.robot.drives.filter_time_s, self._ramp_share)
        np.minimum(top, within, out=top)
        return every.binding(*every.steady_bounds(none, top))

    def _check_standing(self, block: slice, standing: Array) -> None:
        """Refuse motions in whose poses gravity and friction, shape (M', n) [Nm], take all that a joint has."""
        beyond = (standing >= self.robot.peak_effort_nm) & self.moving[block, None]
        if beyond.any():
            motion, joint = (int(number) for number in np.argwhere(beyond)[0])
            raise InputError(
                f"{self.robot.joint_names[joint]} of {self.robot.name} cannot move the arm in motion "
                f"{block.start + motion + 1}: gravity and friction take {standing[motion, joint]:.4g} Nm",
                allowed=f"less than its peak torque of {self.robot.peak_effort_nm[joint]:.4g} Nm; "
                "a lighter payload, another pose, or an allowed overload",
            )

    @property
    def _ramp_share(self) -> float:
        """Largest v T_a(v): what the least share of cruise leaves for the ramps. [-]"""
        share = self.robot.drives.least_cruise_share
        return (1.0 - share) / (1.0 + share)

    @cached_property
    def full_speed(self) -> tuple[Array, Array]:
        """Peak path velocity at full speed [1/s] and path acceleration [1/s2] at every speed limit, shape (M,) each.

        For motions of zero length the velocity is 0 and the acceleration 1.
        """
        fastest, acceleration = np.zeros(self.motions), np.ones(self.motions)
        rows = np.flatnonzero(self.moving)
        if rows.size == 0:
            return fastest, acceleration
        limits, high = self._limits[0].of(rows), self._limits[1][rows].copy()
        low = np.where(self._cruises(high, limits), high, 0.0)
        for steps in _BISECTIONS:  # the narrower the bracket, the fewer limits can bind in it
            for _ in range(steps):
                middle = (low + high) / 2.0
                cruises = self._cruises(middle, limits)
                low, high = np.where(cruises, middle, low), np.where(cruises, high, middle)
            limits = limits.binding(*limits.steady_bounds(low, high))
        fastest[rows], acceleration[rows] = low, limits.acceleration(low)
        return fastest, acceleration

    def _cruises(self, velocity: Array, limits: TorqueLimits) -> NDArray[np.bool_]:
        """Whether runs at peak velocities (M',) [1/s] cruise for the least share of their duration."""
        acceleration = limits.acceleration(velocity)
        with np.errstate(divide="ignore"):
            ramp = ramp_time_s(velocity, acceleration, self.robot.drives.filter_time_s)
        return np.asarray(velocity * ramp <= self._ramp_share, dtype=np.bool_)

    @property
    def fastest_velocity(self) -> Array:
        """Peak path velocity at full speed, shape (M,); 0 for motions of zero length. [1/s]"""
        return self.full_speed[0]

    @property
    def acceleration(self) -> Array:
        """Path acceleration, the same at every speed limit, shape (M,); 1 for motions of zero length. [1/s2]"""
        return self.full_speed[1]

    def take_full_speed(self, other: PathTiming, rows: Index | slice) -> None:
        """Take what the search for full speed found for some motions of another timing by the same model."""
        velocity, acceleration = other.full_speed
        self.full_speed = velocity[rows], acceleration[rows]

    @property
    def filter_time_s(self) -> float:
        """Length of a full jerk phase. [s]"""
        return self.robot.drives.filter_time_s

    @property
    def least_cruise_share(self) -> float:
        """Share of a motion's duration that it cruises at least. [-]"""
        return self.robot.drives.least_cruise_share

    @property
    def commanded_velocity(self) -> Array:
        """Path velocity at full speed by the joints' velocity limits alone, shape (M,). [1/s]"""
        return np.asarray(self.full_velocity)

    def acceleration_for(self, torque_limited: Array) -> Array:
        """Path acceleration at full speed, of what torques allow at the peak velocity, each of shape (M,). [1/s2]"""
        return torque_limited

    def acceleration_share(self, speed_limits: Array) -> Array:
        """Share of that acceleration at speed limits of any shape. [-]"""
        return np.ones_like(speed_limits)

    @property
    def dead_time_s(self) -> float:
        """What every motion takes beyond its time law. [s]"""
        return 0.0

    def _duration_at(self, velocity: Array, rows: Index) -> Array:
        acceleration = self.acceleration[rows].reshape(-1, *[1] * (velocity.ndim - 1))
        return duration_at_peak_s(velocity, acceleration, self.robot.drives.filter_time_s)

    def peak_velocities(self, speed_limits: ArrayLike) -> Array:
        """Peak path velocity under speed limits.

        Args:
            speed_limits: Fractions in (0, 1], shape (S,) for all motions or (M, S). [-]

        Returns:
            Shape (M, S); 0 for motions of zero length. [1/s]

        Raises:
            InputError: A speed limit is not in (0, 1].
        """
        limits = self._checked_limits(speed_limits)
        full = np.where(self.moving, self.full_velocity, 0.0)
        return np.asarray(np.minimum(limits * full[:, None], self.fastest_velocity[:, None]))

    def _checked_limits(self, speed_limits: ArrayLike) -> Array:
        limits = np.asarray(speed_limits, dtype=float)
        if not np.all((limits > 0.0) & (limits <= 1.0)):
            raise InputError("a speed limit is out of range", allowed="above 0 and at most 1 (100 %)")
        return np.broadcast_to(limits, (self.motions, limits.shape[-1]))

    def accelerations(self, speed_limits: ArrayLike) -> Array:
        """Path accelerations under speed limits, shapes as in `peak_velocities`. [1/s2]"""
        return np.broadcast_to(self.acceleration[:, None], self._checked_limits(speed_limits).shape)

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
        check_durations(wanted, fastest)
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
        length = float(self.travel_rad[index])
        return path_law(peak_velocity, self.acceleration[index], self.robot.drives.filter_time_s, length_rad=length)

    def laws(self, peak_velocity: Array, rows: Index, acceleration: Array | None = None) -> PathLaw:
        """Time laws of some motions at peak path velocities.

        Args:
            peak_velocity: Peak path velocities, shape (M', S). [1/s]
            rows: Which motions, shape (M',).
            acceleration: Path accelerations, shape (M', S); those that the controller has at these velocities if not
                given. [1/s2]

        Returns:
            The laws, with arrays of shape (M', S, 7).
        """
        if acceleration is None:
            acceleration = np.broadcast_to(self.acceleration[rows, None], peak_velocity.shape)
        return path_law(peak_velocity, acceleration, self.robot.drives.filter_time_s)
