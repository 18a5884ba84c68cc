"""Targets, speeds and zones of KRL motions."""

from __future__ import annotations

import math
from collections.abc import Mapping

from robojoule.errors import InputError
from robojoule.formats.vendor.krl.expressions import Variables
from robojoule.formats.vendor.krl.geometry import frame_of
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import Beside, Blend, JointTarget, PoseTarget, Speed
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number, numbers
from robojoule.formats.vendor.zones import ASSUMED_BLEND
from robojoule.robots.arm_configuration import StatusAndTurn
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload

AXIS_NAMES = ("A1", "A2", "A3", "A4", "A5", "A6")
EXTERNAL_NAMES = ("E1", "E2", "E3", "E4", "E5", "E6")
APO_MODE = ("$APO", "MODE")  # whether the distance of motion data is one in mm, kept beside the distances


class Frames:
    """Tool and base as the program sets them."""

    def __init__(self, beside: Beside) -> None:
        self.beside = beside
        self.known: dict[str, Placement | None] = {}
        self.overwritten: set[str] = set()  # arrays of which nobody knows what they say
        self.tool: Placement | None = beside.tool
        self.base: Placement | None = beside.base
        self.tool_name = "the tool"
        self.base_name = "the base"
        self.tool_number = ""
        self.tool_settings = 0

    def reset(self) -> None:
        """As after BAS(#INITMOV, 0): the flange in the robot's own base frame."""
        self.set_tool(Number(0.0))
        self.set_base(Number(0.0))

    def define(self, name: str, value: Value) -> None:
        """TOOL_DATA[n] or BASE_DATA[n] is set in the program."""
        self.known[name] = frame_of(value)

    def overwrite(self, array: str) -> None:
        """Some of TOOL_DATA or BASE_DATA is set, nobody knows which, or to what."""
        self.overwritten.add(array)

    def set_tool(self, value: Value) -> None:
        """Tool by its number."""
        which = number(value)
        self.tool_settings += 1
        self.tool_number = "" if which is None else f"{which:g}"
        self.tool, self.tool_name = self._numbered("TOOL_DATA", value, self.beside.tools, self.beside.tool)

    def set_base(self, value: Value) -> None:
        """Base by its number."""
        self.base, self.base_name = self._numbered("BASE_DATA", value, self.beside.bases, self.beside.base)

    def _numbered(
        self, array: str, value: Value, named: Mapping[str, Placement], given: Placement | None
    ) -> tuple[Placement | None, str]:
        which = number(value)
        if which is None:
            return given, f"the {array[:4].lower()}"
        name, key = f"{array}[{which:g}]", f"{which:g}"
        if which == 0.0:
            return Placement.identity(), name
        if array in self.overwritten:
            return given, name
        if key in named:
            return named[key], name
        return (self.known[name] if self.known.get(name) is not None else given), name

    def present(self, root: str, name: str, value: Value) -> None:
        """$TOOL or $BASE is set, from a variable of some name or from a value."""
        array = "TOOL_DATA[" if root == "$TOOL" else "BASE_DATA["
        if name.startswith(array):
            index = name[len(array) : -1]
            which = Number(float(index)) if index.isdecimal() else UNKNOWN
            if root == "$TOOL":
                self.set_tool(which)
            else:
                self.set_base(which)
            return
        frame = frame_of(value)
        if root == "$TOOL":
            self.tool, self.tool_name = frame or self.beside.tool, name or "$TOOL"
        else:
            self.base, self.base_name = frame or self.beside.base, name or "$BASE"

    def take(self, data: Mapping[str, Value]) -> None:
        """Tool and base of motion data; on a tool that stands beside the robot, neither is known."""
        if data.get("IPO_FRAME") == "#TCP":
            self.tool, self.tool_name = None, "the tool beside the robot"
            return
        self.set_tool(data.get("TOOL_NO"))
        self.set_base(data.get("BASE_NO"))

    def unknown(self) -> str:
        """What is not known of tool and base, for messages."""
        missing = [(self.tool, self.tool_name), (self.base, self.base_name)]
        return " and ".join(name for frame, name in missing if frame is None)


def payload_of(value: Value) -> Payload | None:
    """A LOAD: mass in kg, centre of mass on the flange in mm, inertia in kg m2; None where it is not known."""
    mass = number(value.get("M")) if isinstance(value, Mapping) else None
    if mass is None or mass < 0.0:
        return None
    center, inertia = value.get("CM"), value.get("J")
    place = numbers(center, "X", "Y", "Z") if isinstance(center, Mapping) else (0.0, 0.0, 0.0)
    about = numbers(inertia, "X", "Y", "Z") if isinstance(inertia, Mapping) else (0.0, 0.0, 0.0)
    if place is None or about is None:
        return None
    x, y, z = ((one or 0.0) / 1e3 for one in place)
    moments = tuple(one or 0.0 for one in about)
    try:
        return Payload(mass, (x, y, z), moments if any(moments) else None)
    except InputError:
        return None


