"""The robot: kinematics, limits and link inertia in a Pinocchio model, drives beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.robots.bodies import check_moving_bodies
from robojoule.robots.drives import DriveParameters
from robojoule.robots.robot_file import JointFile, LinkFile, RobotFile

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


def _placement(xyz: ArrayLike, rpy: tuple[float, float, float]) -> pin.SE3:
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.asarray(xyz, dtype=float))


def _link_inertia(link: LinkFile, name: str, source: str) -> pin.Inertia:
    i = link.inertia_kg_m2
    matrix = np.array([[i.ixx, i.ixy, i.ixz], [i.ixy, i.iyy, i.iyz], [i.ixz, i.iyz, i.izz]])
    moments = np.linalg.eigvalsh(matrix)
    if moments[0] < 0:  # no sum of links can mend that
        shown = ", ".join(f"{moment:.3g}" for moment in moments)
        raise InputError(
            f"the inertia of link '{name}' is not positive definite (principal moments {shown} kg m2)",
            file=source,
            key=f"links.{name}",
        )
    return pin.Inertia(link.mass_kg, np.asarray(link.com_m, dtype=float), matrix)


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
        self.lower_rad = _frozen([joint.lower_rad for joint in joints])
        self.upper_rad = _frozen([joint.upper_rad for joint in joints])
        self.velocity_rad_s = _frozen([joint.velocity_rad_s for joint in joints])
        self.effort_nm = _frozen([joint.effort_nm for joint in joints])
        self.home_rad = _frozen(file.home_rad)
        self.drives = _drives(file, self.joint_names)
        self.model = self._build_model()

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, {self.joint_count} joints, payload {self.payload.mass_kg:g} kg)"

    def _build_model(self) -> pin.Model:
        """Build the Pinocchio model; links behind fixed joints are merged into the moving link before them."""
        file, model = self.file, pin.Model()
        model.name = file.name
        anchors: dict[str, tuple[int, pin.SE3]] = {file.root_link: (0, pin.SE3.Identity())}
        pending = list(file.joints)
        while pending:
            joint = next((j for j in pending if j.parent in anchors), None)
            if joint is None:
                raise InputError(
                    f"joint '{pending[0].name}' hangs on link '{pending[0].parent}', "
                    f"which does not hang on the root link '{file.root_link}'",
                    file=self.source,
                    key="joints",
                )
            pending.remove(joint)
            parent, offset = anchors[joint.parent]
            placement = offset * _placement(joint.origin_xyz_m, joint.origin_rpy_rad)
            if joint.type == "fixed":
                anchors[joint.child] = (parent, placement)
            else:
                index = model.addJoint(parent, _joint_model(joint), placement, joint.name)
                anchors[joint.child] = (index, pin.SE3.Identity())
            link = file.links[joint.child]
            if link is not None and link.mass_kg > 0:
                owner, at = anchors[joint.child]
                model.appendBodyToJoint(owner, _link_inertia(link, joint.child, self.source), at)
        if file.tool.parent not in anchors:
            raise InputError(
                f"the tool's parent '{file.tool.parent}' hangs on no joint", file=self.source, key="tool.parent"
            )
        check_moving_bodies(file, anchors, model, self.source)
        owner, at = anchors[file.tool.parent]
        tool = at * _placement(file.tool.origin_xyz_m, file.tool.origin_rpy_rad)
        self.tool_joint, self.tool_in_joint = owner, tool
        self.link_anchors = anchors
        if self.payload.mass_kg > 0:
            inertia = pin.Inertia(
                self.payload.mass_kg,
                np.asarray(self.payload.com_m, dtype=float),
                self.payload.rotational_inertia_kg_m2(),
            )
            model.appendBodyToJoint(owner, inertia, tool)
        return model

    @cached_property
    def _data(self) -> pin.Data:
        return self.model.createData()

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
        configurations = np.atleast_2d(np.asarray(q, dtype=float))
        positions = np.empty((len(configurations), 3))
        orientations = np.empty((len(configurations), 4))
        for row, configuration in enumerate(configurations):
            pin.forwardKinematics(self.model, self._data, configuration)
            placement = self._data.oMi[self.tool_joint] * self.tool_in_joint
            positions[row] = placement.translation
            x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
            orientations[row] = np.array([w, x, y, z]) * (1.0 if w >= 0 else -1.0)
        return positions, orientations


def _joint_model(joint: JointFile) -> pin.JointModel:
    axis = np.asarray(joint.axis, dtype=float)
    axis = axis / np.linalg.norm(axis)
    aligned = {(1, 0, 0): pin.JointModelRX, (0, 1, 0): pin.JointModelRY, (0, 0, 1): pin.JointModelRZ}
    kind = aligned.get(tuple(axis.tolist()))
    return kind() if kind else pin.JointModelRevoluteUnaligned(axis)


def _frozen(values: object) -> Array:
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


def _drives(file: RobotFile, joint_names: tuple[str, ...]) -> DriveParameters:
    drives = file.drives
    joints = [drives.joints[name] for name in joint_names]
    return DriveParameters(
        gear_ratio=_frozen([joint.gear_ratio for joint in joints]),
        rotor_inertia_kg_m2=_frozen([joint.rotor_inertia_kg_m2 for joint in joints]),
        coulomb_nm=_frozen([joint.coulomb_nm for joint in joints]),
        viscous_nm_s_per_rad=_frozen([joint.viscous_nm_s_per_rad for joint in joints]),
        copper_w_per_nm2=_frozen([joint.copper_w_per_nm2 for joint in joints]),
        base_power_w=drives.base_power_w,
        drive_active_power_w=drives.drive_active_power_w,
        inverter_efficiency=drives.inverter_efficiency,
        regeneration_efficiency=drives.regeneration_efficiency,
        torque_use=drives.torque_use,
        torque_floor=drives.torque_floor,
        filter_time_s=drives.filter_time_s,
    )
