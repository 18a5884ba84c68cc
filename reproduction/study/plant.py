"""The plant of a study: a robot that differs from its catalog entry in what a predictor cannot read there.

Drawn from a seed, robot by robot (so that a robot's plant does not change if others are added):

    link inertia      relative errors of mass, centre and extent within +-22 %, each body physical
    drives            friction and copper log-normal round the entry (0.35), base power (0.2), rotor inertia (0.2)
    gear efficiency   load-dependent friction of 2-6 % of the transmitted torque, joint by joint (0 in the entry)
    shear thinning    viscous torque B v (|v| / v_max)^-gamma: friction has another form than the entry's
    temperature       hidden state of each tree: a factor on viscous friction, log-normal (0.22)

All spreads exceed what the predictor expects. The controller's model is the entry: time laws and durations are the
nominal ones. Energies of the plant are integrated with more nodes than the predictor's. Training labels get
multiplicative noise, test labels none.
"""

from __future__ import annotations

import copy
import zlib
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from robojoule.arrays import Array
from robojoule.calibration.inertial import draw_errors
from robojoule.documents import Document
from robojoule.motion.quadrature import RunQuadrature, run_quadrature
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.drives import DriveParameters, DrivePowers
from robojoule.robots.robot import Robot

_FINER = 1.5  # quadrature nodes of the plant over those of the simulation


class PlantParams(Document):
    """How far plants differ from their catalog entries."""

    inertia_spread: float = Field(default=0.22, ge=0, lt=1, description="Largest relative error of link inertia. [-]")
    drive_spread: float = Field(default=0.35, ge=0, description="Log-normal scatter of friction and copper. [-]")
    base_spread: float = Field(default=0.2, ge=0, description="Log-normal scatter of base power and rotors. [-]")
    load_friction: tuple[float, float] = Field(default=(0.02, 0.06), description="Range of load friction. [-]")
    shear_thinning: float = Field(default=0.1, ge=0, lt=1, description="Exponent of the viscous torque. [-]")
    temperature_spread: float = Field(default=0.22, ge=0, description="Log-normal scatter of viscosity by tree. [-]")
    noise: float = Field(default=0.03, ge=0, lt=0.5, description="Relative noise of training energies. [-]")


@dataclass(frozen=True)
class PlantDrives(DriveParameters):
    """Drives whose viscous friction thins with speed.

    Attributes:
        velocity_limit_rad_s: Speeds at which the viscous coefficient holds, shape (n,). [rad/s]
        shear_thinning: Exponent gamma. [-]
    """

    velocity_limit_rad_s: Array | float = 1.0
    shear_thinning: float = 0.0

    def friction_nm(self, direction: Array, velocity_rad_s: Array, load_nm: Array) -> Array:
        """Friction torque; see `DriveParameters.friction_nm`."""
        if self.shear_thinning == 0.0:
            return super().friction_nm(direction, velocity_rad_s, load_nm)
        relative = np.abs(velocity_rad_s) / self.velocity_limit_rad_s
        thinned = np.sign(velocity_rad_s) * self.velocity_limit_rad_s * relative ** (1.0 - self.shear_thinning)
        return super().friction_nm(direction, thinned, load_nm)


@dataclass(frozen=True)
class Plant:
    """A drawn plant.

    Attributes:
        params: Spreads it was drawn with.
        drives: Its drives at mean temperature.
        body_changes: Changes of the bodies' dynamic parameters against the entry, shape (10 n,).
    """

    params: PlantParams
    drives: PlantDrives
    body_changes: Array

    def robot(self, nominal: Robot) -> Robot:
        """The plant with the payload of `nominal`."""
        return nominal.variant(drives=self.drives, mechanism=nominal.mechanism.with_changes(self.body_changes))


