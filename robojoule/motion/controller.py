"""The controller's rule: speed limit -> time law of a motion along a joint-space path.

The speed limit p in (0, 1] scales the joint velocity limits, hence the peak path velocity
v(p) = p min_j(v_max,j / |q'_j|) with the steepest slopes q'_j. The path acceleration a(v) is the largest constant that
keeps every joint torque within `torque_use` of its effort limit at every path node, at standstill and at v (but
`torque_floor` of the effort limit is always left for acceleration), and jerk = a / filter time. As a(v) falls with v, a
faster peak need not give a shorter motion: the controller raises the peak velocity towards v(p) as long as that
shortens the motion and the torques of steady motion (gravity, friction, centrifugal) leave `torque_floor` within the
effort limits. Speed limits above give the same run.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.motion.dynamics import PathTorques
from robojoule.motion.path import Path
from robojoule.motion.time_laws import (
    ROUNDING,
    PathLaw,
    duration_at_peak_s,
    path_law,
    reachable_velocity,
)
from robojoule.motion.torque_limits import NEVER_BINDS, TorqueLimits, first_reached
from robojoule.robots.robot import Robot

DURATION_TOLERANCE_S = 1e-9
_SEARCH_GRID = np.linspace(0.2, 1.0, 5)
_BISECTIONS = (4, 6, 28)
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

    def acceleration(self, velocity: Array, rows: Index) -> Array:
        """Path acceleration that the drives allow at peak velocities, shapes (M', ...) -> (M', ...). [1/s2]

        Velocities beyond what is reached on the path are not asked for.
        """
        limits = self._limits[0].of(rows)
        columns = velocity.reshape(len(velocity), -1).T
        return np.stack([limits.acceleration(v) for v in columns], axis=-1).reshape(velocity.shape)

    @cached_property
    def _limits(self) -> tuple[TorqueLimits, Array]:
        """Torque limits that can bind below the highest peak velocities, and these, shape (M,). [1/s]

        The highest peak velocity is the one that the joints' speeds allow, the path lets reach, and with which the
        torques of steady motion leave the floor within the effort limits of all joints. Where gravity and Coulomb
        friction alone exceed that, a lower velocity would not help.
        """
        top = np.where(self.moving, self.full_velocity, 0.0)
        parts = []
        for first in range(0, max(self.motions, 1), _BLOCK):
            block = slice(first, first + _BLOCK)
            parts.append(self._binding_limits(block, top[block]))
        return TorqueLimits.joined(parts), top

    def _binding_limits(self, block: slice, top: Array) -> TorqueLimits:
        """Limits of a block of motions that can bind up to the velocities `top` (M',) [1/s], which it lowers."""
        drives, effort = self.robot.drives, self.robot.effort_nm[:, None]
        inertia, centrifugal, gravity = np.split(self.torques.values[block], 3, axis=1)
        slope = self.path.slopes_rad(block, self.torques.values_s[block])

        def limits(values: Array) -> Array:
            return np.broadcast_to(values, gravity.shape).reshape(len(top), -1)

        every = TorqueLimits(
            inertia=np.maximum(np.abs(limits(inertia + drives.reflected_inertia_kg_m2[:, None] * slope)), NEVER_BINDS),
            standing=limits(gravity + drives.coulomb_nm[:, None] * np.sign(slope)),
            viscous=limits(drives.viscous_nm_s_per_rad[:, None] * slope),
            centrifugal=limits(centrifugal),
            usable=limits(drives.torque_use * effort),
            floor=limits(drives.torque_floor * effort),
        )
        none = np.zeros(len(top))
        np.minimum(top, reachable_velocity(every.acceleration(none), drives.filter_time_s), out=top)
        lowest, highest = every.steady_bounds(none, top)
        room = limits((1.0 - drives.torque_floor) * effort)
        near = np.flatnonzero((np.maximum(highest, -lowest) > room).any(axis=1))
        if near.size:
            top[near] = np.minimum(top[near], first_reached(every.of(near), room[near]).min(axis=1))
        return every.binding(lowest, highest)

    @cached_property
    def fastest_velocity(self) -> Array:
        """Peak path velocity at full speed, shape (M,); 0 for motions of zero length. [1/s]

        The controller raises the peak velocity towards the limit as long as that shortens the motion.
        """
        fastest = np.zeros(self.motions)
        rows = np.flatnonzero(self.moving)
        if rows.size == 0:
            return fastest
        limits, top = self._limits[0].of(rows), self._limits[1][rows]
        candidates = top[:, None] * _SEARCH_GRID
        low, high = self._first_beyond(candidates, limits)
        # Until a limit falls to its floor, the duration by it alone falls and then rises; behind, it may fall again. A
        # rise that is too narrow for the grid therefore ends where a limit falls to its floor.
        floors = first_reached(limits, limits.usable - limits.floor)
        below = floors < top[:, None]
        floored = np.flatnonzero(below.any(axis=1))
        if floored.size:
            most = int(below.sum(axis=1).max())
            narrow = np.minimum(np.sort(floors[floored], axis=1)[:, :most] * (1.0 - ROUNDING), top[floored, None])
            both = np.sort(np.concatenate([candidates[floored], narrow], axis=1), axis=1)
            low[floored], high[floored] = self._first_beyond(both, limits.of(floored))
        for steps in _BISECTIONS:  # the narrower the bracket, the fewer limits can bind in it
            limits = limits.binding(*limits.steady_bounds(low, high))
            for _ in range(steps):
                middle = (low + high) / 2.0
                beyond = self._beyond(middle, limits)
                low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        fastest[rows] = low
        return fastest

    def _first_beyond(self, candidates: Array, limits: TorqueLimits) -> tuple[Array, Array]:
        """Neighbouring candidates (M', C) [1/s] with the first one beyond the fastest; the last two where none is."""
        low, high = np.zeros(len(candidates)), candidates[:, -1].copy()
        open_rows = np.ones(len(candidates), dtype=bool)
        for v in candidates.T:
            beyond = self._beyond(v, limits)
            low = np.where(open_rows & ~beyond, v, low)
            high = np.where(open_rows & beyond, v, high)
            open_rows &= ~beyond
        return low, high

    def _beyond(self, velocity: Array, limits: TorqueLimits) -> NDArray[np.bool_]:
        """Whether a higher peak velocity makes the motion longer, or this one is not reached on the path."""
        filter_s = self.robot.drives.filter_time_s
        a, slope = limits.acceleration_and_slope(velocity)
        plateau = velocity >= a * filter_s
        root = np.sqrt(filter_s / (velocity * a))
        ramp = np.where(plateau, velocity / a + filter_s, 2.0 * velocity * root)
        after_velocity = np.where(plateau, (1.0 - velocity * slope / a) / a, (1.0 - velocity * slope / a) * root)
        return np.asarray((after_velocity > 1.0 / velocity**2) | (velocity * ramp > 1.0), dtype=np.bool_)

    def _duration_at(self, velocity: Array, rows: Index) -> Array:
        return duration_at_peak_s(velocity, self.acceleration(velocity, rows), self.robot.drives.filter_time_s)

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
        acceleration = float(self.acceleration(np.array([peak_velocity]), np.array([index]))[0])
        length = float(self.travel_rad[index])
        return path_law(peak_velocity, acceleration, self.robot.drives.filter_time_s, length_rad=length)

    def laws(self, peak_velocity: Array, rows: Index) -> PathLaw:
        """Time laws of some motions at peak path velocities.

        Args:
            peak_velocity: Peak path velocities, shape (M', S). [1/s]
            rows: Which motions, shape (M',).

        Returns:
            The laws, with arrays of shape (M', S, 7).
        """
        return path_law(peak_velocity, self.acceleration(peak_velocity, rows), self.robot.drives.filter_time_s)
