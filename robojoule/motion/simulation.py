"""Runs of point-to-point motions: motion + speed limit -> duration, energy, samples.

A run follows the controller's time law (see `robojoule.motion.controller`) and draws electrical power by the drive
model (see `robojoule.robots.drives`) from the torques along its path (see `robojoule.motion.dynamics`). Its energy is
integrated over each phase of constant jerk (see `robojoule.motion.quadrature`), so it does not depend on a sample
rate. Inverse dynamics and time laws come from the library's own engines unless others are asked for.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index
from robojoule.motion.controller import PathTiming
from robojoule.motion.dynamics import DynamicsEngine, PathTorques, chebyshev_basis, path_torques
from robojoule.motion.learnt_controller import LearntPathTiming, path_timing
from robojoule.motion.path import Path, StraightPath
from robojoule.motion.quadrature import RunQuadrature, run_quadrature
from robojoule.motion.time_laws import LawEngine, PathLaw, path_law
from robojoule.robots.controller_file import ControllerTiming
from robojoule.robots.drives import DrivePowers, drive_powers, idle_power_w, mains_energy_j, mains_power_w
from robojoule.robots.robot import Robot

_BLOCK_RUNS = 4096  # runs integrated at once: bounds memory
_CHUNK_STATES = 8192  # path states evaluated at once: keeps the work arrays in the processor's cache
# The C library of Linux keeps freed memory only up to twice the size of the largest array that it has seen freed.
# Without one of this size, never touched, work arrays are mapped anew for every chunk, and `python -m
# benchmarks.simulation` takes a fifth longer at ten speed limits, two fifths at 91.
np.empty(4_000_000)


@dataclass(frozen=True)
class Engines:
    """What computes the physics of motions; all agree to rounding, and the own ones are the fastest.

    Attributes:
        inverse_dynamics: Pinocchio or the recursion along paths.
        time_laws: Ruckig or the closed form.
    """

    inverse_dynamics: DynamicsEngine = "recursion"
    time_laws: LawEngine = "closed_form"


OWN_ENGINES = Engines()


@dataclass(frozen=True)
class MotionRuns:
    """Runs of M motions at S speed limits; arrays have shape (M, S) unless stated.

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
        peak_torque_ratio: Largest |torque| / peak torque limit over joints and quadrature nodes. [-]
        torque_square_integral_nm2_s: Integral of each joint's squared torque over the run, shape (M, S, n). [Nm2 s]
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
    torque_square_integral_nm2_s: Array


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


