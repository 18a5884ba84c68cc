"""The robot: its mechanism, limits and drives, and what it carries."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, frozen
from robojoule.errors import InputError
from robojoule.robots.drives import DriveParameters
from robojoule.robots.mechanism import Mechanism, assemble
from robojoule.robots.rigid_body import RigidBody
from robojoule.robots.robot_file import RobotFile

PAYLOAD_DENSITY_KG_M3 = 2700.0  # aluminium: density of the sphere that stands for a payload of unknown shape
LIMIT_TOLERANCE_RAD = 1e-9  # rounding of degrees to radians must not push a joint over its limit


@dataclass(frozen=True)
class Payload:
    """What the robot carries; nothing unless said.

    Attributes:
        mass_kg: Mass. [kg]
        com_m: Centre of mass in the tool frame. [m]
        inertia_kg_m2: Inertia about the centre of mass in tool axes, shape (3, 3); a solid aluminium sphere of the
            same mass if not given. [kg m2]
    """

    mass_kg: float = 0.0
    com_m: tuple[float, float, float] = (0.0, 0.0, 0.1)
    inertia_kg_m2: Array | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.mass_kg, Real) or not 0 <= self.mass_kg < float("inf"):
            raise InputError(f"the payload mass {self.mass_kg} is not a mass", allowed="0 kg or more")
        if not np.all(np.isfinite(self.com_m)):
            raise InputError("the payload's centre of mass is not finite")
        if self.inertia_kg_m2 is not None:
            inertia = np.asarray(self.inertia_kg_m2, dtype=float)
            if inertia.shape != (3, 3) or not np.allclose(inertia, inertia.T) or np.linalg.eigvalsh(inertia)[0] < 0:
                raise InputError("the payload's inertia is not a symmetric positive semi-definite 3 x 3 matrix")

    def rotational_inertia_kg_m2(self) -> Array:
        """Inertia about the centre of mass, shape (3, 3). [kg m2]"""
        if self.inertia_kg_m2 is not None:
            return np.asarray(self.inertia_kg_m2, dtype=float)
        radius = (3.0 * self.mass_kg / (4.0 * np.pi * PAYLOAD_DENSITY_KG_M3)) ** (1.0 / 3.0)
        return np.asarray(0.4 * self.mass_kg * radius**2 * np.eye(3))

    @property
    def body(self) -> RigidBody:
        """The payload as a body in the tool frame."""
        return RigidBody(self.mass_kg, np.asarray(self.com_m, dtype=float), self.rotational_inertia_kg_m2())


class Robot:
    """A serial arm that carries a payload.

    Args:
        file: Validated robot file.
        payload: What it carries; nothing if not given.
        source: How messages name the file; by the robot's name if not given.

    Raises:
        InputError: A moving body without usable inertia, or a payload above the rated one.
    """

    def __init__(self, file: RobotFile, payload: Payload | None = None, source: str | None = None) -> None:
        self.file = file
        self.source = source if source is not None else file.name
        self.name = file.name
        self.vendor = file.vendor
        self.payload = payload if payload is not None else Payload()
        file.check_payload(self.payload.mass_kg)
        joints = file.moving_joints
        self.joint_names: tuple[str, ...] = tuple(joint.name for joint in joints)
        self.joint_count = len(joints)
        limits = [(joint.lower_rad, joint.upper_rad, joint.velocity_rad_s, joint.effort_nm) for joint in joints]
        columns = (frozen(column) for column in np.array(limits, dtype=float).T)
        self.lower_rad, self.upper_rad, self.velocity_rad_s, self.effort_nm = columns
        peaks = [joint.peak_effort_nm for joint in joints]
        self.peak_effort_nm = frozen([own or peak for own, peak in zip(peaks, self.effort_nm, strict=True)])
        self.home_rad = frozen(file.home_rad)
        self.drives = _drives(file, self.joint_names)
        self.mechanism = assemble(file, self.source)
        if self.payload.mass_kg > 0:
            self.mechanism = self.mechanism.with_load(self.payload.body)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, {self.joint_count} joints, payload {self.payload.mass_kg:g} kg)"

    @property
    def model(self) -> Any:
        """The arm as a Pinocchio model; see `Mechanism.model`."""
        return self.mechanism.model

    def variant(
        self,
        *,
        drives: DriveParameters | None = None,
        mechanism: Mechanism | None = None,
        peak_effort_nm: Array | None = None,
    ) -> Robot:
        """The robot with other drives, another mechanism or other peak torques, everything else shared."""
        variant = copy.copy(self)
        variant.drives = drives if drives is not None else self.drives
        variant.mechanism = mechanism if mechanism is not None else self.mechanism
        variant.peak_effort_nm = peak_effort_nm if peak_effort_nm is not None else self.peak_effort_nm
        return variant

    def check_configuration(self, q: ArrayLike, where: str = "configuration") -> Array:
        """Check a joint configuration.

        Args:
            q: Joint positions, shape (n,). [rad]
            where: How messages name it.

        Returns:
            The configuration, shape (n,). [rad]

        Raises:
            InputError: Wrong number of joints, not finite, or beyond a joint limit.
        """
        try:
            values = np.asarray(q, dtype=float)
        except (TypeError, ValueError):
            raise InputError("joint positions must be numbers", key=where) from None
        if values.shape != (self.joint_count,):
            raise InputError(
                f"{values.size} joint positions given, but {self.name} has {self.joint_count} joints", key=where
            )
        for name, value, lower, upper in zip(self.joint_names, values, self.lower_rad, self.upper_rad, strict=True):
            if not np.isfinite(value):
                raise InputError(f"{name} is not a finite number", key=where)
            if not lower - LIMIT_TOLERANCE_RAD <= value <= upper + LIMIT_TOLERANCE_RAD:
                raise InputError(
                    f"{name} = {value:.4f} rad ({np.degrees(value):.2f} deg) is beyond its limit",
                    key=where,
                    allowed=f"{lower:.4f} to {upper:.4f} rad ({np.degrees(lower):.2f} to {np.degrees(upper):.2f} deg)",
                )
        return values

    def tool_placements(self, q: ArrayLike) -> tuple[Array, Array]:
        """Forward kinematics of the tool frame.

        Args:
            q: Joint positions, shape (N, n). [rad]

        Returns:
            Positions (N, 3) [m] and orientations (N, 4) as unit quaternions w, x, y, z with w >= 0.
        """
        return self.mechanism.tool_placements(np.atleast_2d(np.asarray(q, dtype=float)))


def _drives(file: RobotFile, joint_names: tuple[str, ...]) -> DriveParameters:
    drives = file.drives
    joints = [drives.joints[name] for name in joint_names]
    return DriveParameters(
        gear_ratio=frozen([joint.gear_ratio for joint in joints]),
        rotor_inertia_kg_m2=frozen([joint.rotor_inertia_kg_m2 for joint in joints]),
        coulomb_nm=frozen([joint.coulomb_nm for joint in joints]),
        viscous_nm_s_per_rad=frozen([joint.viscous_nm_s_per_rad for joint in joints]),
        copper_w_per_nm2=frozen([joint.copper_w_per_nm2 for joint in joints]),
        base_power_w=drives.base_power_w,
        drive_active_power_w=drives.drive_active_power_w,
        inverter_efficiency=drives.inverter_efficiency,
        regeneration_efficiency=drives.regeneration_efficiency,
        torque_use=drives.torque_use,
        torque_floor=drives.torque_floor,
        filter_time_s=drives.filter_time_s,
        least_cruise_share=drives.least_cruise_share,
    )
