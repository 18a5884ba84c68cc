"""What a vendor's program does, in words that all vendors share.

A vendor's module runs its program as far as constants reach and gives the events in the order in which they happen:
fixed-count loops are unrolled, subprograms of the same file inlined, so the same statement may give several events.
Angles are those of the pendant, as they stand in the file; everything is in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Literal, Protocol

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.formats.vendor.text import Edit, SourceText, Span
from robojoule.inputs import LARGEST, shown
from robojoule.robots.arm_configuration import Configuration
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload

_MOST_LINES = 8  # that are named where a note holds for more
Kind = Literal["joint", "linear", "circular"]


class NeedsRobot(InputError):
    """A program says something that only the figures of a robot explain."""


@dataclass(frozen=True)
class JointTarget:
    """Joint angles to go to.

    Attributes:
        angles_rad: Angles of the pendant, one per joint; None: the joint stays where it is. [rad]
        relative: Whether they are added to the present ones.
        external: Positions of external axes by their names; those that are not named stand still.
    """

    angles_rad: tuple[float | None, ...]
    relative: bool = False
    external: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class PoseTarget:
    """A place of the tool in the base.

    Attributes:
        position_m: Coordinates; None: that one stays as it is. [m]
        rotation: Axes of the tool in the base, shape (3, 3); None: they stay as they are. [-]
        tool: The tool in the flange's frame; None: it is not known.
        base: The base in the robot's own base frame; None: it is not known.
        configuration: Which solution is meant; None: the one nearest to the position before.
        near_rad: Joint angles of the pendant near which the solution is; None: those before the motion. [rad]
        nearest: Whether the language says that the solution nearest to the point before is meant.
        relative: Whether the place is one in axes of the present tool place: "base" adds the position along the axes
            of the base, "tool" along those of the tool.
        external: Positions of external axes by their names.
        unknown: What is not known of tool or base, for messages ("tool 3").
    """

    position_m: tuple[float | None, float | None, float | None]
    rotation: Array | None
    tool: Placement | None = None
    base: Placement | None = None
    configuration: Configuration | None = None
    near_rad: tuple[float, ...] | None = None
    nearest: bool = False
    relative: Literal["", "base", "tool"] = ""
    external: Mapping[str, float] = field(default_factory=dict)
    unknown: str = ""


@dataclass(frozen=True)
class Speed:
    """How fast a motion is, in the figures that its program gives; none: not known.

    Attributes:
        percent: Share of the joint velocity limits. [%]
        leading_rad_s: Velocity of the joint that turns farthest. [rad/s]
        tool_m_s: Velocity of the tool. [m/s]
        tool_m_s2: Its acceleration, where the program says it. [m/s2]
        tool_rad_s: Velocity at which the tool turns, where the program says it. [rad/s]
        duration_s: Duration of the motion, which overrules the others. [s]
        writable: Whether a plan may change it in this statement.
    """

    percent: float | None = None
    leading_rad_s: float | None = None
    tool_m_s: float | None = None
    tool_m_s2: float | None = None
    tool_rad_s: float | None = None
    duration_s: float | None = None
    writable: bool = True


@dataclass(frozen=True)
class Blend:
    """How near to its target a motion must come before the next one begins.

    Attributes:
        radius_m: Within this distance of the target; None: not given as a distance. [m]
        share: Or from this share of the half way on. [-]
    """

    radius_m: float | None = None
    share: float | None = None


@dataclass(frozen=True)
class Motion:
    """One execution of a statement that moves the robot.

    Attributes:
        statement: First character of the statement in the program's file: what executions have in common.
        line: Its line.
        label: What the program calls its target; empty: nothing.
        kind: Along a straight line of joint angles, or along a path of the tool.
        target: Where it ends; None: not known.
        speed: How fast it is.
        blend: Whether the next motion may begin before it ends; None: the robot stops at the target.
        via: Where a circular motion passes.
        reason: Why the target is not known, for reports.
        tool: The tool in the flange's frame, whose speed the motion's may be; None: the flange.
    """

    statement: int
    line: int
    label: str
    kind: Kind
    target: JointTarget | PoseTarget | None
    speed: Speed = field(default_factory=Speed)
    blend: Blend | None = None
    via: PoseTarget | None = None
    reason: str = ""
    tool: Placement | None = None

    @property
    def place(self) -> str:
        """Its line, as messages name it."""
        return f"line {self.line}"


@dataclass(frozen=True)
class Wait:
    """The robot stands.

    Attributes:
        statement: First character of the statement.
        line: Its line.
        duration_s: How long; None: until something comes that is not in the file. 0: it stops, no longer. [s]
        what: What it waits for, as the file says it.
        added: Whether a plan has added the wait, so that the next one may take it away.
        value: Where the duration stands, of a wait that a plan has added.
        whole: The lines to take away with it.
    """

    statement: int
    line: int
    duration_s: float | None
    what: str = ""
    added: bool = False
    value: Span | None = None
    whole: Span | None = None


@dataclass(frozen=True)
class Load:
    """What the robot carries from here on.

    Attributes:
        line: Line that says so.
        payload: What it is; None: not known ("payload 2", whose mass is in the controller).
        what: What the file says.
    """

    line: int
    payload: Payload | None
    what: str = ""


@dataclass(frozen=True)
class Unknown:
    """Something that was not understood and may have moved the robot: its position is not known behind it.

    Attributes:
        line: Its line.
        what: What it is.
        may_stand: Whether the robot may stand instead, as a call of a gripper's program lets it: then a length that is
            given beside the program makes it a wait.
    """

    line: int
    what: str
    may_stand: bool = False


@dataclass(frozen=True)
class CycleStart:
    """A loop without end begins: what comes before happens once, what comes behind is the cycle."""

    line: int


Event = Motion | Wait | Load | Unknown | CycleStart


def check_bounds(event: Event) -> None:
    """Refuse numbers that no program means, wherever they stand in an event.

    Raises:
        InputError: One is not finite, or beyond all bounds.
    """
    pending: list[object] = [event]
    while pending:
        value = pending.pop()
        if isinstance(value, float):
            if not abs(value) <= LARGEST:
                raise InputError(f"{shown(value)} is beyond all bounds", key=f"line {getattr(event, 'line', 0)}")
        elif isinstance(value, np.ndarray):
            pending += value[~(np.abs(value) <= LARGEST)].tolist() if value.dtype.kind == "f" else []
        elif isinstance(value, Mapping):
            pending += value.values()
        elif isinstance(value, tuple):
            pending += value
        elif is_dataclass(value):
            pending += [getattr(value, one.name) for one in fields(value)]


@dataclass(frozen=True)
class Note:
    """Something to know about the program, with its line."""

    line: int
    text: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.text}"


def told(notes: Sequence[Note]) -> tuple[str, ...]:
    """Notes as sentences with their lines; what is the same for several lines is said once."""
    lines: dict[str, list[int]] = {}
    for note in notes:
        lines.setdefault(note.text, []).append(note.line)
    return tuple(f"{_places(at)}: {text}" for text, at in lines.items())


def _places(lines: Sequence[int]) -> str:
    if len(lines) == 1:
        return f"line {lines[0]}"
    named = ", ".join(map(str, lines[:_MOST_LINES]))
    return f"{len(lines)} lines ({named}{', ...' if len(lines) > _MOST_LINES else ''})"


@dataclass(frozen=True)
class Trace:
    """What a program does.

    Attributes:
        events: In the order in which they happen.
        notes: What was kept without being understood, and what was assumed, once each.
    """

    events: tuple[Event, ...]
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True)
class Beside:
    """What is given beside a program's file, as it stands in the controller.

    Attributes:
        tool: The tool of all motions whose own is not in the file, in the flange's frame.
        base: The base of all motions whose own is not in the file, in the robot's base frame.
        tools: Tools by their numbers or names.
        bases: Bases (user frames, work objects) by their numbers or names.
        payloads: Payloads by their numbers or names.
        waits_s: Durations of waits that the file does not say, by their line. [s]
        positions_rad: Joint positions as the pendant shows them, by their names in capitals (XHOME, PR[1]). [rad]
        still: Programs and routines of other files that do not move the robot, by their names in capitals.
    """

    tool: Placement | None = None
    base: Placement | None = None
    tools: Mapping[str, Placement] = field(default_factory=dict)
    bases: Mapping[str, Placement] = field(default_factory=dict)
    payloads: Mapping[str, Payload] = field(default_factory=dict)
    waits_s: Mapping[int, float] = field(default_factory=dict)
    positions_rad: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    still: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Wish:
    """How fast a statement's motion shall be, in each of the ways in which languages say it.

    Attributes:
        percent: Share of the joint velocity limits. [%]
        leading_rad_s: Velocity of the joint that turns farthest; None: nothing turns. [rad/s]
        duration_s: Duration that the simulation gives; None: no robot is known. [s]
    """

    percent: float
    leading_rad_s: float | None = None
    duration_s: float | None = None


class VendorProgram(Protocol):
    """A parsed program of a vendor's language: its name, the file that was named and those that go with it."""

    @property
    def name(self) -> str:
        """Name of the program."""

    @property
    def sources(self) -> tuple[SourceText, ...]:
        """Its files."""

    @property
    def wait_step_s(self) -> float:
        """Waits of the language are multiples of it. [s]"""

    def trace(self, beside: Beside) -> Trace:
        """What the program does.

        Raises:
            InputError: It cannot be run at all; names the line.
        """

    def speed_edits(self, wishes: Mapping[int, Wish]) -> list[Edit]:
        """Edits that give motions other speeds.

        Args:
            wishes: What each statement whose speed changes shall say, by `Motion.statement`.
        """

    def wait_edit(self, statement: int, seconds: float, *, before: bool) -> Edit:
        """The insertion of a wait that the next plan may take away again, before or behind a motion."""

    def wait_text(self, seconds: float) -> str:
        """A duration as it stands in a wait that a plan has added (`Wait.value`)."""

    def finished(self, texts: Sequence[str]) -> tuple[str, ...]:
        """Edited texts of all files with what must keep in step with inserted lines, such as numbers of lines."""