def draw_plant(nominal: Robot, seed: np.random.SeedSequence | int, params: PlantParams | None = None) -> Plant:
    """Draw a plant of a robot.

    Args:
        nominal: Catalog entry; its payload plays no part.
        seed: Seed of all plants; the robot's name makes it the robot's own.
        params: Spreads.
    """
    params = params or PlantParams()
    rng = np.random.default_rng(np.random.SeedSequence([_entropy(seed), zlib.crc32(nominal.name.encode())]))
    bare = Robot(nominal.file)
    changes = []
    for body in bare.mechanism.bodies:
        errors = draw_errors(rng, params.inertia_spread)
        changes.append(errors.applied(body).parameters - body.parameters)
    joints = bare.joint_count

    def scattered(value: Array | float, spread: float) -> Array:
        return np.asarray(value * np.exp(spread * rng.standard_normal(np.shape(value))))

    nominal_drives = nominal.drives
    known = {field.name: getattr(nominal_drives, field.name) for field in fields(DriveParameters)}
    known |= {
        "coulomb_nm": scattered(nominal_drives.coulomb_nm, params.drive_spread),
        "viscous_nm_s_per_rad": scattered(nominal_drives.viscous_nm_s_per_rad, params.drive_spread),
        "copper_w_per_nm2": scattered(nominal_drives.copper_w_per_nm2, params.drive_spread),
        "rotor_inertia_kg_m2": scattered(nominal_drives.rotor_inertia_kg_m2, params.base_spread),
        "base_power_w": float(scattered(nominal_drives.base_power_w, params.base_spread)),
        "drive_active_power_w": float(scattered(nominal_drives.drive_active_power_w, params.base_spread)),
        "load_friction": rng.uniform(*params.load_friction, joints),
    }
    drives = PlantDrives(**known, velocity_limit_rad_s=nominal.velocity_rad_s, shear_thinning=params.shear_thinning)
    return Plant(params, drives, np.concatenate(changes))


def _entropy(seed: np.random.SeedSequence | int) -> int:
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    return int(sequence.generate_state(1, np.uint64)[0])


class PlantPaths(MotionPaths):
    """Motions of a plant, each tree at its own temperature, planned by the nominal controller.

    Args:
        plant: The plant.
        nominal: The same motions of the catalog entry.
        tree: Index of the tree of each motion, shape (M,).
        viscosity: Factor on viscous friction of each tree, shape (T,); ones if not given. [-]
    """

    def __init__(
        self,
        plant: Plant,
        nominal: MotionPaths,
        tree: NDArray[np.intp] | None = None,
        viscosity: ArrayLike | None = None,
    ) -> None:
        robot = plant.robot(nominal.robot)
        super().__init__(robot, nominal.start_rad, nominal.start_rad + nominal.delta_rad, controller=nominal.robot)
        self.timing = nominal.timing  # the same, but its searches are done
        self.plant, self.nominal = plant, nominal
        self.tree = np.zeros(self.motions, dtype=np.intp) if tree is None else tree
        factors = np.ones(int(self.tree.max(initial=0)) + 1) if viscosity is None else np.asarray(viscosity)
        self.viscosity = factors
        self._at_temperature: list[MotionPaths] = []
        for factor in factors.tolist():
            drives = replace(plant.drives, viscous_nm_s_per_rad=plant.drives.viscous_nm_s_per_rad * factor)
            warm = copy.copy(self)
            warm.robot = robot.variant(drives=drives)
            self._at_temperature.append(warm)

    def subset(self, rows: NDArray[np.intp] | slice) -> PlantPaths:
        """Some of the motions, each at the temperature of its tree; see `MotionPaths.subset`."""
        return PlantPaths(self.plant, self.nominal.subset(rows), self.tree[rows], self.viscosity)

    def powers(self, rows: NDArray[np.intp], s: Array, s1: Array, s2: Array) -> DrivePowers:
        """Torques and powers; see `MotionPaths.powers`."""
        trees = self.tree[rows]
        results = [
            (at, MotionPaths.powers(self._at_temperature[tree], rows[at], s[at], s1[at], s2[at]))
            for tree in np.unique(trees).tolist()
            for at in [np.flatnonzero(trees == tree)]
        ]
        joined = {}
        for field in fields(DrivePowers):
            pieces = [(at, getattr(power, field.name)) for at, power in results]
            whole = np.empty((len(rows), *pieces[0][1].shape[1:]))
            for at, piece in pieces:
                whole[at] = piece
            joined[field.name] = whole
        return DrivePowers(**joined)

    def _quadrature(self, path_nodes: int) -> RunQuadrature:
        return run_quadrature(int(_FINER * path_nodes))
