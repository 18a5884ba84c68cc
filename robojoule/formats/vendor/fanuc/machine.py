"""Running a teach pendant program as far as constants reach."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lark import Token, Tree

from robojoule.formats.vendor.fanuc.changes import DEEPEST_CALLS, Find, changed_by
from robojoule.formats.vendor.fanuc.flow import KINDS, Flow, may_be_macro
from robojoule.formats.vendor.fanuc.labels import inside, labels_in
from robojoule.formats.vendor.fanuc.positions import Frames, Position
from robojoule.formats.vendor.fanuc.registers import index_of
from robojoule.formats.vendor.fanuc.syntax import Block, Instruction, Node
from robojoule.formats.vendor.fanuc.zones import blend_of
from robojoule.formats.vendor.lines import short
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import Beside, JointTarget, Load, Motion, PoseTarget, Speed, Wait

_TOOL_M_S = {"mm/sec": 1e-3, "cm/min": 1e-2 / 60.0, "inch/min": 0.0254 / 60.0}
_SECONDS = {"sec": 1.0, "msec": 1e-3}
_SPOT = "the time of the spot weld is not in the file: it is not counted"
_MODAL = {"OVERRIDE": "speeds of the program are shares of it", "JOINT_MAX_SPEED": "it bounds speeds"}


@dataclass(frozen=True)
class Amount:
    """Where the speed of a joint motion stands.

    Attributes:
        span: Its number.
        unit: Its unit, in lower case.
    """

    span: Span
    unit: str


class Machine(Flow):
    """Executes instructions and collects events."""

    def __init__(
        self, positions: Mapping[int, Position], beside: Beside, *, moves_arm: bool, find: Find, depth: int = 0
    ) -> None:
        super().__init__()
        self.find = find
        self.depth = depth
        self.positions = positions
        self.frames = Frames(beside, self.registers)
        self.beside = beside
        self.moves_arm = moves_arm
        self.amounts: dict[int, Amount] = {}

    def state(self) -> object:
        """See `Flow`."""
        registers, frames = self.registers, self.frames
        known = (dict(registers.values), sorted(registers.overwritten), sorted(self.positions))
        return (*known, frames.frame, frames.tool)

    # Motions

    def _motion(self, one: Instruction, tree: Node) -> None:
        self.motions += 1
        move, *points = (str(token) for token in tree.children if isinstance(token, Token))
        kind = KINDS[move.upper()]
        label = f"{points[-1].partition('[')[0]}[{inside(points[-1])}]"
        target, reason = self._target(points[-1], label)
        options = [str(child.children[0]) for child in tree.find_data("item")]
        words = {option.upper() for option in options}
        for word in ("INC", "OFFSET", "TOOL_OFFSET", "VOFFSET"):
            if word in words and target is not None:
                target, reason = None, f"{word} needs figures of the controller, or the place before"
        if not self.moves_arm:
            target, reason = None, "DEFAULT_GROUP leaves the robot out"
        share = next((word[3:] for word in words if word.startswith("ACC") and word[3:].isdigit()), "100")
        if share != "100":
            self.note(one.line.number, f"ACC{share} is kept and not simulated: accelerations are those of the robot")
        via = self._target(points[0], label)[0] if len(points) > 1 else None
        blend = blend_of(tree, self.registers)
        self.note_zone(one.line.number, blend)
        self.events.append(
            Motion(
                statement=one.code_start,
                line=one.line.number,
                label=label,
                kind=kind,
                target=target,
                speed=self._speed(one, tree, is_joint=kind == "joint"),
                blend=blend,
                via=via if isinstance(via, PoseTarget) else None,
                reason=reason,
                tool=self.frames.tool_of(self._position(points[-1])),
            )
        )
        if any(word.startswith("SPOT[") for word in words):
            self.note(one.line.number, _SPOT)
        self.forget_all(one, [one])  # by what it calls on its way
        if "SKIP" in words:
            self.unknown(one.line.number, f"the motion to {label} may be skipped")
            self.may_jump(labels_in(one))

    def _position(self, point: str) -> Position | None:
        """What section POS says of a point, if anything."""
        number = None if point.startswith("PR") else self.registers.whole(inside(point))
        return None if number is None else self.positions.get(number)

    def _target(self, point: str, label: str) -> tuple[JointTarget | PoseTarget | None, str]:
        number = self.registers.whole(inside(point))
        if point.startswith("PR"):
            if number is not None and self.registers.is_overwritten("PR", number):
                return None, f"{label} is computed while the program runs"
            known = self.beside.positions_rad.get(f"PR[{number}]")
            return (None, f"{label} is a register of the controller") if known is None else (JointTarget(known), "")
        if number is None:
            return None, f"the number of {label} is computed while the program runs"
        position = self.positions.get(number)
        if position is None:
            return None, f"{label} is not in the section POS"
        return self.frames.target_of(position, label)

    def _speed(self, one: Instruction, tree: Node, *, is_joint: bool) -> Speed:
        tokens = [token for token in next(tree.find_data("speed")).children if isinstance(token, Token)]
        if len(tokens) < 2:
            return Speed(writable=False)
        value, unit = tokens
        amount, name = self.registers.amount(str(value)), str(unit).lower()
        if amount is None or amount <= 0.0:
            return Speed(writable=False)
        is_writable = is_joint and value.type == "NUMBER" and name in ("%", "sec", "msec")
        if is_writable:
            self.amounts[one.code_start] = Amount(one.span(value), name)
        if name == "%":
            return Speed(percent=min(amount, 100.0), writable=is_writable)
        if name in _TOOL_M_S:
            return Speed(tool_m_s=amount * _TOOL_M_S[name], writable=False)
        if name in _SECONDS:
            return Speed(duration_s=amount * _SECONDS[name], writable=is_writable)
        return Speed(tool_rad_s=math.radians(amount), writable=False)

    # Waits

    def wait(self, one: Instruction, tree: Node, announced: Instruction | None) -> None:
        """See `Flow`."""
        tokens = [child.children[0] for child in tree.find_data("item")]
        seconds: float | None = None
        is_added = False
        if len(tokens) == 2 and isinstance(tokens[1], Token) and tokens[1].type == "SECONDS":
            seconds = self.registers.amount(str(tokens[0]))
            is_added = announced is not None and isinstance(tokens[0], Token) and tokens[0].type == "NUMBER"
        is_added = is_added and seconds is not None
        self.events.append(
            Wait(
                one.code_start,
                one.line.number,
                seconds,
                short(one.code),
                added=is_added,
                value=one.span(tokens[0]) if is_added and isinstance(tokens[0], Token) else None,
                whole=Span(announced.start, one.end) if is_added and announced is not None else None,
            )
        )

        self.may_jump(labels_in(one))  # where it takes too long

    def _pause(self, one: Instruction, tree: Node) -> None:
        self.events.append(Wait(one.code_start, one.line.number, None, short(one.code)))

    # Settings and registers

    def _assignment(self, one: Instruction, tree: Node) -> None:
        target, *items = tree.children
        name = str(target).split("[")[0].upper()
        tokens = [item.children[0] for item in items if isinstance(item, Tree)]
        value = self.registers.total([token for token in tokens if isinstance(token, Token)])
        number = index_of(str(target))
        if name in ("UFRAME_NUM", "UTOOL_NUM") and value is not None:
            setattr(self.frames, "frame" if name == "UFRAME_NUM" else "tool", int(value))
        elif name == "R" and value is not None and number is not None:
            self.registers.values[number] = value
        else:
            self._forget(str(target))
        if name in _MODAL:
            self.note(one.line.number, f"{short(one.code)} is kept and not simulated: {_MODAL[name]}")

    def _forget(self, target: str) -> None:
        """What an instruction sets is not known behind it: its value is not, or whether it runs."""
        name = target.split("[")[0].upper()
        if name == "R":
            self.registers.forget(index_of(target))
        elif name == "P":
            number = self.registers.whole(inside(target))
            gone = list(self.positions) if number is None else [number]
            self.positions = {key: one for key, one in self.positions.items() if key not in gone}
        elif name in ("PR", "UFRAME", "UTOOL"):
            self.registers.overwrite(name, self.registers.whole(inside(target)))
        elif name in ("UFRAME_NUM", "UTOOL_NUM"):
            setattr(self.frames, "frame" if name == "UFRAME_NUM" else "tool", None)

    def forget_all(self, one: Instruction, body: Sequence[Instruction | Block]) -> None:
        """See `Flow`."""
        for target in changed_by(body, self.find):
            if target.upper().startswith("PAYLOAD["):
                self.events.append(Load(one.line.number, None, short(one.code)))
            else:
                self._forget(target)

    def _statement(self, one: Instruction, tree: Node) -> None:
        first = str(tree.children[0])
        if first.upper().startswith("PAYLOAD["):
            number = self.registers.whole(inside(first))
            self.events.append(Load(one.line.number, self.beside.payloads.get(str(number)), short(one.code)))
        elif first.upper().startswith("SPOT["):
            self.note(one.line.number, _SPOT)
        elif may_be_macro(one) and " ".join(one.code.upper().split()) not in self.beside.still:
            self.unknown(one.line.number, f"it may be a macro that moves the robot: {short(one.code)}", may_stand=True)

    def _call(self, one: Instruction, tree: Node) -> None:
        name = next(str(token) for token in tree.children if isinstance(token, Token))
        if name.upper() in self.beside.still:
            return
        body = self.find(name) if self.depth < DEEPEST_CALLS else None
        if body is None:
            self.unknown(one.line.number, f"{name} is another program, it may move the robot", may_stand=True)
            return
        runs_beside = one.code.upper().startswith("RUN")
        if runs_beside:  # when it sets what, nobody knows
            self.forget_all(one, [one])
        other = Machine({}, self.beside, moves_arm=self.moves_arm, find=self.find, depth=self.depth + 1)
        if not runs_beside:
            other.registers, other.frames = self.registers, self.frames
        other.steps = self.steps
        other.run(body)
        self.steps = other.steps
        waits = [event for event in other.events if isinstance(event, Wait)]
        if len(waits) < len(other.events):
            self.unknown(one.line.number, f"{name}, beside this program, may move the robot", may_stand=True)
        elif runs_beside:
            self.note(one.line.number, f"{name} runs beside this program and moves nothing")
        else:
            self.note(one.line.number, f"{name}, beside this program, moves nothing")
            self.events += [
                Wait(one.code_start, one.line.number, wait.duration_s, f"{name}: {wait.what}") for wait in waits
            ]
