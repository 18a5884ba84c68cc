"""Robots from a URDF: kinematics, limits and inertia from it, the rest from a short drive file beside it.

A URDF knows nothing of drives, so `arm.urdf` needs a drive file, `arm.drives.yaml` (or .yml, .json) beside it unless
named otherwise:

    rated_payload_kg: 5
    home_rad: [0, -1.57, 1.57]
    tool: {parent: flange, origin_xyz_m: [0, 0, 0], origin_rpy_rad: [0, 0, 0]}
    limits:                                   # what the URDF lacks; continuous joints need lower_rad and upper_rad
      joint_1: {lower_rad: -6.28, upper_rad: 6.28}
    drives: ...                               # as in a robot file

Revolute, continuous and fixed joints make a serial arm of any length. Other joint types, mimic joints and branches
that move are refused. Positions of a continuous joint are not wrapped: the limits of the drive file count, as cables
and programs have limits even where the gear has none.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from pydantic import Field

from robojoule.documents import Document, check_file, load, parse, read_bytes, reason, write_document, write_text
from robojoule.errors import InputError
from robojoule.inputs import number_of
from robojoule.robots.rigid_body import Placement, RigidBody
from robojoule.robots.robot_file import (
    CapsuleFile,
    DrivesFile,
    FigureGroup,
    JointFile,
    LinkFile,
    NonNegative,
    Positive,
    Provenance,
    RobotFile,
    ToolFile,
)

JOINT_TYPES = ("revolute", "continuous", "fixed")
DRIVE_FILE_SUFFIXES = (".drives.yaml", ".drives.yml", ".drives.json")
_LIMITS = {"lower_rad": "lower", "upper_rad": "upper", "velocity_rad_s": "velocity", "effort_nm": "effort"}


class LimitsFile(Document):
    """Limits of one joint that count instead of the URDF's."""

    lower_rad: float | None = None
    upper_rad: float | None = None
    velocity_rad_s: Positive | None = None
    effort_nm: Positive | None = None
    peak_effort_nm: Positive | None = None


class UrdfDriveFile(Document):
    """The drive file of a URDF: everything that a robot file has and a URDF has not."""

    name: str = ""
    vendor: str = "unknown"
    model: str = ""
    rated_payload_kg: NonNegative
    source: str = ""
    license: str = "not stated"
    caveats: str = ""
    provenance: dict[FigureGroup, Provenance] = Field(default_factory=dict)
    home_rad: list[float]
    tool: ToolFile
    lumped_links: dict[str, str] = Field(default_factory=dict)
    limits: dict[str, LimitsFile] = Field(default_factory=dict)
    capsules: dict[str, list[CapsuleFile]] = Field(default_factory=dict)
    drives: DrivesFile


def load_urdf(path: str | Path, drives: str | Path | None = None) -> RobotFile:
    """Read a URDF with its drive file.

    Args:
        path: The URDF.
        drives: The drive file; if not given, the one beside the URDF.

    Raises:
        InputError: No drive file, a broken URDF, a joint type that is not supported, or figures that are missing.
    """
    path = Path(path)
    companion = _drive_file_beside(path) if drives is None else Path(drives)
    root = _read_xml(path)
    extra = load(UrdfDriveFile, companion)
    names = [_attribute(element, "name", path, "joint") for element in root.findall("joint")]
    for unknown in sorted(set(extra.limits) - set(names)):
        raise InputError(f"there is no joint '{unknown}'", file=companion, key="limits", allowed=", ".join(names))
    joints = [_joint(element, extra, path, companion) for element in root.findall("joint")]
    links = {_attribute(element, "name", path, "link"): _link(element, path) for element in root.findall("link")}
    root_link = _root_link(links, joints, path)
    name = extra.name or root.get("name") or path.stem
    data = extra.model_dump(exclude={"limits"}) | {
        "name": name,
        "model": extra.model or name,
        "source": extra.source or f"{path.name} and {companion.name}",
        "root_link": root_link,
        "links": links,
        "joints": _from_the_base(joints, root_link),
    }
    return parse(RobotFile, data, urdf_source(path, companion))


def urdf_source(path: str | Path, drives: str | Path | None = None) -> str:
    """How messages name a URDF with its drive file: a figure may be in either."""
    path = Path(path)
    companion = _drive_file_beside(path) if drives is None else Path(drives)
    return f"{path} with {companion if companion.parent != path.parent else companion.name}"