def target_of(
    kind: str, value: Value, frames: Frames, what: str, in_tool: bool
) -> tuple[JointTarget | PoseTarget | None, str]:
    """Where a motion ends, or why that is not known."""
    if not isinstance(value, Mapping):
        known = frames.beside.positions_rad.get(what.upper())
        return (None, f"{what} is not in the program's files") if known is None else (JointTarget(known), "")
    relative = kind.endswith("_REL")
    outer = numbers(value, *EXTERNAL_NAMES)
    external = {} if outer is None else {n: v for n, v in zip(EXTERNAL_NAMES, outer, strict=True) if v is not None}
    if any(name in value for name in AXIS_NAMES):
        axes = numbers(value, *AXIS_NAMES)
        if axes is None or outer is None:
            return None, f"{what} is computed while the program runs"
        angles = tuple(None if one is None else math.radians(one) for one in axes)
        return JointTarget(angles, relative, external), ""
    place, turn = numbers(value, "X", "Y", "Z"), numbers(value, "A", "B", "C")
    if place is None or turn is None or outer is None:
        return None, f"{what} is computed while the program runs"
    if set(turn) != {None} and None in turn:
        return None, f"{what} gives a part of an orientation only"
    rotation = None
    if None not in turn:
        a, b, c = (math.radians(value) for value in turn if value is not None)
        rotation = Placement.of((0.0, 0.0, 0.0), (c, b, a)).rotation
        if relative and any(turn):
            return None, f"{what} turns the tool relative to where it is"
    x, y, z = (None if value is None else value / 1e3 for value in place)
    bits = numbers(value, "S", "T")
    status, ways = bits if bits is not None else (None, None)
    return (
        PoseTarget(
            (x, y, z),
            None if relative else rotation,
            tool=frames.tool,
            base=frames.base,
            configuration=None if status is None else StatusAndTurn(int(status), None if ways is None else int(ways)),
            relative=("tool" if in_tool else "base") if relative else "",
            external=external,
            unknown=frames.unknown(),
        ),
        "",
    )


def speed_of(axes: list[Value]) -> tuple[Speed, Span | None]:
    """Speed of a joint motion by the velocities of its axes, and where it stands as one number."""
    found = [None if axis is None else number(axis) for axis in axes]
    if all(axis is None for axis in axes):
        return Speed(), None
    known = [value for value in found if value is not None]
    if len(known) < len(found):
        return Speed(writable=False), None
    percent = min(known)
    if len(set(known)) > 1 or percent <= 0.0:
        return Speed(percent=percent if percent > 0.0 else None, writable=False), None
    origins = {axis.origin for axis in axes if isinstance(axis, Number)}
    return Speed(percent=percent), origins.pop() if len(origins) == 1 else None


def path_speed_of(told: Mapping[str, Value], variables: Variables) -> Speed:
    """Speed of a motion of the tool along a path: m/s, m/s2, degrees/s."""
    speed = number(told["$VEL.CP"]) if "$VEL.CP" in told else number(variables.get(("$VEL", "CP")))
    acceleration = number(variables.get(("$ACC", "CP")))
    turn = number(variables.get(("$VEL", "ORI1")))
    return Speed(
        tool_m_s=speed,
        tool_m_s2=acceleration if acceleration and acceleration > 0.0 else None,
        tool_rad_s=math.radians(turn) if turn and turn > 0.0 else None,
        writable=False,
    )


def blend_of(words: list[str], *, is_joint: bool, told: Mapping[str, Value], variables: Variables) -> Blend | None:
    """How a motion is blended; None: it stops at its target; `ASSUMED_BLEND`: the program does not say how far."""
    if not words:
        return None
    data = told.get("data")
    if isinstance(data, Mapping):
        distance, mode = number(data.get("APO_DIST")), data.get("APO_MODE")
        in_percent = mode != "#CDIS"
    else:
        in_mm = variables.get(APO_MODE) == "#CDIS"
        in_percent = is_joint and not in_mm and not any(word != "C_PTP" for word in words)
        distance = number(variables.get(("$APO", "CPTP" if in_percent else "CDIS")))
    if distance is None:
        return ASSUMED_BLEND
    return Blend(share=min(distance / 100.0, 1.0)) if in_percent else Blend(radius_m=distance / 1e3)
