"""The elements of a URDF as plain data: links, and joints of every type that the format knows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from robojoule.documents import read_bytes, reason
from robojoule.errors import InputError
from robojoule.inputs import LARGEST, number_of
from robojoule.robots.rigid_body import Placement, RigidBody

Vector = tuple[float, float, float]
JOINT_TYPES = ("revolute", "continuous", "fixed", "prismatic", "floating", "planar")
LIMITS = {"lower_rad": "lower", "upper_rad": "upper", "velocity_rad_s": "velocity", "effort_nm": "effort"}
MOST_LIMIT = 1e20  # files of arms without a limit give 1e16 and the like
XACRO = "the output of `xacro FILE > arm.urdf` (xacro comes with ROS)"


@dataclass(frozen=True)
class UrdfJoint:
    """A joint as it stands in a URDF.

    Attributes:
        name: Its name.
        kind: Its type, one of `JOINT_TYPES`.
        parent: Link that it hangs on.
        child: Link that it moves.
        xyz_m: Origin in the parent link. [m]
        rpy_rad: Turn of its frame. [rad]
        axis: Axis in its frame.
        limits: Attributes of <limit> by their keys in a robot file; of prismatic joints in m and N. [rad, rad/s, Nm]
        mimics: Joint that it follows, factor and offset, if it follows one.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz_m: Vector
    rpy_rad: Vector
    axis: Vector
    limits: dict[str, float]
    mimics: tuple[str, float, float] | None = None


def read_xml(path: Path) -> ElementTree.Element:
    """The root element of a URDF.

    Raises:
        InputError: The file cannot be read, or is something else, such as a xacro file.
    """
    content = read_bytes(path)
    try:
        root = ElementTree.fromstring(content)  # the file says its encoding
    except (ValueError, LookupError, ElementTree.ParseError) as error:
        if b"xacro:" in content:
            raise xacro_error(path) from None
        raise InputError(f"the file cannot be read ({reason(error)})", file=path) from None
    if any("xacro" in element.tag for element in root.iter()):
        raise xacro_error(path)
    if root.tag != "robot":
        raise InputError(f"the root element is <{root.tag}>", file=path, allowed="<robot>: a URDF")
    return root


def xacro_error(path: Path) -> InputError:
    """The refusal of a xacro file, with the command that makes a URDF of it."""
    return InputError("this is a xacro file, not a URDF", file=path, allowed=XACRO)


def read_joint(element: ElementTree.Element, path: Path) -> UrdfJoint:
    """A joint.

    Raises:
        InputError: Something that the format requires is missing or not a number.
    """
    name = attribute(element, "name", path, "joint")
    key = f"joint '{name}'"
    kind = attribute(element, "type", path, key)
    if kind not in JOINT_TYPES:
        raise InputError(f"unknown joint type '{kind}'", file=path, key=key, allowed=", ".join(JOINT_TYPES))
    xyz, rpy = _origin(element, path, key)
    return UrdfJoint(
        name=name,
        kind=kind,
        parent=attribute(_child(element, "parent", path, key), "link", path, key),
        child=attribute(_child(element, "child", path, key), "link", path, key),
        xyz_m=xyz,
        rpy_rad=rpy,
        axis=_vector(element.find("axis"), "xyz", (1.0, 0.0, 0.0), path, key),
        limits=_limits(element.find("limit"), kind, path, key),
        mimics=_mimicry(element.find("mimic"), path, key),
    )


def _limits(limit: ElementTree.Element | None, kind: str, path: Path, key: str) -> dict[str, float]:
    if limit is None:
        return {}
    found = {}
    for field, name in LIMITS.items():
        positional = field in ("lower_rad", "upper_rad")
        if positional and kind == "continuous":
            continue
        # The URDF specification lets a missing position limit be 0; velocity and effort have no default.
        text = limit.get(name, "0" if positional else None)
        if text is not None:
            found[field] = _number(text, path, f"{key} limit {name}", MOST_LIMIT)
    return found


def _mimicry(mimic: ElementTree.Element | None, path: Path, key: str) -> tuple[str, float, float] | None:
    if mimic is None:
        return None
    factor, offset = (
        _number(mimic.get(name, default), path, f"{key} {name}")
        for name, default in (("multiplier", "1"), ("offset", "0"))
    )
    return attribute(mimic, "joint", path, key), factor, offset


def read_link(element: ElementTree.Element, path: Path) -> dict[str, Any] | None:
    """Inertial figures of a link as a robot file has them, None where it has none.

    Raises:
        InputError: Something that the format requires is missing or not a number.
    """
    inertial = element.find("inertial")
    if inertial is None:
        return None
    key = f"link '{element.get('name')}'"
    xyz, rpy = _origin(inertial, path, key)
    tensor = _child(inertial, "inertia", path, key)
    figures = {
        name: _number(attribute(tensor, name, path, key), path, f"{key} {name}")
        for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    }
    mass = _number(attribute(_child(inertial, "mass", path, key), "value", path, key), path, f"{key} mass")
    return {"mass_kg": mass, "com_m": xyz, "inertia_kg_m2": _turned(figures, rpy)}


def _turned(tensor: dict[str, float], rpy: Vector) -> dict[str, float]:
    """Inertia in link axes: R I R^T of a tensor that is given in axes turned by roll, pitch and yaw."""
    if not any(rpy):
        return tensor  # exactly: files written here are read back to the bit
    rows = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
    given = RigidBody(0.0, np.zeros(3), np.array([[tensor[name] for name in row] for row in rows]))
    turned = given.placed(Placement.of((0.0, 0.0, 0.0), rpy)).inertia_kg_m2
    return {name: float(turned[i, j]) for i, row in enumerate(rows) for j, name in enumerate(row) if j >= i}


def _origin(element: ElementTree.Element, path: Path, key: str) -> tuple[Vector, Vector]:
    origin = element.find("origin")
    zero = (0.0, 0.0, 0.0)
    return _vector(origin, "xyz", zero, path, key), _vector(origin, "rpy", zero, path, key)


def _vector(element: ElementTree.Element | None, name: str, default: Vector, path: Path, key: str) -> Vector:
    text = None if element is None else element.get(name)
    if text is None:
        return default
    values = [_number(part, path, f"{key} {name}") for part in text.split()]
    if len(values) != 3:
        raise InputError(f"{name} is '{text}'", file=path, key=key, allowed="three numbers")
    return values[0], values[1], values[2]


def _number(text: str, path: Path, key: str, most: float = LARGEST) -> float:
    try:
        return number_of(text, most)
    except ValueError as error:
        raise InputError(str(error), file=path, key=key) from None


def _child(element: ElementTree.Element, tag: str, path: Path, key: str) -> ElementTree.Element:
    child = element.find(tag)
    if child is None:
        raise InputError(f"<{tag}> is missing", file=path, key=key)
    return child


def attribute(element: ElementTree.Element, name: str, path: Path, key: str) -> str:
    """An attribute that an element must have.

    Raises:
        InputError: It has none.
    """
    value = element.get(name)
    if value is None:
        raise InputError(f"<{element.tag}> lacks the attribute {name}", file=path, key=key)
    return value
