"""The unknowns of a plant as one vector: log-ratios to the nominal entry and coordinates of inertial directions.

    0              log base power
    1              log drive-active power
    2              log 1 / inverter efficiency
    3 .. 3 + 5 n   logs of Coulomb, viscous, copper, rotor inertia, load friction, joint by joint
    3 + 5 n ..     coordinates of the inertial directions (already of unit variance)

A log-ratio keeps what must be positive positive, and is what scaling laws err by from arm to arm.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.motion.path_integrals import EnergyGradient
from robojoule.robots.drives import DriveParameters

JOINT_GROUPS = ("coulomb", "viscous", "copper", "rotor", "load_friction")
GLOBALS = ("base", "active", "efficiency")
# Where the entry gives no load friction: the few per cent by which cycloidal and harmonic gears miss full efficiency.
TYPICAL_LOAD_FRICTION = 0.03
PRIOR_SPREAD = {
    "base": 0.15,
    "active": 0.15,
    "efficiency": 0.01,
    "coulomb": 0.3,
    "viscous": 0.3,
    "copper": 0.3,
    "rotor": 0.12,
    "load_friction": 0.7,
    "inertial": 1.0,
}


@dataclass(frozen=True)
class Prior:
    """Gaussian belief about the unknowns, p of them.

    Attributes:
        mean: Shape (p,). [-]
        covariance: Shape (p, p). [-]
    """

    mean: Array
    covariance: Array


class Unknowns:
    """Unknowns of one robot.

    Args:
        nominal: Drives of the catalog entry.
        directions: Inertial directions, shape (10 n, r).
    """

    def __init__(self, nominal: DriveParameters, directions: Array) -> None:
        joints = len(nominal.gear_ratio)
        load_friction = np.broadcast_to(np.asarray(nominal.load_friction, dtype=float), (joints,))
        self.nominal = replace(
            nominal, load_friction=np.where(load_friction > 0.0, load_friction, TYPICAL_LOAD_FRICTION)
        )
        self.joints = joints
        self.directions = directions
        self.size = len(GLOBALS) + len(JOINT_GROUPS) * joints + directions.shape[1]

    def part(self, name: str) -> slice:
        """Where a group stands: one of `GLOBALS`, `JOINT_GROUPS` or "inertial"."""
        if name in GLOBALS:
            return slice(GLOBALS.index(name), GLOBALS.index(name) + 1)
        first = len(GLOBALS) + self.joints * len(JOINT_GROUPS)
        if name == "inertial":
            return slice(first, self.size)
        first = len(GLOBALS) + self.joints * JOINT_GROUPS.index(name)
        return slice(first, first + self.joints)

    def prior(self) -> Prior:
        """What is expected of a plant of which only the entry is known."""
        spread = np.zeros(self.size)
        for name, value in PRIOR_SPREAD.items():
            spread[self.part(name)] = value
        return Prior(np.zeros(self.size), np.diag(spread**2))

    def drives(self, x: Array) -> DriveParameters:
        """Drives with these unknowns, shape (p,)."""
        nominal = self.nominal
        factor = {name: np.exp(x[self.part(name)]) for name in (*GLOBALS, *JOINT_GROUPS)}
        return replace(
            nominal,
            base_power_w=nominal.base_power_w * float(factor["base"][0]),
            drive_active_power_w=nominal.drive_active_power_w * float(factor["active"][0]),
            inverter_efficiency=nominal.inverter_efficiency / float(factor["efficiency"][0]),
            coulomb_nm=nominal.coulomb_nm * factor["coulomb"],
            viscous_nm_s_per_rad=nominal.viscous_nm_s_per_rad * factor["viscous"],
            copper_w_per_nm2=nominal.copper_w_per_nm2 * factor["copper"],
            rotor_inertia_kg_m2=nominal.rotor_inertia_kg_m2 * factor["rotor"],
            load_friction=np.asarray(nominal.load_friction) * factor["load_friction"],
        )

    def expected(self, x: Array, covariance: Array) -> Array:
        """Unknowns whose exponentials are the expected parameters: the mean of a log-normal exceeds its median.

        Energy is nearly linear in the parameters themselves, so a plan of least expected energy follows from these.
        """
        shift = np.diag(covariance) / 2.0
        shift[self.part("inertial")] = 0.0
        return np.asarray(x + shift)

    def inertial(self, x: Array) -> Array:
        """Coordinates of the inertial directions, shape (r,)."""
        return np.asarray(x[self.part("inertial")])

    def chain(self, gradient: EnergyGradient, drives: DriveParameters) -> Array:
        """Derivatives after the unknowns, shape (..., p), from those after the physical parameters."""
        return np.concatenate(
            [
                (gradient.base * drives.base_power_w)[..., None],
                (gradient.active * drives.drive_active_power_w)[..., None],
                (gradient.inverse_efficiency / drives.inverter_efficiency)[..., None],
                gradient.coulomb * drives.coulomb_nm,
                gradient.viscous * drives.viscous_nm_s_per_rad,
                gradient.copper * drives.copper_w_per_joint_nm2,
                gradient.rotor * drives.reflected_inertia_kg_m2,
                gradient.load_friction * drives.load_friction,
                gradient.inertial,
            ],
            axis=-1,
        )

    def arrays(self) -> dict[str, Array]:
        """The entry as plain arrays, to be stored with what was learned relative to it."""
        values = {field.name: getattr(self.nominal, field.name) for field in fields(DriveParameters)}
        return {name: np.atleast_1d(np.asarray(value, dtype=float)) for name, value in values.items()}

    def check(self, stored: dict[str, Array], robot: str) -> None:
        """Refuse what was learned relative to another entry.

        Raises:
            InputError: The robot's drives are not those stored.
        """
        for name, value in self.arrays().items():
            if stored[name].shape != value.shape or not np.allclose(stored[name], value, rtol=1e-9, atol=0.0):
                raise InputError(
                    f"the predictor was fitted to another entry of {robot}: its {name} differ; fit it again", key=name
                )
