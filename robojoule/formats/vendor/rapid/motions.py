"""Motion instructions of RAPID: their arguments, targets, speeds and zones."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from lark import Token

from robojoule.formats.vendor.rapid.data import (
    EXTERNAL,
    NOT_USED,
    floats,
    rotation_of,
    tool_of,
    work_object_of,
)
from robojoule.formats.vendor.rapid.expressions import Variables, arguments_of, value_of
from robojoule.formats.vendor.rapid.syntax import Node, Statement
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import Beside, Blend, JointTarget, Kind, Motion, PoseTarget, Speed
from robojoule.formats.vendor.values import Number, Value, number
from robojoule.formats.vendor.zones import ASSUMED_BLEND
from robojoule.robots.arm_configuration import QuarterTurns
from robojoule.robots.rigid_body import Placement

_MM = 1e-3


@dataclass(frozen=True)
class Form:
    """Where the arguments of a motion instruction stand, counted from 0.

    Attributes:
        kind: Along what it moves.
        is_absolute: Whether its target is one of joint angles.
        via: Place of the point on the circle; None: there is none.
        zone: Place of the zone, from behind where negative; None: it has none, the robot stops.
    """

    kind: Kind
    is_absolute: bool = False
    via: int | None = None
    zone: int | None = 2


FORMS = {
    "MOVEABSJ": Form("joint", is_absolute=True),
    "MOVEJ": Form("joint"),
    "MOVEJDO": Form("joint"),
    "MOVEJAO": Form("joint"),
    "MOVEJSYNC": Form("joint"),
    "TRIGGJ": Form("joint", zone=-2),
    "TRIGGJIOS": Form("joint"),
    "MOVEL": Form("linear"),
    "MOVELDO": Form("linear"),
    "MOVELAO": Form("linear"),
    "MOVELSYNC": Form("linear"),
    "TRIGGL": Form("linear", zone=-2),
    "TRIGGLIOS": Form("linear"),
    "ARCL": Form("linear", zone=-2),
    "ARCLSTART": Form("linear", zone=-2),
    "ARCLEND": Form("linear", zone=-2),
    "SPOTL": Form("linear", zone=None),
    "SPOTJ": Form("joint", zone=None),
    "DISPL": Form("linear", zone=-2),
    "MOVEC": Form("circular", via=0, zone=3),
    "MOVECDO": Form("circular", via=0, zone=3),
    "MOVECSYNC": Form("circular", via=0, zone=3),
    "TRIGGC": Form("circular", via=0, zone=-2),
    "ARCC": Form("circular", via=0, zone=-2),
    "ARCCEND": Form("circular", via=0, zone=-2),
}
_TOOL_BEHIND_ZONE = 1


@dataclass
class Setting:
    """What holds for all motions from where it is said on.

    Attributes:
        configured: Whether joint motions go to the configuration of their target (ConfJ).
        path_configured: Whether motions of the tool along a path do (ConfL).
        velocity_share: Share of the programmed velocities that is used (VelSet); None: not known. [-]
        most_m_s: Largest velocity of the tool (VelSet). [m/s]
        is_displaced: Whether places of the tool are displaced, or may be (PDispOn, PDispSet).
    """

    configured: bool = True
    path_configured: bool = True
    velocity_share: float | None = 1.0
    most_m_s: float = math.inf
    is_displaced: bool = False


@dataclass(frozen=True)
class Reading:
    """A motion instruction as it was understood.

    Attributes:
        motion: The motion.
        place: Where its duration stands, or, where it has none, the empty place behind its speed; None: nowhere.
        tool: Value of the tool's data.
    """

    motion: Motion
    place: Span | None
    tool: Value


def read_motion(statement: Statement, tree: Node, variables: Variables, setting: Setting, beside: Beside) -> Reading:
    """What a motion instruction of `FORMS` does."""
    form = FORMS[str(tree.children[0]).upper()]
    plain, named = arguments_of(tree)
    at = 0 if form.via is None else 1
    nodes: list[Node | Token | None] = [*plain, *[None] * 8]
    values = [None if node is None else value_of(node, statement, variables) for node in nodes]
    zone_at = len(plain) + form.zone if form.zone is not None and form.zone < 0 else form.zone
    tool_at = len(plain) - 1 if zone_at is None else zone_at + _TOOL_BEHIND_ZONE
    label = "" if nodes[at] is None else _label(statement, nodes[at])
    frames = _Frames(statement, nodes[tool_at], named.get("WOBJ"), values[tool_at], variables, beside)
    target, reason = _target(values[at], frames, form, setting, label or "the target")
    via = _target(values[0], frames, form, setting, label)[0] if form.via is not None else None
    speed, place = _speed(statement, nodes[at + 1], values[at + 1], named, variables, setting, form.kind == "joint")
    if "CONC" in named or "ID" in named:
        speed, place = replace(speed, writable=False), None
    motion = Motion(
        statement=statement.start,
        line=statement.line,
        label=label,
        kind=form.kind,
        target=target,
        speed=speed,
        blend=_blend(values[zone_at], named, variables, statement) if zone_at is not None else None,
        via=via if isinstance(via, PoseTarget) else None,
        reason=reason,
        tool=frames.tool,
    )
    return Reading(motion, place if speed.writable else None, values[tool_at])


def _label(statement: Statement, node: Node | Token | None) -> str:
    """What the program calls the target; a target that is written out has no name."""
    if isinstance(node, Token) or node is None or node.data not in ("ref", "function"):
        return ""
    text = " ".join(statement.text(node).split())
    return text if len(text) <= 60 and text.isprintable() else ""


class _Frames:
    """Tool and work object of one motion."""

    def __init__(
        self,
        statement: Statement,
        tool: Node | Token | None,
        work_object: Node | Token | None,
        tool_value: Value,
        variables: Variables,
        beside: Beside,
    ) -> None:
        name = "the tool" if tool is None else _label(statement, tool) or "the tool"
        self.tool = tool_of(tool_value) or beside.tools.get(name) or beside.tool
        missing = [] if self.tool is not None else [name]
        self.base: Placement | None = Placement.identity()
        if work_object is not None:
            name = _label(statement, work_object) or "the work object"
            found = work_object_of(value_of(work_object, statement, variables))
            self.base = found or beside.bases.get(name) or beside.base
            missing += [] if self.base is not None else [name]
        self.unknown = " and ".join(missing)


def _target(
    value: Value, frames: _Frames, form: Form, setting: Setting, what: str
) -> tuple[JointTarget | PoseTarget | None, str]:
    """Where a motion ends, or why that is not known."""
    outside = _external(value[-1]) if isinstance(value, list) and len(value) in (2, 4) else None
    if outside is None:
        return None, f"{what} is known only while the program runs"
    if form.is_absolute:
        angles = floats(value[0], 6) if len(value) == 2 else None
        if angles is None:
            return None, f"{what} is known only while the program runs"
        return JointTarget(tuple(map(math.radians, angles)), external=outside), ""
    if setting.is_displaced:
        return None, f"{what} is displaced by a program displacement (PDispOn, PDispSet), which is not followed"
    origin, rotation = (floats(value[0], 3), rotation_of(value[1])) if len(value) == 4 else (None, None)
    if origin is None or rotation is None:
        return None, f"{what} is known only while the program runs"
    x, y, z = (part * _MM for part in origin)
    configured = setting.configured if form.kind == "joint" else setting.path_configured
    quarters = floats(value[2], 4) if configured else None
    return PoseTarget(
        (x, y, z),
        rotation,
        tool=frames.tool,
        base=frames.base,
        configuration=None if quarters is None else QuarterTurns(*(int(part) for part in quarters)),
        external=outside,
        unknown=frames.unknown,
    ), ""


def _external(value: Value) -> dict[str, float] | None:
    """Positions of external axes that are used; None: one of them is not known."""
    positions = floats(value, len(EXTERNAL))
    if positions is None:
        return None
    return {name: one for name, one in zip(EXTERNAL, positions, strict=True) if abs(one) < NOT_USED}


def _speed(
    statement: Statement,
    node: Node | Token | None,
    value: Value,
    named: dict[str, Node | Token | None],
    variables: Variables,
    setting: Setting,
    is_joint: bool,
) -> tuple[Speed, Span | None]:
    """How fast a motion is, and where that is to be written."""
    timed = named.get("T")
    if timed is not None:
        seconds = value_of(timed, statement, variables)
        is_literal = isinstance(seconds, Number) and seconds.origin == statement.span(timed)
        amount = number(seconds)
        if amount is None or amount <= 0.0:
            return Speed(writable=False), None
        place = statement.span(timed)
        return Speed(duration_s=amount, writable=is_literal and is_joint), place
    figures = floats(value, 4)
    if figures is None or figures[0] <= 0.0 or setting.velocity_share is None:
        return Speed(writable=False), None
    own = number(value_of(named["V"], statement, variables)) if named.get("V") is not None else None  # type: ignore[arg-type]
    tool_m_s = min((own or figures[0]) * _MM * setting.velocity_share, setting.most_m_s)
    around = math.radians(figures[1]) * setting.velocity_share
    is_writable = is_joint and "V" not in named and node is not None
    speed = Speed(tool_m_s=tool_m_s, tool_rad_s=around if around > 0.0 else None, writable=is_writable)
    if not is_writable or node is None:
        return speed, None
    end = statement.span(node).end
    return speed, Span(end, end)


def _blend(
    value: Value, named: dict[str, Node | Token | None], variables: Variables, statement: Statement
) -> Blend | None:
    """How a motion is blended; None: it stops at its target."""
    record = value if isinstance(value, list) and len(value) == 7 else None
    if value is None or (record is not None and record[0] is True):
        return None
    own = named.get("Z")
    if own is not None:
        radius = number(value_of(own, statement, variables))
    else:
        radius = number(record[1]) if record is not None and record[0] is False else None
    if radius is None:
        return ASSUMED_BLEND
    return Blend(radius_m=radius * _MM) if radius else None
