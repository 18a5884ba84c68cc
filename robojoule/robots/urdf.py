"""Robots from a URDF: kinematics, limits and inertia from it, the rest from a short drive file beside it.

A URDF knows nothing of drives, so `arm.urdf` needs a drive file, `arm.drives.yaml` (or .yml, .json) beside it unless
named otherwise:

    rated_payload_kg: 5
    home_rad: [0, -1.57, 1.57]
    tool: {parent: flange, origin_xyz_m: [0, 0, 0], origin_rpy_rad: [0, 0, 0]}
    limits:                                   # what the URDF lacks; continuous joints need lower_rad and upper_rad
      joint_1: {lower_rad: -6.28, upper_rad: 6.28}
    links:                                    # counts instead of the URDF's <inertial>
      link_1: {mass_kg: 8, com_m: [0, 0, 0.2], inertia_kg_m2: {ixx: .1, ixy: 0, ixz: 0, iyy: .1, iyz: 0, izz: .03}}
    freeze: {gripper_joint: 0.02}             # joints of any type that stand still, with their positions [rad or m]
    drives: ...                               # as in a robot file

Revolute, continuous and fixed joints between the base and the tool make a serial arm of any length; what else moves
is held still (`robojoule.robots.urdf_chain`). Positions of a continuous joint are not wrapped: the limits of the drive
file count, as cables and programs have limits even where the gear has none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar
from xml.etree import ElementTree

from pydantic import Field

from robojoule.documents import Document, check_file, load, write_document, write_text
from robojoule.errors import InputError, refuse
from robojoule.robots.controller_file import ControllerFile
from robojoule.robots.pendant_file import PendantFile
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
from robojoule.robots.robot_loading import robot_file_of
from robojoule.robots.standby import StandbyFile
from robojoule.robots.urdf_chain import chain_of
from robojoule.robots.urdf_elements import LIMITS, UrdfJoint, attribute, read_joint, read_link, read_xml

DRIVE_FILE_SUFFIXES = (".drives.yaml", ".drives.yml", ".drives.json")
MOST_JOINTS = 500
E = TypeVar("E")


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
    links: dict[str, LinkFile] = Field(default_factory=dict)
    freeze: dict[str, float] = Field(default_factory=dict)
    capsules: dict[str, list[CapsuleFile]] = Field(default_factory=dict)
    pendant: PendantFile | None = None
    drives: DrivesFile
    controller: ControllerFile | None = None
    standby: StandbyFile | None = None
    derived_from: str | None = None


def load_urdf(path: str | Path, drives: str | Path | None = None) -> RobotFile:
    """Read a URDF with its drive file.

    Args:
        path: The URDF.
        drives: The drive file; if not given, the one beside the URDF.

    Raises:
        InputError: No drive file, a broken URDF, joints that make no serial arm, or figures that are missing or
            impossible; all of them at once.
    """
    path = Path(path)
    companion = _drive_file_beside(path) if drives is None else Path(drives)
    root = read_xml(path)
    extra = load(UrdfDriveFile, companion)
    errors: list[InputError] = []
    joints = read_joints(root, path, errors)
    links: dict[str, Any] = read_links(root, path, errors)
    links |= {name: link.model_dump() for name, link in extra.links.items() if name in links}
    known = {"joint": [joint.name for joint in joints], "link": list(links)}
    for kind, key, names in (
        ("joint", "limits", extra.limits),
        ("joint", "freeze", extra.freeze),
        ("link", "links", extra.links),
    ):
        for name in sorted(set(names) - set(known[kind])):
            problem = f"there is no {kind} '{name}'"
            errors.append(InputError(problem, file=companion, key=key, allowed=", ".join(known[kind])))
    if extra.tool.parent not in links:
        problem = f"there is no link '{extra.tool.parent}'"
        errors.append(InputError(problem, file=companion, key="tool.parent", allowed=", ".join(links)))
    refuse(errors)  # what follows needs joints and links by their names

    root_link = root_link_of(links, joints, path)
    chain = chain_of(
        joints, extra.tool.parent, extra.freeze, extra.drives.joints, path, f"freeze.{{}} in {companion.name}"
    )
    own_limits = {name: limits.model_dump(exclude_none=True) for name, limits in extra.limits.items()}
    name = extra.name or root.get("name") or path.stem
    data = extra.model_dump(exclude={"limits", "freeze"}) | {
        "name": name,
        "model": extra.model or name,
        "source": extra.source or f"{path.name} and {companion.name}",
        "root_link": root_link,
        "links": links,
        "joints": joints_from_the_base(chain.joints, root_link, own_limits),
        "lumped_branches": chain.lumped,
    }
    return robot_file_of(data, urdf_source(path, companion), chain.errors, companion.name)


def read_joints(root: ElementTree.Element, path: Path, errors: list[InputError]) -> list[UrdfJoint]:
    """The joints of a URDF; those that cannot be read go to the errors."""
    elements = root.findall("joint")
    if len(elements) > MOST_JOINTS:
        raise InputError(f"the URDF has {len(elements)} joints", file=path, allowed=f"at most {MOST_JOINTS}")
    read = (_or_error(read_joint, element, path, errors) for element in elements)
    joints = [joint for joint in read if joint is not None]
    errors += _doubled("joint", [joint.name for joint in joints], path)
    return joints


def read_links(root: ElementTree.Element, path: Path, errors: list[InputError]) -> dict[str, Any]:
    """The inertial figures of a URDF's links, by name; those that cannot be read go to the errors."""
    elements = root.findall("link")
    names = [_or_error(_link_name, element, path, errors) for element in elements]
    errors += _doubled("link", [name for name in names if name is not None], path)
    return {
        name: _or_error(read_link, element, path, errors)
        for name, element in zip(names, elements, strict=True)
        if name is not None
    }


