"""A drive file for any URDF: drives by the scaling laws, and what else a URDF may lack.

Taken from the URDF: kinematics, inertia, and limits as far as they are there. Scaled: drives
(`robojoule.robots.scaling`); effort limits that are missing or all equal, as placeholders are
(`robojoule.robots.effort`); velocity limits that are missing, by a power of the rated payload over the arms of the
catalog. Assumed: one turn each way for continuous joints, home at zero, and a tool frame whose z axis is that of the
last joint. Each group says in `provenance` what it is.

The laws know six-axis arms. In an arm of another number of joints the first three stand for the main axes of such an
arm, the last three for its wrist, and those between for its third axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robojoule.arrays import Array
from robojoule.documents import parse
from robojoule.errors import InputError, refuse
from robojoule.robots.effort import limits
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot_file import LEAST_FIGURE, DrivesFile, RobotFile
from robojoule.robots.robot_loading import body_errors, with_limits
from robojoule.robots.scaling import (
    COBOT_NOTE,
    EFFORT_NOTE,
    INDUSTRIAL_NOTE,
    Scaling,
    load_scaling,
    rounded,
    supply_note,
)
from robojoule.robots.urdf import joints_from_the_base, read_joints, read_links, root_link_of
from robojoule.robots.urdf_chain import TURNING, chain_of, to_the_base
from robojoule.robots.urdf_elements import UrdfJoint, read_xml

TOOL_NAMES = ("tool0", "tool_flange", "flange", "ee_link")  # what ROS calls the end of an arm
_NEAR_M = 1e-6
_HAND_BEHIND = 3  # joints: branches nearer to the base are arms, farther away they are fingers
_NO_DRIVE = {
    **{"gear_ratio": 1.0, "rotor_inertia_kg_m2": 1.0},
    **dict.fromkeys(("coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2"), 0.0),
}
_NO_DRIVES = {name: 0.5 for name, field in DrivesFile.model_fields.items() if field.is_required()} | {
    "provenance": "none"
}
_NOTE = {
    "kinematics": ("stated", "as in the URDF"),
    "inertia": ("stated", "as in the URDF"),
    "limits": ("stated", "as in the URDF"),
    "effort": ("stated", "as in the URDF"),
}


def scaled_drive_file(
    path: str | Path,
    rated_payload_kg: float,
    *,
    cobot: bool = False,
    tool: str | None = None,
    freeze: Mapping[str, float] | None = None,
) -> tuple[dict[str, Any], tuple[InputError, ...]]:
    """Make the drive file of a URDF.

    Args:
        path: The URDF.
        rated_payload_kg: What the arm is rated for. [kg]
        cobot: Whether it is a collaborative arm, with harmonic drives.
        tool: Link that carries the tool; found by its name or place if not given.
        freeze: Positions of joints that stand still, by name. [rad or m]

    Returns:
        Plain data of the drive file, and what it still lacks: figures that no law gives, such as inertia.

    Raises:
        InputError: A broken URDF, or joints that make no serial arm.
    """
    path = Path(path)
    root = read_xml(path)
    errors: list[InputError] = []
    joints, links = read_joints(root, path, errors), read_links(root, path, errors)
    frozen = dict(freeze or {})
    for name in sorted(set(frozen) - {joint.name for joint in joints}):
        known = ", ".join(joint.name for joint in joints)
        errors.append(InputError(f"there is no joint '{name}'", file=path, key="--freeze", allowed=known))
    if tool is not None and tool not in links:
        errors.append(InputError(f"there is no link '{tool}'", file=path, key="--tool", allowed=", ".join(links)))
    refuse(errors)
    root_link = root_link_of(links, joints, path)
    tool = tool or _tool_link(joints, root_link, frozen)
    chain = chain_of(joints, tool, frozen, (), path, "--freeze {}=POSITION")
    refuse(chain.errors)
    arm = [joint for joint in joints_from_the_base(chain.joints, root_link) if joint["type"] == "revolute"]
    if not arm:
        raise InputError("there is no joint that turns between base and tool", file=path, allowed="a serial arm")

    notes = dict(_NOTE)
    roles = roles_of(len(arm))
    scaling = load_scaling()
    given = _completed_limits(arm, roles, rated_payload_kg, scaling, cobot, notes)
    data: dict[str, Any] = {
        "rated_payload_kg": rated_payload_kg,
        "home_rad": [min(max(0.0, joint["lower_rad"]), joint["upper_rad"]) for joint in arm],
        "tool": {"parent": tool, "origin_xyz_m": [0.0, 0.0, 0.0], "origin_rpy_rad": _outwards(chain.joints, tool)},
        "limits": given,
        "freeze": {**chain.lumped, **frozen},
    }
    lacking = _scale(data, path, links, chain.joints, root_link, roles, scaling, cobot, notes)
    data["provenance"] = {group: {"kind": kind, "note": note} for group, (kind, note) in notes.items()}
    data["drives"] = data.pop("drives")  # last, as the longest
    return {key: value for key, value in data.items() if value}, lacking


def roles_of(joint_count: int) -> list[int]:
    """Joint of a six-axis arm, counted from 0, that each joint stands for."""
    if joint_count <= 3:
        return [0, 1, 2][:joint_count]
    wrist = [3, 4, 5] if joint_count >= 6 else [4, 5] if joint_count == 5 else [4]
    main = joint_count - len(wrist)
    return [min(index, 2) for index in range(main)] + wrist


def _tool_link(joints: Sequence[UrdfJoint], root_link: str, frozen: Mapping[str, float]) -> str:
    """The end of the arm: along the longest chain of turning joints, before the branches of a hand."""

    def below(link: str) -> list[UrdfJoint]:
        return [joint for joint in joints if joint.parent == link]

    def turns(joint: UrdfJoint) -> int:
        return int(joint.kind in TURNING and joint.mimics is None and joint.name not in frozen)

    def longest(link: str, seen: tuple[str, ...] = ()) -> int:
        children = [joint for joint in below(link) if joint.child not in seen]
        return max((turns(joint) + longest(joint.child, (*seen, link)) for joint in children), default=0)

    link, passed = root_link, 0
    while children := [joint for joint in below(link) if turns(joint) + longest(joint.child) > 0]:
        if len(children) > 1 and passed >= _HAND_BEHIND:
            break
        best = max(children, key=lambda joint: turns(joint) + longest(joint.child))
        passed += turns(best)
        link = best.child
    fixed = [link]
    for one in fixed:  # grows while it is walked through
        fixed += [joint.child for joint in below(one) if joint.kind == "fixed" and joint.child not in fixed]
    named = [one for name in TOOL_NAMES for one in fixed if one == name or one.endswith(f"_{name}")]
    return named[0] if named else link


def _outwards(joints: Sequence[UrdfJoint], tool: str) -> list[float]:
    """Turn of a tool frame whose z axis is that of the last joint and leaves the arm. [rad]"""
    back, turning = to_the_base(joints, tool), 0
    at, axis = Placement.identity(), np.array([0.0, 0.0, 1.0])
    for joint in back:  # placement of the tool's link in ever earlier links, until the joint before the last one
        if joint.kind in TURNING:
            turning += 1
            if turning == 2:
                break
            axis = np.array(joint.axis, dtype=float) @ at.rotation  # in the tool's link
        at = Placement.of(joint.xyz_m, joint.rpy_rad) @ at
    if at.origin_m @ (at.rotation @ axis) < -_NEAR_M:
        axis = -axis
    x, y, z = (axis / np.linalg.norm(axis)).tolist()
    return [round(math.asin(max(-1.0, min(1.0, -y))), 9) + 0.0, round(math.atan2(x, z), 9) + 0.0, 0.0]


def _completed_limits(
    arm: list[dict[str, Any]],
    roles: list[int],
    rated_payload_kg: float,
    scaling: Scaling,
    cobot: bool,
    notes: dict[str, tuple[str, str]],
) -> dict[str, dict[str, float]]:
    """Fill in positions and speeds that are missing; gives what was filled in, by joint."""
    given: dict[str, dict[str, float]] = {}
    speeds = _usual_speeds(scaling, rated_payload_kg, cobot)[roles]
    said = []
    for joint, speed in zip(arm, speeds, strict=True):
        own: dict[str, float] = {}
        if "lower_rad" not in joint or "upper_rad" not in joint or joint["lower_rad"] >= joint["upper_rad"]:
            own |= {"lower_rad": -2.0 * math.pi, "upper_rad": 2.0 * math.pi}
            said.append("positions without limits taken as one turn each way")
        if not joint.get("velocity_rad_s", 0.0) >= LEAST_FIGURE:
            own["velocity_rad_s"] = rounded(speed)
            said.append("speeds that are missing scaled over the rated payload")
        joint |= own
        if own:
            given[joint["name"]] = own
    if said:
        notes["limits"] = ("assumed", "; ".join(["as in the URDF", *dict.fromkeys(said)]))
    return given


def _usual_speeds(scaling: Scaling, rated_payload_kg: float, cobot: bool) -> Array:
    """Velocity limits of six-axis arms by a power of the rated payload, least squares over the catalog, shape (6,)."""
    files = [file for name, file in scaling.files.items() if scaling.is_cobot(name) == cobot]
    payloads = np.log([file.rated_payload_kg for file in files])
    speeds = np.log([limits(file)[1] for file in files])
    bounded = np.clip(math.log(max(rated_payload_kg, LEAST_FIGURE)), payloads.min(), payloads.max())
    slope, level = np.polyfit(payloads, speeds, 1)
    return np.asarray(np.exp(level + slope * bounded))


def _scale(
    data: dict[str, Any],
    path: Path,
    links: dict[str, Any],
    joints: Sequence[UrdfJoint],
    root_link: str,
    roles: list[int],
    scaling: Scaling,
    cobot: bool,
    notes: dict[str, tuple[str, str]],
) -> tuple[InputError, ...]:
    """Add scaled efforts and drives to the data of a drive file; returns what no law gives."""

    def known() -> tuple[RobotFile, list[InputError]]:
        """The arm as far as it is known, and what it lacks."""
        lacking: list[InputError] = []
        whole = [
            with_limits(joint, str(path), lacking, "the drive file")
            for joint in joints_from_the_base(joints, root_link, data["limits"])
        ]
        turning = [joint["name"] for joint in whole if joint["type"] == "revolute"]
        arm = {
            **dict.fromkeys(("name", "model", "vendor", "source", "license"), path.stem),
            **{key: data[key] for key in ("rated_payload_kg", "home_rad", "tool")},
            **{"root_link": root_link, "links": links, "joints": whole},
            "drives": {**_NO_DRIVES, "joints": dict.fromkeys(turning, _NO_DRIVE)},
        }
        file = parse(RobotFile, arm, path)
        return file, [*lacking, *body_errors(file, str(path))]

    file, lacking = known()
    efforts, _ = limits(file)
    unknown = any("effort_nm" in error.problem for error in lacking) or (len(roles) >= 3 and len(set(efforts)) == 1)
    if unknown and not any((error.key or "").startswith("links") for error in lacking) and {1, 4} <= set(roles):
        scaled = scaling.effort_rule(cobot=cobot).effort_nm(file, roles)
        for joint, effort in zip(file.moving_joints, scaled, strict=True):
            data["limits"].setdefault(joint.name, {})["effort_nm"] = rounded(effort)
        notes["effort"] = ("scaled", EFFORT_NOTE)
        file, lacking = known()
    if any("effort_nm" in error.problem for error in lacking):
        refuse(lacking)  # drives follow from the effort limits
    data["drives"] = scaling.drives(file, cobot=cobot, roles=roles)
    notes["drives"] = ("scaled", COBOT_NOTE if cobot else INDUSTRIAL_NOTE)
    if cobot:
        notes["supply"] = ("assumed", supply_note(scaling.anchors.cobots))
    return tuple(lacking)
