"""Energy and its derivatives as path integrals over the trajectory generator's own time laws.

The controller's time laws follow from its nominal model alone, so the states (s, s', s'') of a motion at a speed limit
are known before anything of the real drives is. What is drawn from the DC bus by the law of `robojoule.robots.drives`
is then an integral over them,

    E = (P_base + P_active) d + 1/eta int_D P dt - rho int_{not D} |P| dt ,
    v = dq s' ,  l = (m + J dq) s'' + c s'^2 + g ,    m, c, g linear in the inertial figures,

with P the bus power of velocities v and transmitted torques l, and D = {P > 0}. P vanishes on the edge of D, so the
derivative after any parameter is the integral of dP over a fixed D. The nodes are weighted as in the quadrature of the
energies, so these are the derivatives of the very energies returned. The inertial ones are integrated against the
Chebyshev basis first and contracted with the link regressors of the path last, so their cost does not grow with the
number of time nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.motion.dynamics import chebyshev_basis
from robojoule.motion.path import Path
from robojoule.motion.quadrature import run_quadrature
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.time_laws import path_law
from robojoule.robots.drives import (
    DriveParameters,
    Gradient,
    bus_gradient,
    drive_powers,
    idle_power_w,
    mains_energy_j,
    mains_gradient,
    mains_weight,
)
from robojoule.robots.recursion import path_regressors
from robojoule.robots.rigid_body import BODY_PARAMETERS
from robojoule.robots.robot import Robot

_CHUNK = 160  # runs evaluated at once: keeps the work arrays in the processor's cache
INERTIAL = "inertial"  # where a gradient holds the derivatives after the coordinates of inertial directions
_OF_JOINTS = ("coulomb_nm", "viscous_nm_s_per_rad", "load_friction", "copper_w_per_nm2", "rotor_inertia_kg_m2")


@dataclass(frozen=True)
class EnergyIntegrals:
    """Energies of M motions at S speed limits and idle power at both ends of each.

    Attributes:
        energy_j: Shape (M, S); zero for motions of zero length. [J]
        idle_w: Idle power at start and end, shape (M, 2). [W]
        energy_gradient: Derivatives of the energies after the figures of the drives, shapes (M, S) or (M, S, n), and
            after the inertial coordinates under `INERTIAL`, shape (M, S, r); empty if not asked for.
        idle_gradient: Those of the idle powers, likewise, (M, 2) in place of (M, S).
    """

    energy_j: Array
    idle_w: Array
    energy_gradient: Gradient
    idle_gradient: Gradient


class PathIntegrals:
    """Path integrals of M motions at S speed limits.

    Args:
        paths: Motions of the nominal robot, planned by the nominal controller.
        speed_limits: Fractions in (0, 1], shape (S,) or (M, S). [-]
        directions: Changes of the bodies' parameters for a unit of each inertial coordinate, shape (10 n, r); see
            `robojoule.calibration.inertial`.
        like: Integrals of the same motions at other speed limits or by another controller, whose regressors are taken.
    """

    def __init__(
        self, paths: MotionPaths, speed_limits: Array, directions: Array, like: PathIntegrals | None = None
    ) -> None:
        self.robot: Robot = paths.robot
        self.delta_rad = paths.delta_rad
        self.moving = paths.moving
        self.rows = np.flatnonzero(self.moving)
        self.directions = directions
        timing = paths.timing
        self.filter_s = timing.filter_time_s
        self.peak_velocity = timing.peak_velocities(speed_limits)
        self.acceleration = timing.accelerations(speed_limits)
        self.duration_s = timing.durations(speed_limits)
        self.dead_s = timing.dead_time_s * self.moving[:, None]  # in which the arm stands at the end of a motion
        torques = paths.torques
        self.counts = torques.counts
        self.coefficients = np.concatenate([torques.inertia_nm_s2, torques.velocity_nm_s2, torques.gravity_nm], axis=2)
        self.regressors: Array = (
            like.regressors
            if like is not None
            else link_regressors(self.robot, paths.path, torques.nodes_s, directions)
        )

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
        factor = np.ones(motions) if viscosity is None else np.asarray(viscosity, dtype=float)
        coefficients = self.coefficients + self.regressors @ inertial
        bus, drawn = np.zeros((2, motions, speeds))
        parts = {name: np.zeros((motions, speeds, self.delta_rad.shape[1])) for name in _OF_JOINTS if gradient}
        moments = np.zeros((motions if gradient else 0, speeds, len(inertial)))
        for rows in self._chunks(max(1, _CHUNK // speeds)):
            count = int(self.counts[rows[0]])
            bus[rows], drawn[rows], weights = self._integrate(
                rows, coefficients[rows, :count], drives, factor[rows, None, None], parts
            )
            if gradient and len(inertial):
                regressors = self.regressors[rows, :count].reshape(len(rows), -1, len(inertial))
                moments[rows] = weights.reshape(len(rows), speeds, -1) @ regressors
        active_s = self.duration_s - self.dead_s
        energy = mains_energy_j(drives, active_s, drawn, bus)
        if gradient:
            parts |= mains_gradient(drives, active_s, drawn, bus) | {INERTIAL: moments}
        idle, idle_gradient = self._idle(coefficients, drives, gradient=gradient)
        if self.dead_s.any():
            energy += self.dead_s * idle[:, 1:]
            for name, along in parts.items():
                along += self.dead_s.reshape(motions, *[1] * (along.ndim - 1)) * idle_gradient[name][:, 1:]
        return EnergyIntegrals(energy, idle, parts, idle_gradient)

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

        Viscosity has shape (M', 1, 1). Also returns the integrals of dP/dl times (s'', s'^2, 1) times the basis, shape
        (M', S, K, 3 n).
        """
        law = path_law(self.peak_velocity[rows], self.acceleration[rows], self.filter_s)
        motions, speeds = law.duration_s.shape[:2]
        count, joints = coefficients.shape[1], self.delta_rad.shape[1]
        delta = self.delta_rad[rows][:, None, :]
        quadrature = run_quadrature(count)
        s, s1, s2 = (x.reshape(motions, -1, 1) for x in quadrature.states(law))
        basis = chebyshev_basis(s[..., 0], count)
        m, c, g = np.split(np.matmul(basis, coefficients), 3, axis=2)
        load = (m + drives.reflected_inertia_kg_m2 * delta) * s2 + c * s1**2 + g
        states = np.sign(delta), delta * s1, load
        warm = replace(drives, viscous_nm_s_per_rad=drives.viscous_nm_s_per_rad * viscosity)
        powers = drive_powers(warm, *states)
        bus = powers.bus_w.reshape(motions, speeds, -1)
        time = quadrature.weights(law)
        bus_total = (bus * time).sum(axis=-1)
        if not parts:
            return bus_total, quadrature.positive_part(bus, law), np.zeros(0)
        drawing = quadrature.positive_weights(bus, law)
        weight = mains_weight(drives, time, drawing).reshape(motions, -1, 1)
        terms, after_load = bus_gradient(warm, *states, powers.torque_nm, weight)
        terms["viscous_nm_s_per_rad"] *= viscosity
        terms["rotor_inertia_kg_m2"] = after_load * (drives.gear_ratio**2 * delta) * s2
        for name in _OF_JOINTS:
            parts[name][rows] = terms[name].reshape(motions, speeds, -1, joints).sum(axis=2)
        moments = np.concatenate([after_load * s2, after_load * s1**2, after_load], axis=2)
        moments = moments.reshape(motions, speeds, -1, 3 * joints)
        weights = np.matmul(np.swapaxes(basis.reshape(motions, speeds, -1, count), 2, 3), moments)
        return bus_total, (bus * drawing).sum(axis=-1), weights

    def _idle(self, coefficients: Array, drives: DriveParameters, *, gradient: bool) -> tuple[Array, Gradient]:
        """Idle power at both ends and its derivatives, leading shape (M, 2)."""
        joints = self.delta_rad.shape[1]
        ends = chebyshev_basis(np.array([0.0, 1.0]), coefficients.shape[1])  # (2, K)
        gravity = np.einsum("ek,mkj->mej", ends, coefficients[..., 2 * joints :])
        idle = idle_power_w(drives, gravity)
        if not gradient:
            return idle, {}
        still = np.zeros_like(gravity)
        weight = mains_weight(drives, 1.0, np.ones((*idle.shape, 1)))
        of_joints, along = bus_gradient(drives, still, still, gravity, gravity, weight)
        losses = gravity**2 @ drives.copper_w_per_joint_nm2
        regressors = np.einsum("ek,mkjr->mejr", ends, self.regressors[:, :, 2 * joints :])
        shared = mains_gradient(drives, np.ones_like(idle), losses, losses, active=0.0)
        inertial = np.einsum("mej,mejr->mer", along, regressors)
        return idle, shared | of_joints | {"rotor_inertia_kg_m2": still, INERTIAL: inertial}


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
