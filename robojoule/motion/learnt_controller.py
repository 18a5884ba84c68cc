"""Time laws by a controller whose timing was learnt on the machine (`robojoule.robots.controller_file`).

A motion at speed limit p has the path acceleration and the commanded path velocity

    a(p) = a_1 p^k ,    v(p) = min(p min_j V_j / |q'_j|, highest v with v T_a(v) <= (1 - c) / (1 + c)) ,

with c the least share of cruise and a_1 either the torque-limited acceleration of `robojoule.motion.controller` times
a factor or min_j A_j / |q'_j|. It takes the duration of that law plus a dead time, in which the arm stands.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.motion.controller import PathTiming
from robojoule.motion.dynamics import PathTorques
from robojoule.motion.inverse import limits_for
from robojoule.motion.path import Path
from robojoule.motion.time_laws import PathLaw, duration_at_peak_s, path_law, reachable_velocity
from robojoule.robots.controller_file import ControllerTiming
from robojoule.robots.robot import Robot

_BISECTIONS = 60


def reached_velocity(velocity: ArrayLike, acceleration: ArrayLike, filter_time_s: ArrayLike, share: float) -> Array:
    """Peak path velocities of commanded ones. [1/s]

    Args:
        velocity: Commanded path velocities. [1/s]
        acceleration: Path accelerations, shapes that broadcast. [1/s2]
        filter_time_s: Length of a full jerk phase. [s]
        share: Least share of cruise. [-]
    """
    return np.minimum(velocity, reachable_velocity(acceleration, filter_time_s, (1.0 - share) / (1.0 + share)))


class LearntPathTiming(PathTiming):
    """Time laws of M motions by learnt figures; what is not overridden holds for every controller.

    Args:
        robot: The controller's model of the robot and its payload, with its nominal limits.
        torques: Path torques of that model along the motions.
        path: The motions' paths.
        controller: The learnt figures.
    """

    def __init__(self, robot: Robot, torques: PathTorques, path: Path, controller: ControllerTiming) -> None:
        super().__init__(robot, torques, path)
        self.controller = controller
        self._commanded = least_ratio(controller.velocity_rad_s, path.steepest_rad)

    @cached_property
    def _first(self) -> Array:
        """Path acceleration at full speed, shape (M,); 1 for motions of zero length. [1/s2]"""
        if self.controller.acceleration_rad_s2 is None:
            return self.acceleration_for(self.full_speed[1])
        return self.acceleration_for(np.ones(self.motions))

    @property
    def least_cruise_share(self) -> float:
        """Share of a motion's duration that it cruises at least. [-]"""
        return self.controller.least_cruise_share

    @property
    def commanded_velocity(self) -> Array:
        """Path velocity at full speed by the joints' velocity limits alone, shape (M,). [1/s]"""
        return self._commanded

    def acceleration_for(self, torque_limited: Array) -> Array:
        """Path acceleration at full speed; see `PathTiming.acceleration_for`. [1/s2]"""
        limits = self.controller.acceleration_rad_s2
        if limits is None:
            return np.asarray(self.controller.acceleration_factor * torque_limited)
        return np.where(self.moving, least_ratio(limits, self.path.steepest_rad), 1.0)

    def acceleration_share(self, speed_limits: Array) -> Array:
        """Share of that acceleration at speed limits of any shape. [-]"""
        return np.asarray(speed_limits**self.controller.acceleration_exponent)

    def take_full_speed(self, other: PathTiming, rows: Index | slice) -> None:
        """Take what a search for full speed has found; see `PathTiming.take_full_speed`."""
        if self.controller.acceleration_rad_s2 is None:
            super().take_full_speed(other, rows)

    @property
    def filter_time_s(self) -> float:
        """Length of a full jerk phase. [s]"""
        return self.controller.filter_time_s

    @cached_property
    def dead_time_s(self) -> float:
        """What every motion takes beyond its time law. [s]

        Raises:
            InputError: It is so far below zero that a motion would take no time.
        """
        dead_s, rows = self.controller.dead_time_s, self.moving
        if dead_s < 0.0 and rows.any():
            velocity, acceleration = self.fastest_velocity[rows], self._first[rows]
            least_s = float(duration_at_peak_s(velocity, acceleration, self.filter_time_s).min())
            if least_s + dead_s <= 0.0:
                raise InputError(
                    f"a motion of {least_s:.3g} s would take {least_s + dead_s:.3g} s with a dead time of {dead_s:g} s",
                    key="controller.dead_time_s",
                    allowed=f"more than {-least_s:.3g} s for these motions",
                )
        return dead_s

    @property
    def acceleration(self) -> Array:
        """Path acceleration at full speed, shape (M,); 1 for motions of zero length. [1/s2]"""
        return self._first

    @property
    def fastest_velocity(self) -> Array:
        """Peak path velocity at full speed, shape (M,); 0 for motions of zero length. [1/s]"""
        return np.asarray(self.peak_velocities(np.ones(1))[:, 0])

    def accelerations(self, speed_limits: ArrayLike) -> Array:
        """Path accelerations under speed limits, shapes as in `peak_velocities`. [1/s2]"""
        limits = self._checked_limits(speed_limits)
        return np.asarray(self._first[:, None] * limits**self.controller.acceleration_exponent)

    def peak_velocities(self, speed_limits: ArrayLike) -> Array:
        """Peak path velocities; see `PathTiming.peak_velocities`. [1/s]"""
        limits, controller = self._checked_limits(speed_limits), self.controller
        commanded = limits * np.where(self.moving, self._commanded, 0.0)[:, None]
        accelerations = self.accelerations(limits)
        return reached_velocity(commanded, accelerations, controller.filter_time_s, controller.least_cruise_share)

    def durations(self, speed_limits: ArrayLike) -> Array:
        """Durations under speed limits with the dead time; see `PathTiming.durations`. [s]"""
        velocity, acceleration = self.peak_velocities(speed_limits), self.accelerations(speed_limits)
        result = np.zeros_like(velocity)
        rows = self.moving
        result[rows] = duration_at_peak_s(velocity[rows], acceleration[rows], self.filter_time_s)
        result[rows] += self.dead_time_s
        return result

    def fastest_speed_limits(self) -> Array:
        """Lowest speed limits that give the fastest runs, shape (M,); 1 for motions of zero length. [-]"""
        limits = np.ones(self.motions)
        if self.controller.acceleration_exponent > 0.0:  # a higher limit always gives a higher acceleration
            return limits
        rows = self.moving
        limits[rows] = np.minimum(self.fastest_velocity[rows] / self._commanded[rows], 1.0)
        return limits

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest speed limits that give at most the requested durations; see `PathTiming`. [-]"""
        return limits_for(self.durations, durations_s, self.minimum_durations(), self.moving)

    def law(self, index: int, peak_velocity: float) -> PathLaw:
        """Time law of motion `index` at a peak path velocity [1/s], without the dead time."""
        limit = self.speed_limit_at(index, peak_velocity)
        acceleration = float(self._first[index] * limit**self.controller.acceleration_exponent)
        return path_law(peak_velocity, acceleration, self.filter_time_s, length_rad=float(self.travel_rad[index]))

    def speed_limit_at(self, index: int, peak_velocity: float) -> float:
        """Lowest speed limit at which motion `index` reaches a peak path velocity [1/s]. [-]"""
        low, high = 0.0, 1.0
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            reached = self.peak_velocities(np.array([middle]))[index, 0] >= peak_velocity * (1.0 - 1e-12)
            low, high = (low, middle) if reached else (middle, high)
        return high

    def laws(self, peak_velocity: Array, rows: Index, acceleration: Array | None = None) -> PathLaw:
        """Time laws of some motions at peak path velocities and accelerations; see `PathTiming.laws`."""
        if acceleration is None:
            limits = [
                [self.speed_limit_at(int(row), float(v)) for v in values]
                for row, values in zip(np.arange(self.motions)[rows], peak_velocity, strict=True)
            ]
            acceleration = self._first[rows, None] * np.array(limits) ** self.controller.acceleration_exponent
        return path_law(peak_velocity, acceleration, self.filter_time_s)


def path_timing(robot: Robot, torques: PathTorques, path: Path, like: PathTiming | None = None) -> PathTiming:
    """The timing of a controller: learnt where the robot's file holds that, else from its drives.

    Args:
        robot: The controller's model of the robot and its payload.
        torques: Path torques of that model along the motions.
        path: The motions' paths.
        like: Timing of other motions, whose learnt figures are taken if it has some.
    """
    controller = like.controller if isinstance(like, LearntPathTiming) else robot.controller
    if controller is None:
        return PathTiming(robot, torques, path)
    return LearntPathTiming(robot, torques, path, controller)


def least_ratio(limits: Array, steepest_rad: Array) -> Array:
    """Least limit over steepest slope of each motion, shape (M,)."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.min(limits / steepest_rad, axis=1))
