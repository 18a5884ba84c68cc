"""Runs of a machine or plant, and their energies as a function of what is unknown about it.

The unknowns are log-ratios to the nominal entry of base power, drive-active power, the reciprocal of the inverter
efficiency and, joint by joint, Coulomb, viscous, copper, rotor inertia and load friction, and behind them coordinates
of the inertial directions. A log-ratio keeps what must be positive positive, and is what scaling laws err by from arm
to arm. Energies are path integrals (`robojoule.motion.path_integrals`) over the nominal controller's time laws.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array, Mask
from robojoule.calibration.inertial import inertial_directions
from robojoule.calibration.parameters import LOG_RATIO, LOG_RECIPROCAL, ParameterVector, group
from robojoule.motion.path_integrals import INERTIAL, PathIntegrals
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.drives import DriveParameters
from robojoule.robots.robot import Robot

# Where the entry gives no load friction: the few per cent by which cycloidal and harmonic gears miss full efficiency.
TYPICAL_LOAD_FRICTION = 0.03
INERTIAL_DIRECTIONS = 16
INERTIA_SPREAD = 0.15  # largest relative error expected of published link inertia
# Log-normal spread of each figure of a machine round its catalog entry, in the order of the vector.
PRIOR_SPREAD = {
    "base_power_w": 0.15,
    "drive_active_power_w": 0.15,
    "inverter_efficiency": 0.01,
    "coulomb_nm": 0.3,
    "viscous_nm_s_per_rad": 0.3,
    "copper_w_per_nm2": 0.3,
    "rotor_inertia_kg_m2": 0.12,
    "load_friction": 0.7,
}


def body_directions(robot: Robot) -> Array:
    """Inertial directions of a robot whatever it carries, shape (10 n, r)."""
    return inertial_directions(robot, INERTIAL_DIRECTIONS, INERTIA_SPREAD)


def run_parameters(nominal: DriveParameters, directions: Array) -> ParameterVector:
    """What runs may tell of a machine, starting from its entry; scales are what entries err by.

    Args:
        nominal: Drives of the catalog entry.
        directions: Inertial directions, shape (10 n, r).
    """
    load_friction = np.broadcast_to(np.asarray(nominal.load_friction, dtype=float), nominal.gear_ratio.shape)
    drives = replace(nominal, load_friction=np.where(load_friction > 0.0, load_friction, TYPICAL_LOAD_FRICTION))
    groups = [
        group(
            drives,
            figure,
            LOG_RECIPROCAL if figure == "inverter_efficiency" else LOG_RATIO,
            spread,
            unit=getattr(drives, figure),
        )
        for figure, spread in PRIOR_SPREAD.items()
    ]
    return ParameterVector(drives, tuple(groups), directions.shape[1])


def expected_entries(vector: ParameterVector, x: Array, covariance: Array) -> Array:
    """Entries whose exponentials are the expected figures: the mean of a log-normal exceeds its median.

    Energy is nearly linear in the figures themselves, so a plan of least expected energy follows from these.
    """
    shift = np.diag(covariance) / 2.0
    shift[vector.part(INERTIAL)] = 0.0
    return np.asarray(x + shift)


@dataclass(frozen=True)
class ObservedRuns:
    """Runs of one robot with one payload whose energies are known: measured on a machine, or simulated for a plant.

    Attributes:
        paths: The motions as the nominal entry plans them.
        speed_limits: Fractions in (0, 1], shape (S,) or (M, S). [-]
        energy_j: Energies, shape (M, S); NaN where nothing was observed. [J]
        idle_w: Idle power at start and end, shape (M, 2); NaN where nothing was observed. [W]
        tree: Number of the tree of each motion, the same over payloads only for one and the same tree, shape (M,).
    """

    paths: MotionPaths
    speed_limits: Array
    energy_j: Array
    idle_w: Array
    tree: NDArray[np.intp]

    def only(self, rows: Mask) -> ObservedRuns:
        """The same with nothing observed of the other motions."""
        keep = rows[:, None]
        return replace(self, energy_j=np.where(keep, self.energy_j, np.nan), idle_w=np.where(keep, self.idle_w, np.nan))

    def thinned(self, runs_per_motion: int) -> ObservedRuns:
        """The same with fewer runs of each motion: spread over the speed limits, shifted from motion to motion."""
        count = self.energy_j.shape[1]
        if runs_per_motion >= count:
            return self
        spread = np.arange(runs_per_motion) * count // runs_per_motion
        chosen = np.sort((spread + np.arange(len(self.energy_j))[:, None]) % count, axis=1)
        limits = np.broadcast_to(self.speed_limits, self.energy_j.shape)
        return replace(
            self,
            speed_limits=np.take_along_axis(limits, chosen, axis=1),
            energy_j=np.take_along_axis(self.energy_j, chosen, axis=1),
        )

    def distinct(self) -> ObservedRuns:
        """The same with repetitions of one run left out: higher speed limits that change nothing."""
        durations = self.paths.durations(self.speed_limits)
        repeated = np.zeros(durations.shape, dtype=bool)
        repeated[:, 1:] = np.abs(np.diff(durations, axis=1)) < 1e-9
        return replace(self, energy_j=np.where(repeated, np.nan, self.energy_j))

    def integrals(self, directions: Array) -> PathIntegrals:
        """Path integrals of the runs; directions of shape (10 n, r)."""
        return PathIntegrals(self.paths, self.speed_limits, directions)


@dataclass(frozen=True)
class RunEvaluation:
    """Modelled energies and idle powers of M motions at S speed limits, P parameters.

    Attributes:
        energy_j: Shape (M, S). [J]
        idle_w: Shape (M, 2). [W]
        energy_jacobian: Derivatives of the energies after the entries, shape (M, S, P).
        idle_jacobian: Those of the idle powers, shape (M, 2, P).
    """

    energy_j: Array
    idle_w: Array
    energy_jacobian: Array
    idle_jacobian: Array


def evaluate_runs(
    vector: ParameterVector, integrals: PathIntegrals, x: Array, viscosity: Array | None = None
) -> RunEvaluation:
    """Evaluate the model.

    Args:
        vector: What the parameters are, see `run_parameters`.
        integrals: Path integrals of the runs.
        x: Parameters, shape (P,).
        viscosity: Factor on viscous friction of each motion, shape (M,); ones if not given. [-]
    """
    found = integrals.evaluate(vector.drives(x), vector.inertial(x), viscosity, gradient=True)
    jacobians = (vector.chain(gradient, x) for gradient in (found.energy_gradient, found.idle_gradient))
    return RunEvaluation(found.energy_j, found.idle_w, *jacobians)
