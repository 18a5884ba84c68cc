"""Energy and its derivatives as path integrals over the trajectory generator's own time laws.

The controller's time laws follow from its nominal model alone, so the states (s, s', s'') of a motion at a speed limit
are known before anything of the real drives is. What is drawn from the DC bus is then an integral over them,

    E = (P_base + P_active) d + 1/eta int_D P dt - rho int_{not D} |P| dt ,    P = sum_j tau_j v_j + k_j tau_j^2 ,
    tau_j = l_j + sign(dq_j) (C_j + mu_j |l_j|) + B_j v_j ,                    v_j = dq_j s' ,
    l = (m + J dq) s'' + c s'^2 + g ,                                          m, c, g linear in the inertial figures,

with D = {P > 0}. P vanishes on the edge of D, so the derivative after any parameter is the integral of dP over a fixed
D: friction work, squared torque and link work, weighted with dP/dtau_j = v_j + 2 k_j tau_j. The nodes are weighted as
in the quadrature of the energies, so these are the derivatives of the very energies returned. The inertial ones are
integrated against the Chebyshev basis first and contracted with the link regressors of the path last, so their cost
does not grow with the number of time nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.motion.dynamics import chebyshev_basis
from robojoule.motion.path import Path
from robojoule.motion.quadrature import run_quadrature
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.time_laws import path_law
from robojoule.robots.drives import DriveParameters
from robojoule.robots.recursion import path_regressors
from robojoule.robots.rigid_body import BODY_PARAMETERS
from robojoule.robots.robot import Robot

_CHUNK = 160  # runs evaluated at once: keeps the work arrays in the processor's cache


@dataclass(frozen=True)
class EnergyGradient:
    """Derivatives of energies, R of them (any leading shape), n joints, r inertial directions.

    Attributes:
        base: After base power [J/W]; for idle power [-].
        active: After drive-active power [J/W]; for idle power [-].
        inverse_efficiency: After 1 / inverter efficiency. [J] or [W]
        coulomb: After Coulomb friction, shape (..., n). [J/Nm]
        viscous: After viscous friction, shape (..., n). [J rad/(Nm s)]
        load_friction: After load friction, shape (..., n). [J]
        copper: After copper loss per squared joint torque, shape (..., n). [J Nm2/W]
        rotor: After reflected rotor inertia, shape (..., n). [J/(kg m2)]
        inertial: After the coordinates of the inertial directions, shape (..., r). [J]
    """

    base: Array
    active: Array
    inverse_efficiency: Array
    coulomb: Array
    viscous: Array
    load_friction: Array
    copper: Array
    rotor: Array
    inertial: Array


@dataclass(frozen=True)
class EnergyIntegrals:
    """Energies of M motions at S speed limits and idle power at both ends of each.

    Attributes:
        energy_j: Shape (M, S); zero for motions of zero length. [J]
        idle_w: Idle power at start and end, shape (M, 2). [W]
        energy_gradient: Leading shape (M, S); None if not asked for.
        idle_gradient: Leading shape (M, 2); None if not asked for.
    """

    energy_j: Array
    idle_w: Array
    energy_gradient: EnergyGradient | None
    idle_gradient: EnergyGradient | None

    def gradients(self) -> tuple[EnergyGradient, EnergyGradient]:
        """Derivatives of energies and idle powers.

        Raises:
            ValueError: They were not asked for.
        """
        if self.energy_gradient is None or self.idle_gradient is None:
            raise ValueError("the derivatives were not integrated")
        return self.energy_gradient, self.idle_gradient


class PathIntegrals:
    """Path integrals of M motions at S speed limits.

    Args:
        paths: Motions of the nominal robot, planned by the nominal controller.
        speed_limits: Fractions in (0, 1], shape (S,) or (M, S). [-]
        directions: Changes of the bodies' parameters for a unit of each inertial coordinate, shape (10 n, r); see
            `robojoule.calibration.inertial`.
    """

    def __init__(self, paths: MotionPaths, speed_limits: Array, directions: Array) -> None:
        self.robot: Robot = paths.robot
        self.delta_rad = paths.delta_rad
        self.moving = paths.moving
        self.rows = np.flatnonzero(self.moving)
        self.directions = directions
        timing = paths.timing
        self.filter_s = timing.robot.drives.filter_time_s
        self.peak_velocity = timing.peak_velocities(speed_limits)
        self.acceleration = np.ones_like(self.peak_velocity)
        if self.rows.size:
            self.acceleration[self.rows] = timing.acceleration(self.peak_velocity[self.rows], self.rows)
        self.duration_s = timing.durations(speed_limits)
        torques = paths.torques
        self.counts = torques.counts
        self.coefficients = np.concatenate([torques.inertia_nm_s2, torques.velocity_nm_s2, torques.gravity_nm], axis=2)
        self.regressors = link_regressors(self.robot, paths.path, torques.nodes_s, directions)

    def evaluate(
        self, drives: DriveParameters, inertial: Array, viscosity: Array | None = None, *, gradient: bool = False
    ) -> EnergyIntegrals:
        """Evaluate the integrals.

        Args:
            drives: Drive parameters of the plant.
            inertial: Coordinates of the inertial directions, shape (r,). [-]
            viscosity: Factor on viscous friction of each motion, shape (M,); ones if not given. [-]
            gradient: Whether to integrate the derivatives too.
        """
        motions, speeds = self.peak_velocity.shape
        joints = self.delta_rad.shape[1]
        factor = np.ones(motions) if viscosity is None else np.asarray(viscosity, dtype=float)
        coefficients = self.coefficients + self.regressors @ inertial
        energy = np.zeros((motions, speeds))
        names = {"coulomb": joints, "viscous": joints, "load_friction": joints, "copper": joints, "rotor": joints}
        parts = {name: np.zeros((motions, speeds, width)) for name, width in names.items()} if gradient else {}
        drawn = np.zeros((motions, speeds))
        moments = np.zeros((motions if gradient else 0, speeds, len(inertial)))
        for rows in self._chunks(max(1, _CHUNK // speeds)):
            count = int(self.counts[rows[0]])
            bus, positive, weights = self._integrate(rows, coefficients[rows, :count], drives, factor[rows], parts)
            power = drives.base_power_w + drives.drive_active_power_w
            energy[rows] = power * self.duration_s[rows] + positive / drives.inverter_efficiency
            energy[rows] -= drives.regeneration_efficiency * (positive - bus)
            drawn[rows] = positive
            if gradient and len(inertial):
                regressors = self.regressors[rows, :count].reshape(len(rows), -1, len(inertial))
                moments[rows] = weights.reshape(len(rows), speeds, -1) @ regressors
        gradients: list[EnergyGradient | None] = [None, None]
        idle, idle_gradient = self._idle(coefficients, drives, gradient=gradient)
        if gradient:
            gradients = [
                EnergyGradient(
                    base=self.duration_s, active=self.duration_s, inverse_efficiency=drawn, inertial=moments, **parts
                ),
                idle_gradient,
            ]
        return EnergyIntegrals(energy, idle, *gradients)

    def _chunks(self, size: int) -> Iterator[Index]:
        """Motions of as many path nodes, a few at once."""
        for count in np.unique(self.counts[self.rows]):
            rows = self.rows[self.counts[self.rows] == count]
            for first in range(0, len(rows), size):
                yield rows[first : first + size]

    def _integrate(
        self, rows: Index, coefficients: Array, drives: DriveParameters, viscosity: Array, parts: dict[str, Array]
    ) -> tuple[Array, Array, Array]:
        """Integrals of bus power and its positive part (M', S); the derivatives are written into `parts`.

        Also returns the integrals of dP/dl times (s'', s'^2, 1) times the basis, shape (M', S, K, 3 n).
        """
        law = path_law(self.peak_velocity[rows], self.acceleration[rows], self.filter_s)
        motions, speeds = law.duration_s.shape[:2]
        count, joints = coefficients.shape[1], self.delta_rad.shape[1]
        delta = self.delta_rad[rows][:, None, :]
        direction = np.sign(delta)
        copper = drives.copper_w_per_joint_nm2
        reflected = drives.reflected_inertia_kg_m2 * delta
        viscous = drives.viscous_nm_s_per_rad * viscosity[:, None, None]
        load_friction = np.broadcast_to(np.asarray(drives.load_friction, dtype=float), (joints,))
        quadrature = run_quadrature(count)
        s, s1, s2 = (x.reshape(motions, -1, 1) for x in quadrature.states(law))
        basis = chebyshev_basis(s[..., 0], count)
        m, c, g = np.split(np.matmul(basis, coefficients), 3, axis=2)
        load = (m + reflected) * s2 + c * s1**2 + g
        speed = delta * s1
        torque = load + direction * (drives.coulomb_nm + load_friction * np.abs(load)) + viscous * speed
        bus = ((torque * speed).sum(axis=2) + torque**2 @ copper).reshape(motions, speeds, -1)
        time = quadrature.weights(law)
        bus_total = (bus * time).sum(axis=-1)
        if not parts:
            return bus_total, quadrature.positive_part(bus, law), np.zeros(0)
        drawing = quadrature.positive_weights(bus, law)
        drawn = (bus * drawing).sum(axis=-1)
        regained = drives.regeneration_efficiency
        weight = (regained * time + (1.0 / drives.inverter_efficiency - regained) * drawing).reshape(motions, -1, 1)
        after_torque = weight * (speed + 2.0 * copper * torque)
        after_load = after_torque * (1.0 + load_friction * direction * np.sign(load))
        terms = {
            "coulomb": after_torque * direction,
            "viscous": after_torque * speed * viscosity[:, None, None],
            "load_friction": after_torque * direction * np.abs(load),
            "copper": weight * torque**2,
            "rotor": after_load * delta * s2,
        }
        for name, values in terms.items():
            parts[name][rows] = values.reshape(motions, speeds, -1, joints).sum(axis=2)
        moments = np.concatenate([after_load * s2, after_load * s1**2, after_load], axis=2)
        moments = moments.reshape(motions, speeds, -1, 3 * joints)
        weights = np.matmul(np.swapaxes(basis.reshape(motions, speeds, -1, count), 2, 3), moments)
        return bus_total, drawn, weights

    def _idle(
        self, coefficients: Array, drives: DriveParameters, *, gradient: bool
    ) -> tuple[Array, EnergyGradient | None]:
        """Idle power at both ends and its derivatives, leading shape (M, 2)."""
        joints = self.delta_rad.shape[1]
        ends = chebyshev_basis(np.array([0.0, 1.0]), coefficients.shape[1])  # (2, K)
        gravity = np.einsum("ek,mkj->mej", ends, coefficients[..., 2 * joints :])
        copper = drives.copper_w_per_joint_nm2
        losses = gravity**2 @ copper
        idle = np.asarray(drives.base_power_w + losses / drives.inverter_efficiency)
        if not gradient:
            return idle, None
        none = np.zeros_like(gravity)
        regressors = np.einsum("ek,mkjr->mejr", ends, self.regressors[:, :, 2 * joints :])
        along = 2.0 * gravity * copper / drives.inverter_efficiency
        return idle, EnergyGradient(
            base=np.ones_like(idle),
            active=np.zeros_like(idle),
            inverse_efficiency=losses,
            coulomb=none,
            viscous=none,
            load_friction=none,
            copper=gravity**2 / drives.inverter_efficiency,
            rotor=none,
            inertial=np.einsum("mej,mejr->mer", along, regressors),
        )


def link_regressors(robot: Robot, path: Path, nodes_s: Array, directions: Array) -> Array:
    """Chebyshev coefficients of m, c and g for a unit of each inertial direction.

    Args:
        robot: Robot; its kinematics matter only.
        path: M paths.
        nodes_s: Path positions of the nodes, shape (K,). [-]
        directions: Shape (10 n, r).

    Returns:
        Shape (M, K, 3 n, r).

    Raises:
        InputError: The directions are not those of a robot with as many joints.
    """
    motions, joints = path.start_rad.shape
    count, width = len(nodes_s), directions.shape[1]
    if len(directions) != BODY_PARAMETERS * joints:
        raise InputError(
            f"the predictor knows {len(directions) // BODY_PARAMETERS} bodies, but {robot.name} has {joints}"
        )
    rows = slice(None)
    at = path.positions_rad(rows, nodes_s)
    along = np.broadcast_to(path.slopes_rad(rows, nodes_s).swapaxes(0, 1), at.shape)
    values = path_regressors(robot.mechanism, at.reshape(joints, -1), along.reshape(joints, -1), directions)
    series = values.reshape(-1, count) @ np.linalg.inv(chebyshev_basis(nodes_s, count)).T
    return np.ascontiguousarray(series.reshape(3 * joints, width, motions, count).transpose(2, 3, 0, 1))
