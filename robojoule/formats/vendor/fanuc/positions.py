"""Positions of teach pendant programs: joint angles, or places of the tool with their configuration."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from lark import Token

from robojoule.errors import InputError
from robojoule.formats.vendor.fanuc.registers import Registers
from robojoule.formats.vendor.fanuc.syntax import Line, Node, parsed
from robojoule.formats.vendor.trace import Beside, JointTarget, PoseTarget
from robojoule.robots.arm_configuration import FanucConfiguration
from robojoule.robots.rigid_body import Placement

JOINTS = tuple(f"J{joint}" for joint in range(1, 7))
_PLACE, _TURN = ("X", "Y", "Z"), ("W", "P", "R")
_ASSIGNED = {"UF": "UFRAME", "UT": "UTOOL"}  # what instructions call the figures of a frame
_MM = 1e-3


@dataclass
class Position:
    """One entry of the section POS.

    Attributes:
        line: Its line.
        values: Coordinates of group 1 by their names, in the file's units; not those that are not taught.
        user_frame: Number of the user frame; None: the present one.
        user_tool: Number of the tool; None: the present one.
        configuration: CONFIG; None: there is none that is one.
        external: Positions of further axes and groups.
    """

    line: int
    values: dict[str, float] = field(default_factory=dict)
    user_frame: int | None = None
    user_tool: int | None = None
    configuration: FanucConfiguration | None = None
    external: dict[str, float] = field(default_factory=dict)


def read_positions(lines: Sequence[Line]) -> tuple[dict[int, Position], list[int]]:
    """Positions by their numbers, and lines at which entries begin that are not understood."""
    found: dict[int, Position] = {}
    bad: list[int] = []
    for first, text in _entries(lines):
        tree = parsed("positions.lark", "start", text)
        if tree is None:
            bad.append(first)
            continue
        number = int(float(str(tree.children[0])))
        found[number] = _position(first, tree)
    return found, bad


def _entries(lines: Sequence[Line]) -> Iterator[tuple[int, str]]:
    """Each entry with its first line; an entry goes to its closing brace."""
    text: list[str] = []
    first = 0
    for line in lines:
        begins = line.text.lstrip().startswith("P[")
        if text and begins:  # the one before was never closed
            yield first, "\n".join(text)
            text = []
        if begins:
            first = line.number
        if begins or text:
            text.append(line.text)
        if text and line.text.strip().startswith("}"):
            yield first, "\n".join(text)
            text = []
    if text:
        yield first, "\n".join(text)


def _position(line: int, tree: Node) -> Position:
    position = Position(line)
    for group in tree.find_data("group"):
        _, number, *items = group.children
        is_first = int(float(str(number))) == 1
        for item in items:
            if isinstance(item, Token):
                continue
            words = [str(token) for token in item.children if isinstance(token, Token)]
            if item.data == "coordinate":
                _coordinate(position, words, int(float(str(number))))
            elif item.data == "config" and is_first:
                position.configuration = _configuration(words[0])
            elif item.data in ("user_frame", "user_tool") and is_first and words[0].isdigit():
                setattr(position, item.data, int(words[0]))
    return position


def _coordinate(position: Position, words: Sequence[str], group: int) -> None:
    name, value, *_ = words
    if value.startswith("*"):
        return
    name = name.upper()
    if group == 1 and name in (*JOINTS, *_PLACE, *_TURN):
        position.values[name] = float(value)
    else:
        position.external[name if group == 1 else f"GP{group}.{name}"] = float(value)


def _configuration(text: str) -> FanucConfiguration | None:
    try:
        return FanucConfiguration.parsed(text.strip("'"))
    except InputError:
        return None


class Frames:
    """User frame and tool as the program sets them."""

    def __init__(self, beside: Beside, registers: Registers) -> None:
        self.beside = beside
        self.registers = registers
        self.frame: int | None = None
        self.tool: int | None = None

    def target_of(self, position: Position, label: str) -> tuple[JointTarget | PoseTarget | None, str]:
        """Where a motion to a position ends, or why that is not known."""
        values = position.values
        if any(name in values for name in JOINTS):
            if any(name not in values for name in JOINTS):
                return None, f"{label} is not taught in all joints"
            angles = tuple(math.radians(values[name]) for name in JOINTS)
            return JointTarget(angles, external=position.external), ""
        if any(name not in values for name in (*_PLACE, *_TURN)):
            return None, f"{label} is not taught"
        frame = self._placement("UF", position.user_frame, self.frame, self.beside.bases, self.beside.base)
        tool = self._tool(position.user_tool)
        missing = [name for name, placement in (tool, frame) if placement is None]
        x, y, z = (values[name] * _MM for name in _PLACE)
        turns = [math.radians(values[name]) for name in _TURN]
        return PoseTarget(
            (x, y, z),
            Placement.of((0.0, 0.0, 0.0), (turns[0], turns[1], turns[2])).rotation,
            tool=tool[1],
            base=frame[1],
            configuration=position.configuration,
            external=position.external,
            unknown=" and ".join(missing),
        ), ""

    def tool_of(self, position: Position | None) -> Placement | None:
        """The tool of a motion to a position; None: it is not known."""
        return self._tool(None if position is None else position.user_tool)[1]

    def _tool(self, own: int | None) -> tuple[str, Placement | None]:
        return self._placement("UT", own, self.tool, self.beside.tools, self.beside.tool)

    def _placement(
        self, kind: str, own: int | None, present: int | None, named: Mapping[str, Placement], given: Placement | None
    ) -> tuple[str, Placement | None]:
        """A frame by its number, with its name; number 0 is the robot's own."""
        number = own if own is not None else present
        name = f"{kind} {number}" if number is not None else f"the present {kind}"
        if number == 0:
            return name, Placement.identity()
        if number is None or self.registers.is_overwritten(_ASSIGNED[kind], number):
            return name, given
        return name, named.get(str(number), given)