def _link_name(element: ElementTree.Element, path: Path) -> str:
    return attribute(element, "name", path, "link")


def _or_error(
    read: Callable[[ElementTree.Element, Path], E], element: ElementTree.Element, path: Path, errors: list[InputError]
) -> E | None:
    try:
        return read(element, path)
    except InputError as error:
        errors.append(error)
        return None


def _doubled(kind: str, names: Sequence[str], path: Path) -> Iterable[InputError]:
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            yield InputError(f"there are {names.count(name)} {kind}s '{name}'", file=path, allowed="unique names")


def joints_from_the_base(
    joints: Sequence[UrdfJoint], root: str, limits: Mapping[str, Mapping[str, float]] | None = None
) -> list[dict[str, Any]]:
    """Joints as a robot file has them, in order from the base: URDFs may list them in any order.

    Args:
        joints: Joints that turn or stand still; those that hang nowhere come last.
        root: The base.
        limits: Limits that count instead of the URDF's, by joint.
    """
    ordered: list[UrdfJoint] = []
    reached, pending = {root}, list(joints)
    while pending:
        joint = next((joint for joint in pending if joint.parent in reached), None)
        if joint is None:
            ordered += pending
            break
        pending.remove(joint)
        reached.add(joint.child)
        ordered.append(joint)
    return [_joint_data(joint, (limits or {}).get(joint.name, {})) for joint in ordered]


def _joint_data(joint: UrdfJoint, limits: Mapping[str, float]) -> dict[str, Any]:
    data: dict[str, Any] = {
        "name": joint.name,
        "type": "fixed" if joint.kind == "fixed" else "revolute",
        "parent": joint.parent,
        "child": joint.child,
        "origin_xyz_m": joint.xyz_m,
        "origin_rpy_rad": joint.rpy_rad,
        "axis": joint.axis,
    }
    return data if joint.kind == "fixed" else {**data, **joint.limits, **limits}


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
    keys = UrdfDriveFile.model_fields.keys() - {"limits", "links", "freeze"}
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
        allowed=f"{candidates[0].name} beside it; `robojoule robots scale` writes one",
    )


def root_link_of(links: dict[str, Any], joints: Sequence[UrdfJoint], path: Path) -> str:
    """The link that all others hang on.

    Raises:
        InputError: There is none, or more than one.
    """
    if not links:
        raise InputError("the URDF has no links", file=path)
    children = {joint.child for joint in joints}
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        found = f"the root links {', '.join(roots)}" if roots else "no root link"
        raise InputError(f"the URDF has {found}", file=path, allowed="exactly one link that is not a joint's child")
    return roots[0]


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
        limits = {attribute: repr(getattr(joint, field)) for field, attribute in LIMITS.items()}
        ElementTree.SubElement(element, "limit", limits)


def _text(values: tuple[float, float, float]) -> str:
    return " ".join(repr(float(value)) for value in values)
