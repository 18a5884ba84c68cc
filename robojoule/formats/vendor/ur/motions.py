"""Motions of URScript: their parameters, targets and speeds."""

from __future__ import annotations

from dataclasses import dataclass

from robojoule.formats.vendor.lines import Line
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import JointTarget, Kind, PoseTarget, Speed
from robojoule.formats.vendor.ur.expressions import Pose, six_numbers
from robojoule.formats.vendor.values import Number, Value, number
from robojoule.robots.rigid_body import Placement

# Parameters of motions by their places, and what they are if they are left out.
MOTIONS: dict[str, tuple[Kind, tuple[str, ...], dict[str, float]]] = {
    "movej": ("joint", ("q", "a", "v", "t", "r"), {"a": 1.4, "v": 1.05, "t": 0.0, "r": 0.0}),
    "movel": ("linear", ("pose", "a", "v", "t", "r"), {"a": 1.2, "v": 0.25, "t": 0.0, "r": 0.0}),
    "movep": ("linear", ("pose", "a", "v", "r"), {"a": 1.2, "v": 0.25, "r": 0.0}),
    "movec": ("circular", ("pose_via", "pose_to", "a", "v", "r", "mode"), {"a": 1.2, "v": 0.25, "r": 0.0}),
}


@dataclass(frozen=True)
class Call:
    """A motion's call: where its parameters stand.

    Attributes:
        line: Its line.
        name: Name of the function.
        given: Where each parameter's value stands.
        inside: The last character of what stands within its parentheses, and whether parameters there have names.
    """

    line: Line
    name: str
    given: dict[str, Span]
    inside: int
    is_named: bool


def target_of(value: Value, tool: Placement | None, base: Placement | None) -> JointTarget | PoseTarget | None:
    """Where a motion ends; None where that is not known."""
    joints = six_numbers(value)
    if joints is not None:
        return JointTarget(joints)
    if not isinstance(value, Pose):
        return None
    x, y, z = value.place.origin_m.tolist()
    return PoseTarget(
        (x, y, z),
        value.place.rotation,
        tool=tool,
        base=base or Placement.identity(),
        near_rad=value.near_rad,
        nearest=True,
        unknown="the TCP" if tool is None else "",
    )


def speed_of(kind: Kind, values: dict[str, Value]) -> Speed:
    """Speed by `t`, or else by `v` and `a`."""
    duration, speed, acceleration = (number(values.get(key, Number(0.0))) for key in ("t", "v", "a"))
    if duration is None:
        return Speed(writable=False)
    if duration > 0.0:
        return Speed(duration_s=duration, writable=kind == "joint")
    if speed is None or speed <= 0.0:
        return Speed(writable=False)
    if kind == "joint":
        return Speed(leading_rad_s=speed)
    if acceleration is not None and acceleration < 0.0:
        return Speed(writable=False)
    return Speed(tool_m_s=speed, tool_m_s2=acceleration or None, writable=False)


def label_of(text: str) -> str:
    """What a program calls its target: the name of a variable, without what marks joints and poses."""
    name = text.removeprefix("get_inverse_kin(").split(",")[0].strip("() ")
    return name.removesuffix("_q").removesuffix("_p") if name.isidentifier() else ""
