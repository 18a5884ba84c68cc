"""The robot: its mechanism, limits and drives, and what it carries."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, as_array, frozen
from robojoule.errors import InputError
from robojoule.inputs import counted, real, shown
from robojoule.robots.controller_file import ControllerTiming
from robojoule.robots.drives import DriveParameters, Supply
from robojoule.robots.mechanism import Mechanism, assemble
from robojoule.robots.rigid_body import RigidBody
from robojoule.robots.robot_file import RobotFile
from robojoule.robots.standby import StandbyMode

if TYPE_CHECKING:
    from robojoule.robots.plausibility import Doubt

PAYLOAD_DENSITY_KG_M3 = 2700.0  # aluminium: density of the sphere that stands for a payload of unknown shape
FARTHEST_M = 10.0  # of a payload's centre of mass from the flange: beyond it the unit is wrong
LARGEST_INERTIA_KG_M2 = 1e6
LIMIT_TOLERANCE_RAD = 1e-9  # rounding of degrees to radians must not push a joint over its limit


@dataclass(frozen=True)
class Payload:
    """What the robot carries; nothing unless said.

    Attributes:
        mass_kg: Mass. [kg]
        com_m: Centre of mass in the tool frame. [m]
        inertia_kg_m2: Inertia about the centre of mass in tool axes: shape (3, 3), or xx, yy, zz, or these and xy, xz,
            yz; kept as 3 tuples; a solid aluminium sphere of the same mass if not given. [kg m2]
    """

    mass_kg: float = 0.0
    com_m: tuple[float, float, float] = (0.0, 0.0, 0.1)
    inertia_kg_m2: ArrayLike | None = None

    def __post_init__(self) -> None:
        mass = real(self.mass_kg)
        if not 0.0 <= mass < math.inf:
            problem = f"{shown(self.mass_kg)} is not a valid payload mass"
            raise InputError(problem, key="payload", allowed="0 kg or more")
        center = as_array(self.com_m, "payload", "the coordinates of its centre of mass")
        if center.shape != (3,) or not (np.abs(center) <= FARTHEST_M).all():
            problem = f"{shown(self.com_m)} is not a valid centre of mass"
            raise InputError(problem, key="payload", allowed=f"three numbers from {-FARTHEST_M:g} to {FARTHEST_M:g} m")
        object.__setattr__(self, "mass_kg", mass)
        object.__setattr__(self, "com_m", tuple(center.tolist()))
        if self.inertia_kg_m2 is None:
            return
        inertia = as_array(self.inertia_kg_m2, "payload", "the entries of its inertia")
        if inertia.shape in ((3,), (6,)):
            xx, yy, zz, xy, xz, yz = np.append(inertia, np.zeros(6 - inertia.size))
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if inertia.shape != (3, 3) or not _is_inertia(inertia):
            problem = "the inertia is not that of a body: a symmetric positive semi-definite 3 x 3 matrix"
            allowed = f"3, 6 or 3 x 3 numbers up to {LARGEST_INERTIA_KG_M2:g} kg m2"
            raise InputError(problem, key="payload", allowed=allowed)
        object.__setattr__(self, "inertia_kg_m2", tuple(map(tuple, inertia.tolist())))

    def rotational_inertia_kg_m2(self) -> Array:
        """Inertia about the centre of mass, shape (3, 3). [kg m2]"""
        if self.inertia_kg_m2 is not None:
            return np.array(self.inertia_kg_m2)
        radius = (3.0 * self.mass_kg / (4.0 * np.pi * PAYLOAD_DENSITY_KG_M3)) ** (1.0 / 3.0)
        return np.asarray(0.4 * self.mass_kg * radius**2 * np.eye(3))

    @property
    def body(self) -> RigidBody:
        """The payload as a body in the tool frame."""
        return RigidBody(self.mass_kg, np.asarray(self.com_m, dtype=float), self.rotational_inertia_kg_m2())


def _is_inertia(matrix: Array) -> bool:
    if not (np.abs(matrix) <= LARGEST_INERTIA_KG_M2).all() or not np.allclose(matrix, matrix.T):
        return False
    return bool(np.linalg.eigvalsh(matrix)[0] >= 0.0)


@dataclass(frozen=True, init=False, repr=False, eq=False)
class Robot:
    """A serial arm that carries a payload; it cannot be changed, see `variant`.

    Attributes:
        file: Validated robot file.
        source: How messages name the file.
        name: Name of the robot.
        vendor: Its vendor.
        payload: What it carries.
        joint_names: Names of the n joints.
        joint_count: Number n of joints.
        lower_rad: Lower position limits, shape (n,). [rad]
        upper_rad: Upper position limits, shape (n,). [rad]
        velocity_rad_s: Velocity limits, shape (n,). [rad/s]
        effort_nm: Continuous effort limits, shape (n,). [Nm]
        peak_effort_nm: Peak effort limits, the continuous ones where none are given, shape (n,). [Nm]
        home_rad: Configuration at home, shape (n,). [rad]
        drives: Drives, and the controller as it follows from them.
        controller: Its timing where that was learnt on the machine; None: by its drives.
        mechanism: Bodies and joints, with the payload.
    """

    file: RobotFile
    source: str
    name: str
    vendor: str
    payload: Payload
    joint_names: tuple[str, ...]
    joint_count: int
    lower_rad: Array
    upper_rad: Array
    velocity_rad_s: Array
    effort_nm: Array
    peak_effort_nm: Array
    home_rad: Array
    drives: DriveParameters
    controller: ControllerTiming | None
    mechanism: Mechanism

    def __init__(self, file: RobotFile, payload: Payload | None = None, source: str | None = None) -> None:
        """A robot of a file.

        Args:
            file: Validated robot file.
            payload: What it carries; nothing if not given.
            source: How messages name the file; by the robot's name if not given.

        Raises:
            InputError: A moving body without usable inertia, or a payload above the rated one.
        """
        if not isinstance(file, RobotFile):
            raise InputError(f"{shown(file)} is not a robot file", key="file", allowed="what load_robot_file returns")
        if payload is not None and not isinstance(payload, Payload):
            allowed = "a Payload, or a mass as payload_kg"
            raise InputError(f"{shown(payload)} is not a payload", key="payload", allowed=allowed)
        carried = payload if payload is not None else Payload()
        file.check_payload(carried.mass_kg)
        joints = file.moving_joints
        limits = [(joint.lower_rad, joint.upper_rad, joint.velocity_rad_s, joint.effort_nm) for joint in joints]
        lower, upper, velocity, effort = (frozen(column) for column in np.array(limits, dtype=float).T)
        peaks = [joint.peak_effort_nm for joint in joints]
        names = tuple(joint.name for joint in joints)
        where = source if source is not None else file.name
        mechanism = assemble(file, where)
        vars(self).update(
            file=file,
            source=where,
            name=file.name,
            vendor=file.vendor,
            payload=carried,
            joint_names=names,
            joint_count=len(joints),
            lower_rad=lower,
            upper_rad=upper,
            velocity_rad_s=velocity,
            effort_nm=effort,
            peak_effort_nm=frozen([own or published for own, published in zip(peaks, effort, strict=True)]),
            home_rad=frozen(file.home_rad),
            drives=_drives(file, names),
            controller=file.controller.timing(names) if file.controller is not None else None,
            mechanism=mechanism.with_load(carried.body) if carried.mass_kg > 0 else mechanism,
        )

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, {self.joint_count} joints, payload {self.payload.mass_kg:g} kg)"

    @cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """What is implausible about it; see `robojoule.robots.plausibility`."""
        from robojoule.robots.plausibility import doubts_about  # late: it needs robots

        return doubts_about(self)

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
        controller: ControllerTiming | None = None,
    ) -> Robot:
        """The robot with other drives, another mechanism, peak torques or timing, everything else shared."""
        variant = copy.copy(self)
        changes = {
            "drives": drives,
            "mechanism": mechanism,
            "peak_effort_nm": peak_effort_nm,
            "controller": controller,
        }
        vars(variant).update({name: value for name, value in changes.items() if value is not None})
        return variant

    def carrying(self, payload: Payload) -> Robot:
        """The robot with another payload on the bodies of its file, drives and limits shared.

        Raises:
            InputError: A payload above the rated one.
        """
        self.file.check_payload(payload.mass_kg)
        mechanism = assemble(self.file, self.source)
        other = self.variant(mechanism=mechanism.with_load(payload.body) if payload.mass_kg > 0 else mechanism)
        vars(other).update(payload=payload)
        return other

    @property
    def supply(self) -> Supply | None:
        """What lies between the mains and the arm, if the file says so."""
        found = self.file.drives.supply
        return None if found is None else Supply(found.controller_power_w, found.efficiency)

    @property
    def standby(self) -> tuple[StandbyMode, ...]:
        """Modes that the controller enters in long waits; none: motors hold."""
        return () if self.file.standby is None else self.file.standby.modes()

    def arm_side(self) -> Robot:
        """The robot with its drives seen from the arm's bus, where its own controller measures power.

        Raises:
            InputError: The file does not say what lies between.
        """
        if self.supply is None:
            raise InputError(
                f"{self.name} does not say what lies between the mains and the arm",
                file=self.source,
                key="drives.supply",
                allowed="controller_power_w and efficiency",
            )
        return self.variant(drives=self.supply.arm_side(self.drives))

    def takes_programs_of(self, name: str | None) -> bool:
        """Whether programs for a robot of a name are for this one: its own, or the one it was learnt from."""
        return name is None or name in (self.name, self.file.derived_from)

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
        values = as_array(q, where, "joint positions")
        if values.shape != (self.joint_count,):
            given = counted(values.size, "joint position")
            problem = f"{given} given, but {self.name} has {counted(self.joint_count, 'joint')}"
            raise InputError(problem, key=where)
        for name, value, lower, upper in zip(
            self.joint_names, *(column.tolist() for column in (values, self.lower_rad, self.upper_rad)), strict=True
        ):
            if not math.isfinite(value):
                raise InputError(f"{name} is not a finite number", key=where)
            if not lower - LIMIT_TOLERANCE_RAD <= value <= upper + LIMIT_TOLERANCE_RAD:
                degrees = [math.degrees(angle) for angle in (value, lower, upper)]
                raise InputError(
                    f"{name} = {value:.6g} rad ({degrees[0]:.6g} deg) is beyond its limit",
                    key=where,
                    allowed=f"{lower:.6g} to {upper:.6g} rad ({degrees[1]:.6g} to {degrees[2]:.6g} deg)",
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
