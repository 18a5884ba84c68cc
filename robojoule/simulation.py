"""Runs of point-to-point motions: motion + speed limit -> duration, energy, samples.

The controller's rule: the speed limit p in (0, 1] scales the joint velocity limits, hence the peak path velocity
v(p) = p min_j(v_max,j / |dq_j|). The path acceleration a(v) is the largest constant that keeps every joint torque
within `torque_use` of its effort limit at every path node, at standstill and at v (but `torque_floor` of the effort
limit is always left for acceleration), and jerk = a / filter time. As a(v) falls with v, a faster peak need not give a
shorter motion: the controller raises the peak velocity towards v(p) as long as that shortens the motion. Speed limits
above give the same run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.drive import Array, idle_power_w, mains_power_w
from robojoule.dynamics import PathTorques, chebyshev_basis, path_torques
from robojoule.errors import InputError
from robojoule.quadrature import PhaseQuadrature, phase_quadrature
from robojoule.robots.robot import Robot
from robojoule.trajectory import PHASES, PathLaw, duration_at_peak_s, path_law, reachable_velocity

Index = NDArray[np.intp]

DURATION_TOLERANCE_S = 1e-9
_INTEGRALS = ("bus", "drawn", "friction", "copper")
_SEARCH_GRID = np.linspace(0.05, 1.0, 39)
_BISECTIONS = 60
_CHUNK = 64  # motions evaluated at once: keeps the work arrays in the processor's cache


@dataclass(frozen=True)
class MotionRuns:
    """Runs of M motions at S speed limits; all arrays have shape (M, S).

    Attributes:
        speed_limit: Speed limit as a fraction of full speed. [-]
        duration_s: Duration. [s]
        energy_j: Electrical energy drawn from the mains. [J]
        potential_j: Its part that lifts or lowers (change of potential energy; kinetic energy returns to zero). [J]
        friction_j: Its part lost in joint friction. [J]
        copper_j: Its part lost in motor copper. [J]
        braking_j: Its part burnt in the brake chopper. [J]
        inverter_j: Its part lost in the inverter. [J]
        base_j: Its part drawn by the controller. [J]
        drive_active_j: Its part drawn by the drives for being active. [J]
        peak_power_w: Largest mains power at the quadrature nodes. [W]
        peak_torque_ratio: Largest |torque| / effort limit over joints and quadrature nodes. [-]
    """

    speed_limit: Array
    duration_s: Array
    energy_j: Array
    potential_j: Array
    friction_j: Array
    copper_j: Array
    braking_j: Array
    inverter_j: Array
    base_j: Array
    drive_active_j: Array
    peak_power_w: Array
    peak_torque_ratio: Array


@dataclass(frozen=True)
class MotionSamples:
    """Time series of one run, T instants, n joints.

    Attributes:
        time_s: Instants, shape (T,); the last is the end of the run. [s]
        path_position: s, shape (T,). [-]
        path_velocity_per_s: ds/dt, shape (T,). [1/s]
        path_acceleration_per_s2: Second derivative of s, shape (T,). [1/s2]
        path_jerk_per_s3: Third derivative of s, shape (T,). [1/s3]
        torque_nm: Link-side joint torques incl. friction and rotor inertia, shape (T, n). [Nm]
        power_w: Mains power, shape (T,). [W]
    """

    time_s: Array
    path_position: Array
    path_velocity_per_s: Array
    path_acceleration_per_s2: Array
    path_jerk_per_s3: Array
    torque_nm: Array
    power_w: Array


@dataclass(frozen=True)
class PathPowers:
    """Torques and powers at path states, M motions, P states, n joints.

    Attributes:
        torque_nm: Link-side joint torques incl. friction and rotor inertia, shape (M, P, n). [Nm]
        friction_w: Power lost in joint friction, shape (M, P). [W]
        copper_w: Power lost in motor copper, shape (M, P). [W]
        bus_w: Power that the joints take from the DC bus, negative when they feed it, shape (M, P). [W]
    """

    torque_nm: Array
    friction_w: Array
    copper_w: Array
    bus_w: Array


class MotionPaths:
    """Physics along M straight joint-space motions of one robot.

    Motions of zero length are allowed: they take no time and no energy.

    Args:
        robot: Robot with its payload.
        start_rad: Start configurations, shape (M, n). [rad]
        end_rad: End configurations, shape (M, n). [rad]
    """

    def __init__(self, robot: Robot, start_rad: ArrayLike, end_rad: ArrayLike) -> None:
        self.robot = robot
        self.start_rad = np.atleast_2d(np.asarray(start_rad, dtype=float))
        self.delta_rad = np.atleast_2d(np.asarray(end_rad, dtype=float)) - self.start_rad
        self.motions = len(self.start_rad)
        self.travel_rad = np.abs(self.delta_rad).max(axis=1)
        self.moving = self.travel_rad > 0.0
        self.torques: PathTorques = path_torques(robot, self.start_rad, self.delta_rad)
        drives = robot.drives
        sign = np.sign(self.delta_rad)
        self._inertia = self.torques.at_nodes[0] + (drives.reflected_inertia_kg_m2 * self.delta_rad)[:, None, :]
        self._coulomb_nm = drives.coulomb_nm * sign
        self._viscous_nm_s = drives.viscous_nm_s_per_rad * self.delta_rad
        with np.errstate(divide="ignore"):
            self.full_velocity = np.min(robot.velocity_rad_s / np.abs(self.delta_rad), axis=1)

    @property
    def idle_power_start_w(self) -> Array:
        """Idle power at the start of each motion, shape (M,). [W]"""
        return idle_power_w(self.robot.drives, self.torques.at_nodes[2][:, 0])

    @property
    def idle_power_end_w(self) -> Array:
        """Idle power at the end of each motion, shape (M,). [W]"""
        return idle_power_w(self.robot.drives, self.torques.at_nodes[2][:, -1])

    def _acceleration(self, velocity: Array, rows: Index) -> Array:
        """Path acceleration that the drives allow at peak velocities, shapes (M', ...) -> (M', ...). [1/s2]"""
        columns = velocity.reshape(len(velocity), -1).T
        return np.stack([self._acceleration_and_slope(v, rows)[0] for v in columns], axis=-1).reshape(velocity.shape)

    def _acceleration_and_slope(self, velocity: Array, rows: Index) -> tuple[Array, Array]:
        """Allowed path acceleration [1/s2] and its derivative after the peak velocity [1/s], shapes (M',)."""
        drives, effort = self.robot.drives, self.robot.effort_nm
        inertia = np.abs(self._inertia[rows])
        centrifugal, gravity = self.torques.at_nodes[1][rows], self.torques.at_nodes[2][rows]
        viscous = self._viscous_nm_s[rows][:, None, :]
        standing = gravity + self._coulomb_nm[rows][:, None, :]
        v = velocity[:, None, None]
        moving = standing + viscous * v + centrifugal * v**2
        left = drives.torque_use * effort - np.maximum(np.abs(standing), np.abs(moving))
        floor = drives.torque_floor * effort
        with np.errstate(divide="ignore"):  # a joint that does not move sets no limit
            ratio = (np.maximum(left, floor) / inertia).reshape(len(v), -1)
        tightest = ratio.argmin(axis=1)[:, None]

        def there(values: Array) -> Array:
            return np.asarray(np.take_along_axis(values.reshape(len(v), -1), tightest, axis=1)[:, 0])

        falls = there((left > floor) & (np.abs(moving) > np.abs(standing)))
        slope = -there(np.sign(moving) * (2.0 * centrifugal * v + viscous)) / there(inertia)
        return np.asarray(there(ratio)), np.where(falls, slope, 0.0)

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
        top = self._bisect(lambda v: ~self._reachable(v, rows), np.zeros(len(rows)), self.full_velocity[rows])
        low, high = np.zeros_like(top), top.copy()
        open_rows = np.ones(len(rows), dtype=bool)
        for share in _SEARCH_GRID:  # the first stretch of the grid behind which the duration rises again
            v = share * top
            rises = self._duration_slope(v, rows) > 0.0
            low = np.where(open_rows & ~rises, v, low)
            high = np.where(open_rows & rises, v, high)
            open_rows &= ~rises
        fastest[rows] = self._bisect(lambda v: self._duration_slope(v, rows) > 0.0, low, high)
        return fastest

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
        acceleration = self._acceleration(velocity, rows)
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
        return duration_at_peak_s(velocity, self._acceleration(velocity, rows), filter_s)

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

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest speed limits that give at most the requested durations (the inverse of `durations`).

        Args:
            durations_s: Requested durations, shape (M,). [s]

        Returns:
            Speed limits, shape (M,); 1 for motions of zero length. [-]

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
        acceleration = float(self._acceleration(np.array([peak_velocity]), np.array([index]))[0])
        filter_s = self.robot.drives.filter_time_s
        return path_law(float(self.travel_rad[index]), peak_velocity, acceleration, acceleration / filter_s)

    def simulate(self, speed_limits: ArrayLike) -> MotionRuns:
        """Run every motion at speed limits (shapes as in `peak_velocities`)."""
        velocity = self.peak_velocities(speed_limits)
        limits = np.broadcast_to(np.asarray(speed_limits, dtype=float), velocity.shape).copy()
        arrays = {field.name: np.zeros_like(velocity) for field in fields(MotionRuns)}
        arrays["speed_limit"] = limits
        rows = np.flatnonzero(self.moving)
        for first in range(0, len(rows), _CHUNK):
            self._simulate_chunk(rows[first : first + _CHUNK], velocity, arrays)
        return MotionRuns(**arrays)

    def _simulate_chunk(self, rows: Index, velocity: Array, arrays: dict[str, Array]) -> None:
        """Integrate power over each jerk phase by Gauss-Legendre quadrature, for a few motions at all speeds."""
        peak = velocity[rows]
        acceleration = self._acceleration(peak, rows)
        filter_s = self.robot.drives.filter_time_s
        laws = [
            path_law(float(self.travel_rad[m]), float(v), float(a), float(a) / filter_s)
            for m, vs, accelerations in zip(rows, peak, acceleration, strict=True)
            for v, a in zip(vs, accelerations, strict=True)
        ]
        shape = (*peak.shape, PHASES)
        length, jerk, acc, vel, pos = (
            np.array([getattr(law, name) for law in laws]).reshape(shape)
            for name in ("duration_s", "jerk", "acceleration", "velocity", "position")
        )
        integrals: dict[str, Array] = {name: np.zeros(peak.shape) for name in _INTEGRALS}
        peak_bus = np.full(peak.shape, -np.inf)
        peak_ratio = np.zeros(peak.shape)
        for phases, quadrature in self._quadratures:
            tau = length[..., phases, None] * quadrature.nodes
            j, a, v, p = (x[..., phases, None] for x in (jerk, acc, vel, pos))
            s = p + tau * (v + tau * (a / 2 + tau * j / 6))
            s1 = v + tau * (a + tau * j / 2)
            s2 = a + tau * j
            power = self.powers(rows, *(x.reshape(len(rows), -1) for x in (s, s1, s2)))
            bus, friction, copper = (x.reshape(s.shape) for x in (power.bus_w, power.friction_w, power.copper_w))
            time = length[..., phases]
            integrals["bus"] += (quadrature.integral(bus) * time).sum(axis=-1)
            integrals["drawn"] += (quadrature.positive_part(bus) * time).sum(axis=-1)
            integrals["friction"] += (quadrature.integral(friction) * time).sum(axis=-1)
            integrals["copper"] += (quadrature.integral(copper) * time).sum(axis=-1)
            present = time > 0.0
            peak_bus = np.maximum(peak_bus, np.where(present, bus.max(axis=-1), -np.inf).max(axis=-1))
            ratio = np.abs(power.torque_nm / self.robot.effort_nm).max(axis=-1).reshape(s.shape)
            peak_ratio = np.maximum(peak_ratio, np.where(present, ratio.max(axis=-1), 0.0).max(axis=-1))
        parts = self._energy_parts(length.sum(axis=-1), integrals)
        parts["peak_power_w"] = mains_power_w(self.robot.drives, peak_bus)
        parts["peak_torque_ratio"] = peak_ratio
        for name, values in parts.items():
            arrays[name][rows] = values

    @cached_property
    def _quadratures(self) -> list[tuple[list[int], PhaseQuadrature]]:
        """Phases and their quadrature: the cruise may cover the whole path, the others half of it."""
        count = len(self.torques.nodes_s)
        return [
            ([0, 2, 4, 6], phase_quadrature(max(8, count * 2 // 5))),
            ([1, 5], phase_quadrature(max(10, count // 2))),
            ([3], phase_quadrature(count)),
        ]

    def _energy_parts(self, duration_s: Array, integrals: dict[str, Array]) -> dict[str, Array]:
        """Split the mains energy: the parts add up to the total, whatever the regime of the bus."""
        drives = self.robot.drives
        drawn = integrals["drawn"]
        surplus = drawn - integrals["bus"]
        return {
            "duration_s": duration_s,
            "energy_j": (drives.base_power_w + drives.drive_active_power_w) * duration_s
            + drawn / drives.inverter_efficiency
            - drives.regeneration_efficiency * surplus,
            "potential_j": integrals["bus"] - integrals["friction"] - integrals["copper"],
            "friction_j": integrals["friction"],
            "copper_j": integrals["copper"],
            "braking_j": (1.0 - drives.regeneration_efficiency) * surplus,
            "inverter_j": (1.0 / drives.inverter_efficiency - 1.0) * drawn,
            "base_j": drives.base_power_w * duration_s,
            "drive_active_j": drives.drive_active_power_w * duration_s,
        }

    def powers(self, rows: Index, s: Array, s1: Array, s2: Array) -> PathPowers:
        """Torques and powers at path states (s, s', s'') of some motions.

        Args:
            rows: Which motions, shape (M',).
            s: Path positions, shape (M', P). [-]
            s1: Path velocities, shape (M', P). [1/s]
            s2: Path accelerations, shape (M', P). [1/s2]
        """
        drives, torques = self.robot.drives, self.torques
        coefficients = np.concatenate(
            [torques.inertia_nm_s2[rows], torques.velocity_nm_s2[rows], torques.gravity_nm[rows]], axis=2
        )
        basis = chebyshev_basis(s, coefficients.shape[1])
        m, c, g = np.split(np.matmul(basis, coefficients), 3, axis=2)
        delta = self.delta_rad[rows][:, None, :]
        friction = self._coulomb_nm[rows][:, None, :] + self._viscous_nm_s[rows][:, None, :] * s1[..., None]
        inertia = m + drives.reflected_inertia_kg_m2 * delta
        torque = inertia * s2[..., None] + c * (s1**2)[..., None] + g + friction
        friction_w = (friction * delta).sum(axis=2) * s1
        copper_w = torque**2 @ drives.copper_w_per_joint_nm2
        bus_w = (torque * delta).sum(axis=2) * s1 + copper_w
        return PathPowers(torque, friction_w, copper_w, bus_w)

    def sample(self, index: int, speed_limit: float, rate_hz: float = 250.0) -> MotionSamples:
        """Time series of one run at a fixed rate, plus the final instant."""
        velocity = float(self.peak_velocities([speed_limit])[index, 0])
        return self.sample_at(index, velocity, rate_hz)

    def sample_at(self, index: int, peak_velocity: float, rate_hz: float) -> MotionSamples:
        """Time series of one run at a peak path velocity [1/s]; one instant for a motion of zero length."""
        if peak_velocity <= 0.0:  # no length: the robot stands
            still = np.zeros(1)
            torque = self.torques.at_nodes[2][index, :1]
            return MotionSamples(still, still, still, still, still, torque, self.idle_power_start_w[index : index + 1])
        law = self.law(index, peak_velocity)
        steps = int(np.floor(law.total_s * rate_hz * (1.0 - 1e-12)))
        time = np.append(np.arange(steps + 1) / rate_hz, law.total_s)
        state = law.at(time)
        power = self.powers(np.array([index]), state[0][None], state[1][None], state[2][None])
        return MotionSamples(time, *state, power.torque_nm[0], mains_power_w(self.robot.drives, power.bus_w)[0])