def write_urdf(file: RobotFile, path: str | Path) -> None:
    """Write a robot file as URDF and the drive file beside it (`arm.urdf`, `arm.drives.json`).

    Reading them back gives the same robot file, to the bit.
    """
    path = Path(path)
    robot = ElementTree.Element("robot", name=file.name)
    for name, link in file.links.items():
        _add_link(robot, name, link)
    for joint in file.joints:
        _add_joint(robot, joint)
    ElementTree.indent(robot)
    write_text(path, ElementTree.tostring(robot, encoding="unicode") + "\n")
    keys = UrdfDriveFile.model_fields.keys() - {"limits"}
    data = file.model_dump(mode="json", include=keys)
    peaks = {j.name: {"peak_effort_nm": j.peak_effort_nm} for j in file.joints if j.peak_effort_nm is not None}
    if peaks:  # a URDF has one effort limit only
        data["limits"] = peaks
    write_document(path.with_suffix(DRIVE_FILE_SUFFIXES[-1]), data)


def _drive_file_beside(path: Path) -> Path:
    check_file(path)
    candidates = [path.with_suffix(suffix) for suffix in DRIVE_FILE_SUFFIXES]
    for candidate in candidates:
        if candidate.exists():
            return candidate
    raise InputError(
        "a URDF needs a drive file, as it says nothing of drives",
        file=path,
        allowed=f"{candidates[0].name} beside it, or a drive file named explicitly",
    )


def _read_xml(path: Path) -> ElementTree.Element:
    try:
        root = ElementTree.fromstring(read_bytes(path))  # the file says its encoding
    except (ValueError, LookupError, ElementTree.ParseError) as error:
        raise InputError(f"the file cannot be read ({reason(error)})", file=path) from None
    if root.tag != "robot":
        raise InputError(f"the root element is <{root.tag}>", file=path, allowed="<robot>: a URDF")
    if any("xacro" in element.tag for element in root.iter()):
        raise InputError("this is a xacro file, not a URDF", file=path, allowed="the output of `xacro FILE`")
    return root


def _joint(element: ElementTree.Element, extra: UrdfDriveFile, path: Path, companion: Path) -> dict[str, Any]:
    name = _attribute(element, "name", path, "joint")
    key = f"joint '{name}'"
    kind = _attribute(element, "type", path, key)
    if kind not in JOINT_TYPES:
        raise InputError(
            f"the joint type '{kind}' is not supported", file=path, key=key, allowed=", ".join(JOINT_TYPES)
        )
    if element.find("mimic") is not None:
        raise InputError("mimic joints are not supported", file=path, key=key, allowed="joints that move on their own")
    xyz, rpy = _origin(element, path, key)
    joint: dict[str, Any] = {
        "name": name,
        "type": "fixed" if kind == "fixed" else "revolute",
        "parent": _attribute(_child(element, "parent", path, key), "link", path, key),
        "child": _attribute(_child(element, "child", path, key), "link", path, key),
        "origin_xyz_m": xyz,
        "origin_rpy_rad": rpy,
        "axis": _vector(element.find("axis"), "xyz", (1.0, 0.0, 0.0), path, key),
    }
    if kind != "fixed":
        joint |= _joint_limits(element, extra.limits.get(name, LimitsFile()), kind, path, companion, key)
    return joint


def _joint_limits(
    element: ElementTree.Element, own: LimitsFile, kind: str, path: Path, companion: Path, key: str
) -> dict[str, float]:
    """Limits of a joint: the drive file's, or else the URDF's."""
    limit = element.find("limit")
    result = {}
    for field, attribute in _LIMITS.items():
        value = getattr(own, field)
        positional = field in ("lower_rad", "upper_rad")
        if value is None and limit is not None and not (positional and kind == "continuous"):
            # The URDF specification lets a missing position limit be 0; velocity and effort have no default.
            text = limit.get(attribute, "0" if positional else None)
            value = None if text is None else _number(text, path, f"{key} limit {attribute}")
        if value is None:
            problem = f"the {kind} joint has no {field}"
            raise InputError(
                problem, file=path, key=key, allowed=f"limits.{element.get('name')}.{field} in {companion}"
            )
        result[field] = value
    if own.peak_effort_nm is not None:
        result["peak_effort_nm"] = own.peak_effort_nm
    return result


