"""From the tree of a URDF to a serial arm: joints that are held still, and branches that are lumped.

The arm is the chain of joints from the base to the tool. What else moves is held still:

- joints that the drive file freezes, with the joints that follow them (mimic);
- joints behind the tool's body, such as the jaws of a gripper, and joints of branches of the base: they are held at
  zero, or at the limit next to it, and their links are lumped into what carries them.

What moves otherwise cannot be an arm: prismatic, floating, planar and following joints within the chain, and branches
between the base and the tool.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from robojoule.errors import InputError
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot_file import of_joint
from robojoule.robots.urdf_elements import UrdfJoint

TURNING = ("revolute", "continuous")


@dataclass(frozen=True)
class Chain:
    """A serial arm within a URDF.

    Attributes:
        joints: All joints, those that stand still as fixed ones.
        lumped: Positions of the joints that stand still although nobody said so, by name. [rad or m]
        errors: Why it is none.
    """

    joints: tuple[UrdfJoint, ...]
    lumped: dict[str, float]
    errors: tuple[InputError, ...]


def chain_of(
    joints: Sequence[UrdfJoint],
    tool_parent: str,
    frozen: Mapping[str, float],
    driven: Collection[str],
    path: Path,
    mend: str,
) -> Chain:
    """Find the arm.

    Args:
        joints: Joints of the URDF.
        tool_parent: Link that carries the tool.
        frozen: Positions of joints that shall stand still, by name. [rad or m]
        driven: Names of joints that have drives.
        path: The URDF, for messages.
        mend: How messages say where a position goes, with {} for the joint.
    """
    positions = _with_followers(joints, frozen)
    arm = to_the_base(joints, tool_parent)
    moving_arm = [j.name for j in arm if j.kind != "fixed" and j.name not in positions and not _why_not(j)]
    done, lumped, errors = [], {}, []
    for joint in joints:
        held = positions.get(joint.name)
        if joint.kind == "fixed" or held is not None:
            done.append(_held(joint, held or 0.0))
        elif joint in arm:
            problem = _why_not(joint)
            if problem:
                errors.append(InputError(problem, file=path, key=of_joint(joint.name), allowed=_freeze(joint, mend)))
                # For further findings it moves if the drive file moves it.
                joint = replace(joint, kind="revolute") if joint.name in driven else _held(joint, 0.0)
            done.append(joint)
        else:
            carrying = [j.name for j in to_the_base(joints, joint.parent) if j.name in moving_arm]
            if 0 < len(carrying) < len(moving_arm):
                problem = "the joint moves a branch between the base and the tool"
                errors.append(InputError(problem, file=path, key=of_joint(joint.name), allowed=_freeze(joint, mend)))
                held = 0.0
            else:
                held = lumped[joint.name] = _nearest_to_zero(joint)
            done.append(_held(joint, held))
    return Chain(tuple(done), lumped, tuple(errors))


def _freeze(joint: UrdfJoint, mend: str) -> str:
    return f"a serial arm of revolute joints, or its position as {mend.format(joint.name)}"


def _why_not(joint: UrdfJoint) -> str | None:
    """Why a joint of the arm cannot move on its own about an axis."""
    if joint.mimics is not None:
        return f"mimic joints are not supported: it follows '{joint.mimics[0]}'"
    return None if joint.kind in TURNING else f"the joint type '{joint.kind}' is not supported"


def _with_followers(joints: Sequence[UrdfJoint], frozen: Mapping[str, float]) -> dict[str, float]:
    """Positions of frozen joints and of those that follow them."""
    positions = dict(frozen)
    for _ in joints:  # a follower may be followed
        for joint in joints:
            if joint.mimics and joint.name not in positions and joint.mimics[0] in positions:
                leader, factor, offset = joint.mimics
                positions[joint.name] = factor * positions[leader] + offset
    return positions


def to_the_base(joints: Sequence[UrdfJoint], link: str) -> list[UrdfJoint]:
    """Joints between a link and the base, from the link."""
    above = {joint.child: joint for joint in joints}
    found: list[UrdfJoint] = []
    while (joint := above.get(link)) is not None and joint not in found:
        found.append(joint)
        link = joint.parent
    return found


def _nearest_to_zero(joint: UrdfJoint) -> float:
    lower, upper = joint.limits.get("lower_rad", -math.inf), joint.limits.get("upper_rad", math.inf)
    return min(max(0.0, lower), upper) if lower <= upper and joint.kind in (*TURNING, "prismatic") else 0.0


def _held(joint: UrdfJoint, position: float) -> UrdfJoint:
    """A joint as a fixed one, at a position."""
    if position == 0.0:
        return replace(joint, kind="fixed", mimics=None)
    at = Placement.of(joint.xyz_m, joint.rpy_rad)
    axis = np.array(joint.axis) / (np.linalg.norm(joint.axis) or 1.0)
    if joint.kind not in TURNING:
        x, y, z = at.at(position * axis).tolist()
        return replace(joint, kind="fixed", mimics=None, xyz_m=(x, y, z))
    turn = (at @ Placement(_rotation(axis, position), np.zeros(3))).rotation
    rpy = (
        math.atan2(turn[2, 1], turn[2, 2]),
        math.atan2(-turn[2, 0], math.hypot(turn[2, 1], turn[2, 2])),
        math.atan2(turn[1, 0], turn[0, 0]),
    )
    return replace(joint, kind="fixed", mimics=None, rpy_rad=rpy)


def _rotation(axis: np.ndarray, angle_rad: float) -> np.ndarray:
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle_rad) * cross + (1.0 - math.cos(angle_rad)) * cross @ cross)
