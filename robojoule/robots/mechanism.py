"""The mechanism of a serial arm: its moving bodies, the joints that turn them, and where they are.

Links behind fixed joints are merged into the moving body before them, and so is what the arm carries. Bodies are
counted from the base: body 0 is the base, which has no inertial figures, body i is moved by joint i.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, frozen
from robojoule.errors import InputError, MissingPackage, refuse
from robojoule.robots.body_checks import inertia_matrix, moving_body_errors
from robojoule.robots.rigid_body import BODY_PARAMETERS, Placement, RigidBody, product, quaternions
from robojoule.robots.robot_file import LinkFile, RobotFile

GRAVITY_M_S2 = frozen([0.0, 0.0, -9.81])


@dataclass(frozen=True, eq=False)
class Mechanism:
    """Moving bodies of an arm of n revolute joints, one behind the other.

    Attributes:
        joint_names: Names of the joints.
        placements: Of each joint at zero in the body before it.
        axes: Unit axis of each joint, shape (n, 3). [-]
        bodies: What each joint moves, in the frame of the joint.
        anchors: For each link the number of the body that it belongs to and its placement in it.
        tool_body: Number of the body that carries the tool.
        tool: Placement of the tool in it.
        gravity_m_s2: Gravity in the base frame, shape (3,). [m/s2]
    """

    joint_names: tuple[str, ...]
    placements: tuple[Placement, ...]
    axes: Array
    bodies: tuple[RigidBody, ...]
    anchors: dict[str, tuple[int, Placement]]
    tool_body: int
    tool: Placement
    gravity_m_s2: Array = field(default_factory=lambda: GRAVITY_M_S2)

    @property
    def joint_count(self) -> int:
        """Number of joints n."""
        return len(self.bodies)

    def with_body(self, number: int, body: RigidBody) -> Mechanism:
        """The same with another body of a number from 1."""
        return replace(self, bodies=(*self.bodies[: number - 1], body, *self.bodies[number:]))

    def with_load(self, load: RigidBody) -> Mechanism:
        """The same with a load in the frame of the tool; a base that carries the tool carries the load too."""
        if self.tool_body == 0:
            return self
        return self.with_body(self.tool_body, self.bodies[self.tool_body - 1] + load.placed(self.tool))

    def with_changes(self, changes: ArrayLike) -> Mechanism:
        """The same with changed body parameters.

        Args:
            changes: Changes of the parameters of each body (see `RigidBody.parameters`), shape (10 n,).
        """
        rows = np.asarray(changes, dtype=float).reshape(-1, BODY_PARAMETERS)
        bodies = [RigidBody.of_parameters(body.parameters + row) for body, row in zip(self.bodies, rows, strict=True)]
        return replace(self, bodies=tuple(bodies))

    def body_placements(self, q: Array) -> tuple[Array, Array]:
        """Where all bodies are, the base included, in the base frame.

        Args:
            q: Joint positions, shape (N, n). [rad]

        Returns:
            Rotations (n + 1, 3, 3, N) and origins (n + 1, 3, N) [m].
        """
        rotations = np.empty((self.joint_count + 1, 3, 3, len(q)))
        origins = np.empty((self.joint_count + 1, 3, len(q)))
        rotations[0], origins[0] = np.eye(3)[..., None], 0.0
        sines, cosines = np.sin(q.T), np.cos(q.T)
        for joint, placement in enumerate(self.placements):
            turn = _turns(self.axes[joint], sines[joint], cosines[joint])
            origin = product(rotations[joint], placement.origin_m[:, None, None])[:, 0]
            origins[joint + 1] = origins[joint] + origin
            rotations[joint + 1] = product(rotations[joint], product(placement.rotation[..., None], turn))
        return rotations, origins

    def tool_placements(self, q: Array) -> tuple[Array, Array]:
        """Where the tool is in the base frame.

        Args:
            q: Joint positions, shape (N, n). [rad]

        Returns:
            Positions (N, 3) [m] and orientations (N, 4) as unit quaternions w, x, y, z with w >= 0.
        """
        rotations, origins = (part[self.tool_body] for part in self.body_placements(q))
        position = origins + product(rotations, self.tool.origin_m[:, None, None])[:, 0]
        orientation = quaternions(product(rotations, self.tool.rotation[..., None]))
        return np.ascontiguousarray(position.T), orientation

    @cached_property
    def model(self) -> Any:
        """The same as a Pinocchio model.

        Raises:
            MissingPackage: Pinocchio is not installed.
        """
        pin = installed_pinocchio()
        if pin is None:
            raise MissingPackage("a Pinocchio model of the robot", "pin")
        model = pin.Model()
        model.gravity.linear = np.array(self.gravity_m_s2)
        for name, placement, axis, body in zip(self.joint_names, self.placements, self.axes, self.bodies, strict=True):
            aligned = {(1, 0, 0): pin.JointModelRX, (0, 1, 0): pin.JointModelRY, (0, 0, 1): pin.JointModelRZ}
            kind = aligned.get(tuple(axis.tolist()))
            joint = kind() if kind else pin.JointModelRevoluteUnaligned(np.array(axis))
            model.addJoint(model.njoints - 1, joint, pin.SE3(placement.rotation, placement.origin_m), name)
            model.inertias[model.njoints - 1] = pin.Inertia(body.mass_kg, body.center_m, body.inertia_kg_m2)
        return model


@cache
def installed_pinocchio() -> ModuleType | None:
    """The package Pinocchio, None where it is not installed."""
    try:
        import pinocchio as package
    except ImportError:
        return None
    return package  # type: ignore[no-any-return]


def assemble(file: RobotFile, source: str) -> Mechanism:
    """Put an arm together from its links; nothing is carried.

    Args:
        file: Validated robot file.
        source: How messages name it.

    Raises:
        InputError: A link is not connected to the root link, or moving bodies have no usable inertia.
    """
    root = Placement.identity()
    anchors: dict[str, tuple[int, Placement]] = {file.root_link: (0, root)}
    placements: list[Placement] = []
    bodies: list[RigidBody] = []
    pending = list(file.joints)
    while pending:
        joint = next((j for j in pending if j.parent in anchors), None)
        if joint is None:
            raise InputError(
                f"joint '{pending[0].name}' is attached to link '{pending[0].parent}', "
                f"which is not connected to the root link '{file.root_link}'",
                file=source,
                key="joints",
            )
        pending.remove(joint)
        number, at = anchors[joint.parent]
        at = at @ Placement.of(joint.origin_xyz_m, joint.origin_rpy_rad)
        if joint.type != "fixed":
            placements.append(at)
            bodies.append(RigidBody.nothing())
            number, at = len(bodies), root
        anchors[joint.child] = (number, at)
        link = file.links[joint.child]
        if link is not None and link.mass_kg > 0:
            body = _body(link).placed(at)
            if number:
                bodies[number - 1] += body
    if file.tool.parent not in anchors:
        problem = f"the tool's parent '{file.tool.parent}' is not connected to the root link '{file.root_link}'"
        raise InputError(problem, file=source, key="tool.parent")
    numbers = {link: number for link, (number, _) in anchors.items()}
    refuse(list(moving_body_errors(file, numbers, bodies, source)))
    tool_body, at = anchors[file.tool.parent]
    axes = np.array([joint.axis for joint in file.moving_joints], dtype=float)
    return Mechanism(
        joint_names=tuple(joint.name for joint in file.moving_joints),
        placements=tuple(placements),
        axes=frozen([axis / np.linalg.norm(axis) for axis in axes]),
        bodies=tuple(bodies),
        anchors=anchors,
        tool_body=tool_body,
        tool=at @ Placement.of(file.tool.origin_xyz_m, file.tool.origin_rpy_rad),
    )


def _body(link: LinkFile) -> RigidBody:
    return RigidBody(link.mass_kg, np.asarray(link.com_m, dtype=float), inertia_matrix(link.inertia_kg_m2))


def _turns(axis: Array, sine: Array, cosine: Array) -> Array:
    """Rotations about an axis by angles of N sines and cosines, shape (3, 3, N). [-]"""
    turn, versine = np.empty((3, 3, len(sine))), 1.0 - cosine
    for i, along in enumerate(axis.tolist()):
        turn[i, i] = 1.0 if abs(along) == 1.0 else versine * along * along + cosine
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        both, across = versine * axis[i] * axis[j], sine * axis[k]
        turn[i, j], turn[j, i] = both - across, both + across
    return turn