def _link(element: ElementTree.Element, path: Path) -> dict[str, Any] | None:
    inertial = element.find("inertial")
    if inertial is None:
        return None
    key = f"link '{element.get('name')}'"
    xyz, rpy = _origin(inertial, path, key)
    tensor = _child(inertial, "inertia", path, key)
    figures = {
        name: _number(_attribute(tensor, name, path, key), path, f"{key} {name}")
        for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    }
    mass = _number(_attribute(_child(inertial, "mass", path, key), "value", path, key), path, f"{key} mass")
    return {"mass_kg": mass, "com_m": xyz, "inertia_kg_m2": _turned(figures, rpy)}


def _turned(tensor: dict[str, float], rpy: tuple[float, float, float]) -> dict[str, float]:
    """Inertia in link axes: R I R^T of a tensor that is given in axes turned by roll, pitch and yaw."""
    if not any(rpy):
        return tensor  # exactly: files written here are read back to the bit
    rows = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
    given = RigidBody(0.0, np.zeros(3), np.array([[tensor[name] for name in row] for row in rows]))
    turned = given.placed(Placement.of((0.0, 0.0, 0.0), rpy)).inertia_kg_m2
    return {name: float(turned[i, j]) for i, row in enumerate(rows) for j, name in enumerate(row) if j >= i}


def _root_link(links: dict[str, Any], joints: list[dict[str, Any]], path: Path) -> str:
    children = {joint["child"] for joint in joints}
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        found = f"the root links {', '.join(roots)}" if roots else "no root link"
        raise InputError(f"the URDF has {found}", file=path, allowed="exactly one link that is not a joint's child")
    return roots[0]


def _from_the_base(joints: list[dict[str, Any]], root: str) -> list[dict[str, Any]]:
    """Joints in order from the base: URDFs may list them in any order. Those that hang nowhere come last."""
    ordered: list[dict[str, Any]] = []
    reached, pending = {root}, list(joints)
    while pending:
        joint = next((joint for joint in pending if joint["parent"] in reached), None)
        if joint is None:
            return ordered + pending
        pending.remove(joint)
        reached.add(joint["child"])
        ordered.append(joint)
    return ordered


def _origin(
    element: ElementTree.Element, path: Path, key: str
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    origin = element.find("origin")
    zero = (0.0, 0.0, 0.0)
    return _vector(origin, "xyz", zero, path, key), _vector(origin, "rpy", zero, path, key)


def _vector(
    element: ElementTree.Element | None,
    name: str,
    default: tuple[float, float, float],
    path: Path,
    key: str,
) -> tuple[float, float, float]:
    text = None if element is None else element.get(name)
    if text is None:
        return default
    values = [_number(part, path, f"{key} {name}") for part in text.split()]
    if len(values) != 3:
        raise InputError(f"{name} is '{text}'", file=path, key=key, allowed="three numbers")
    return values[0], values[1], values[2]


def _number(text: str, path: Path, key: str) -> float:
    try:
        return number_of(text)
    except ValueError as error:
        raise InputError(str(error), file=path, key=key) from None


def _child(element: ElementTree.Element, tag: str, path: Path, key: str) -> ElementTree.Element:
    child = element.find(tag)
    if child is None:
        raise InputError(f"<{tag}> is missing", file=path, key=key)
    return child


def _attribute(element: ElementTree.Element, name: str, path: Path, key: str) -> str:
    value = element.get(name)
    if value is None:
        raise InputError(f"<{element.tag}> lacks the attribute {name}", file=path, key=key)
    return value


def _add_link(robot: ElementTree.Element, name: str, link: LinkFile | None) -> None:
    element = ElementTree.SubElement(robot, "link", name=name)
    if link is None:
        return
    inertial = ElementTree.SubElement(element, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=_text(link.com_m), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=repr(link.mass_kg))
    tensor = {key: repr(value) for key, value in link.inertia_kg_m2.model_dump().items()}
    ElementTree.SubElement(inertial, "inertia", tensor)


def _add_joint(robot: ElementTree.Element, joint: JointFile) -> None:
    element = ElementTree.SubElement(robot, "joint", name=joint.name, type=joint.type)
    ElementTree.SubElement(element, "origin", xyz=_text(joint.origin_xyz_m), rpy=_text(joint.origin_rpy_rad))
    ElementTree.SubElement(element, "parent", link=joint.parent)
    ElementTree.SubElement(element, "child", link=joint.child)
    ElementTree.SubElement(element, "axis", xyz=_text(joint.axis))
    if joint.type != "fixed":
        limits = {attribute: repr(getattr(joint, field)) for field, attribute in _LIMITS.items()}
        ElementTree.SubElement(element, "limit", limits)


def _text(values: tuple[float, float, float]) -> str:
    return " ".join(repr(float(value)) for value in values)