class MotionPaths:
    """Physics of M motions of one robot, each along one smooth joint-space path.

    That is a straight line, or else a piece of a blended motion (`robojoule.motion.blends`).

    Motions of zero length are allowed: they take no time and no energy.

    Args:
        robot: Robot with its payload, as it is.
        start_rad: Start configurations, shape (M, n). [rad]
        end_rad: End configurations, shape (M, n). [rad]
        controller: The controller's model of the robot, by which it plans its time laws; the robot itself if not given.
        engines: What computes inverse dynamics and the time laws of runs.

    Raises:
        MissingPackage: Pinocchio is asked for and not installed.
    """

    def __init__(
        self,
        robot: Robot,
        start_rad: ArrayLike,
        end_rad: ArrayLike,
        controller: Robot | None = None,
        engines: Engines = OWN_ENGINES,
    ) -> None:
        self._follow(robot, StraightPath.between(start_rad, end_rad), controller, engines)

    @classmethod
    def along(
        cls, robot: Robot, path: Path, controller: Robot | None = None, engines: Engines = OWN_ENGINES
    ) -> MotionPaths:
        """Motions along paths of any kind."""
        made = cls.__new__(cls)
        made._follow(robot, path, controller, engines)
        return made

    def _follow(self, robot: Robot, path: Path, controller: Robot | None, engines: Engines) -> None:
        self.robot = robot
        self.engines = engines
        self.path: Path = path
        self.start_rad, self.delta_rad = self.path.start_rad, self.path.delta_rad
        self.motions = len(self.start_rad)
        engine = engines.inverse_dynamics
        self.torques: PathTorques = path_torques(robot, self.path, engine=engine)
        planned = self.torques if controller is None else path_torques(controller, self.path, engine=engine)
        self.timing: PathTiming = path_timing(controller or robot, planned, self.path)
        self.moving = self.timing.moving

    def subset(self, rows: Index | slice) -> MotionPaths:
        """Some of the motions, in the order given, with the search for their fastest runs already done."""
        start, path = self.start_rad[rows], self.path.of(rows)
        if isinstance(path, StraightPath):  # through its ends, so that results keep their last digits
            path = StraightPath.between(start, start + self.delta_rad[rows])
        controller = None if self.timing.robot is self.robot else self.timing.robot
        part = MotionPaths.along(self.robot, path, controller, self.engines)
        part.timing = path_timing(part.timing.robot, part.timing.torques, path, self.timing)
        part.timing.take_full_speed(self.timing, rows)
        return part

    def known(self, rows: Index | slice) -> MotionPaths:
        """Some of the motions with their torques as they are, by the controller of the robot that plans them."""
        part = copy.copy(self)
        part.path, part.torques = self.path.of(rows), self.torques.of(rows)
        part.start_rad, part.delta_rad = part.path.start_rad, part.path.delta_rad
        part.motions = len(part.start_rad)
        planned = part.torques if self.timing.torques is self.torques else self.timing.torques.of(rows)
        part.timing = path_timing(self.timing.robot, planned, part.path, self.timing)
        part.moving = part.timing.moving
        return part

    def with_controller(self, controller: ControllerTiming) -> MotionPaths:
        """The same motions by a controller of other timing; torques are shared, and so is the search for full speed."""
        other = copy.copy(self)
        other.timing = LearntPathTiming(self.timing.robot, self.timing.torques, self.path, controller)
        other.timing.take_full_speed(self.timing, slice(None))
        return other

    @property
    def standing_torque_nm(self) -> tuple[Array, Array]:
        """Gravity torques at the start and at the end of each motion, each of shape (M, n). [Nm]"""
        gravity = self.torques.at_nodes[2]
        return gravity[:, 0], gravity[:, -1]

    @property
    def idle_power_start_w(self) -> Array:
        """Idle power at the start of each motion, shape (M,). [W]"""
        return idle_power_w(self.robot.drives, self.torques.at_nodes[2][:, 0])

    @property
    def idle_power_end_w(self) -> Array:
        """Idle power at the end of each motion, shape (M,). [W]"""
        return idle_power_w(self.robot.drives, self.torques.at_nodes[2][:, -1])

    def peak_velocities(self, speed_limits: ArrayLike) -> Array:
        """Peak path velocities; see `PathTiming.peak_velocities`. [1/s]"""
        return self.timing.peak_velocities(speed_limits)

    def durations(self, speed_limits: ArrayLike) -> Array:
        """Durations; see `PathTiming.durations`. [s]"""
        return self.timing.durations(speed_limits)

    def minimum_durations(self) -> Array:
        """Durations at full speed, shape (M,). [s]"""
        return self.timing.minimum_durations()

    def fastest_speed_limits(self) -> Array:
        """Lowest speed limits that give the fastest runs, shape (M,); 1 for motions of zero length. [-]"""
        return self.timing.fastest_speed_limits()

    def kinks(self) -> list[Array]:
        """See `robojoule.motion.motions.Motions`: a single line ends where its law would change. [-]"""
        return [np.zeros(0)] * self.motions

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest sufficient speed limits; see `PathTiming.speed_limits_for_durations`. [-]"""
        return self.timing.speed_limits_for_durations(durations_s)

    def law(self, index: int, peak_velocity: float) -> PathLaw:
        """Time law of motion `index` at a peak path velocity [1/s]."""
        return self.timing.law(index, peak_velocity)

    def laws(self, peak_velocity: Array, rows: Index, acceleration: Array | None = None) -> PathLaw:
        """Time laws of moving motions `rows` (M',) at peak path velocities (M', S) [1/s], arrays of shape (M', S, 7).

        Accelerations (M', S) [1/s2] are those that the controller has at these velocities if not given.

        Raises:
            MissingPackage: Ruckig is asked for and not installed.
        """
        timing = self.timing
        if self.engines.time_laws == "closed_form":
            return timing.laws(peak_velocity, rows, acceleration)
        if acceleration is None:
            acceleration = np.broadcast_to(timing.acceleration[rows, None], peak_velocity.shape)
        return path_law(
            peak_velocity,
            acceleration,
            timing.filter_time_s,
            length_rad=timing.travel_rad[rows, None],
            engine=self.engines.time_laws,
        )

    def simulate(self, speed_limits: ArrayLike) -> MotionRuns:
        """Run every motion at speed limits (shapes as in `peak_velocities`)."""
        velocity, acceleration = self.peak_velocities(speed_limits), self.timing.accelerations(speed_limits)
        limits = np.broadcast_to(np.asarray(speed_limits, dtype=float), velocity.shape).copy()
        arrays = self.runs_by(limits, lambda rows: self.laws(velocity[rows], rows, acceleration[rows]))
        if self.timing.dead_time_s != 0.0:
            self.add_dead_time(arrays)
        return MotionRuns(**arrays)

    def simulate_moves(self, move_limits: Array) -> MotionRuns:
        """Run every motion, which is a move each, at speed limits of shape (M, S)."""
        return self.simulate(move_limits)

    def power_samples(self, motion: int, move_limits: Array, rate_hz: float) -> MotionSamples:
        """Time series of one motion at speed limits of all moves, shape (M,); see `sample`."""
        return self.sample(motion, float(move_limits[motion]), rate_hz)

    def runs_by(self, speed_limits: Array, law_of: Callable[[Index], PathLaw]) -> dict[str, Array]:
        """Figures of runs by given time laws, without dead times: the fields of `MotionRuns` by their names.

        Args:
            speed_limits: Shape (M, S). [-]
            law_of: Laws of some moving motions (M'), arrays of shape (M', S, 7).
        """
        arrays = {field.name: np.zeros_like(speed_limits) for field in fields(MotionRuns)}
        arrays["speed_limit"] = speed_limits
        arrays["torque_square_integral_nm2_s"] = np.zeros((*speed_limits.shape, self.robot.joint_count))
        counts = self.torques.counts
        for count in np.unique(counts[self.moving]):
            rows = np.flatnonzero(self.moving & (counts == count))
            block = max(1, _BLOCK_RUNS // speed_limits.shape[1])
            for first in range(0, len(rows), block):
                part = rows[first : first + block]
                for name, values in self._runs(part, law_of(part), self._quadrature(int(count))).items():
                    arrays[name][part] = values
        return arrays

    def add_dead_time(self, arrays: dict[str, Array]) -> None:
        """Add what motions stand beyond their time laws, at the power of standing where they end."""
        drives, dead = self.robot.drives, self.timing.dead_time_s * self.moving[:, None]
        torque = self.torques.at_nodes[2][:, -1]
        copper = torque**2 @ drives.copper_w_per_joint_nm2
        arrays["duration_s"] += dead
        arrays["energy_j"] += dead * self.idle_power_end_w[:, None]
        arrays["base_j"] += dead * drives.base_power_w
        arrays["copper_j"] += dead * copper[:, None]
        arrays["inverter_j"] += dead * (1.0 / drives.inverter_efficiency - 1.0) * copper[:, None]
        arrays["torque_square_integral_nm2_s"] += dead[..., None] * torque[:, None] ** 2

    def _runs(self, rows: Index, law: PathLaw, quadrature: RunQuadrature) -> dict[str, Array]:
        """Figures of the runs of some motions (M',) by their laws: power integrated over them, shapes (M', S)."""
        states, weights = quadrature.states(law), quadrature.weights(law)
        bus, friction, copper = np.empty((3, *weights.shape))
        peak_torque, squared = np.empty((2, len(rows), self.robot.joint_count, law.duration_s.shape[1]))
        chunk = max(1, _CHUNK_STATES // weights[0].size)
        for first in range(0, len(rows), chunk):
            part = slice(first, first + chunk)
            power = self.powers(rows[part], *(x[part].reshape(len(rows[part]), -1) for x in states))
            shape = bus[part].shape
            bus[part], friction[part] = power.bus_w.reshape(shape), power.friction_w.reshape(shape)
            copper[part] = power.copper_w.reshape(shape)
            magnitude = np.abs(power.torque_nm.swapaxes(1, 2), out=power.torque_nm.swapaxes(1, 2))
            by_run = magnitude.reshape(len(magnitude), -1, *shape[1:])
            peak_torque[part] = by_run.max(axis=-1)
            squared[part] = np.einsum("mjsq,mjsq,msq->mjs", by_run, by_run, weights[part])
        integrals = {
            "bus": np.einsum("msq,msq->ms", bus, weights),
            "drawn": quadrature.positive_part(bus, law),
            "friction": np.einsum("msq,msq->ms", friction, weights),
            "copper": np.einsum("msq,msq->ms", copper, weights),
        }
        return {
            **self._energy_parts(law.duration_s.sum(axis=-1), integrals),
            "peak_power_w": mains_power_w(self.robot.drives, bus.max(axis=-1)),
            "peak_torque_ratio": (peak_torque / self.robot.peak_effort_nm[:, None]).max(axis=1),
            "torque_square_integral_nm2_s": squared.swapaxes(1, 2),
        }

    def _quadrature(self, path_nodes: int) -> RunQuadrature:
        """Quadrature for motions with a number of path nodes."""
        return run_quadrature(path_nodes)

    def _energy_parts(self, duration_s: Array, integrals: dict[str, Array]) -> dict[str, Array]:
        """Split the mains energy: the parts add up to the total, whatever the regime of the bus."""
        drives = self.robot.drives
        drawn = integrals["drawn"]
        surplus = drawn - integrals["bus"]
        return {
            "duration_s": duration_s,
            "energy_j": mains_energy_j(drives, duration_s, drawn, integrals["bus"]),
            "potential_j": integrals["bus"] - integrals["friction"] - integrals["copper"],
            "friction_j": integrals["friction"],
            "copper_j": integrals["copper"],
            "braking_j": (1.0 - drives.regeneration_efficiency) * surplus,
            "inverter_j": (1.0 / drives.inverter_efficiency - 1.0) * drawn,
            "base_j": drives.base_power_w * duration_s,
            "drive_active_j": drives.drive_active_power_w * duration_s,
        }

    def powers(self, rows: Index, s: Array, s1: Array, s2: Array) -> DrivePowers:
        """Torques and powers at path states (s, s', s'') of some motions.

        Args:
            rows: Which motions, shape (M',).
            s: Path positions, shape (M', P). [-]
            s1: Path velocities, shape (M', P). [1/s]
            s2: Path accelerations, shape (M', P). [1/s2]
        """
        drives, torques = self.robot.drives, self.torques
        count, joints = int(torques.counts[rows].max(initial=1)), self.robot.joint_count
        slope, turning = self.path.slopes_rad(rows, s), self.path.slope_series_rad(rows)
        coefficients = torques.coefficients[rows, :, :count]
        coefficients[:, :joints, : turning.shape[2]] += drives.reflected_inertia_kg_m2[:, None] * turning
        if self.path.degree > 1:
            bending = self.path.curvature_series_rad(rows)
            rotors = drives.reflected_inertia_kg_m2[:, None] * bending
            coefficients[:, joints : 2 * joints, : bending.shape[2]] += rotors
        series = np.matmul(coefficients, chebyshev_basis(s, count).swapaxes(1, 2))
        # Arrays of shape (M', n, P) keep states side by side; the law reads them as views of shape (M', P, n).
        load, centrifugal, gravity = (series[:, k * joints : (k + 1) * joints] for k in range(3))
        load *= s2[:, None]
        centrifugal *= (s1**2)[:, None]
        load += centrifugal
        load += gravity
        direction = np.sign(self.delta_rad[rows])[:, :, None]
        return drive_powers(drives, *(x.swapaxes(1, 2) for x in (direction, slope * s1[:, None], load)))

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
