"""Running a teach pendant program as far as constants reach."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lark import Token, Tree

from robojoule.formats.vendor.fanuc.changes import (
    DEEPEST_CALLS,
    Find,
    action_of,
    assigns,
    changed_by,
    is_payload,
)
from robojoule.formats.vendor.fanuc.labels import endless_labels, inside, label_of, plain_label, repeated_labels
from robojoule.formats.vendor.fanuc.positions import Frames, Position
from robojoule.formats.vendor.fanuc.registers import Registers, index_of
from robojoule.formats.vendor.fanuc.syntax import Block, Instruction, Node, is_remark, within
from robojoule.formats.vendor.fanuc.zones import blend_of
from robojoule.formats.vendor.lines import flaw_of, short
from robojoule.formats.vendor.running import Leave, Running
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import (
    Beside,
    CycleStart,
    JointTarget,
    Kind,
    Load,
    Motion,
    PoseTarget,
    Speed,
    Wait,
)

_TOOL_M_S = {"mm/sec": 1e-3, "cm/min": 1e-2 / 60.0, "inch/min": 0.0254 / 60.0}
_SECONDS = {"sec": 1.0, "msec": 1e-3}
ADDED = "!Wait added by robojoule"  # the remark before waits that plans add
_KINDS: dict[str, Kind] = {"J": "joint", "L": "linear", "S": "linear", "C": "circular", "A": "circular"}
# First words of instructions that move nothing; every other one may be a macro.
_HARMLESS = {"ARC", "COL", "COLLISION", "ELSE", "ENDIF", "ENDFOR", "FORCE", "LOCK", "MESSAGE", "OFFSET", "PAYLOAD"}
_HARMLESS |= {"PULSE", "RSR", "SKIP", "SPOT", "TC_ONLINE", "TOOL_OFFSET", "TRACK", "UALM", "UNLOCK", "VOFFSET", "WEAVE"}
_HARMLESS |= {"WELD", "TIME", "DISTANCE", "STOP", "RESUME", "SYNC", "LBL", "MONITOR", "DEPARTURE", "FLG", "VISION"}
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


class Machine(Running):
    """Executes instructions and collects events."""

    def __init__(
        self, positions: Mapping[int, Position], beside: Beside, *, moves_arm: bool, find: Find, depth: int = 0
    ) -> None:
        super().__init__()
        self.find = find
        self.depth = depth
        self.positions = positions
        self.registers = Registers()
        self.frames = Frames(beside, self.registers)
        self.beside = beside
        self.moves_arm = moves_arm
        self.amounts: dict[int, Amount] = {}
        self.added: Instruction | None = None  # the remark that announces the wait of a plan
        self.labels: dict[str, int] = {}  # labels that were passed: number of motions before
        self.jumps: dict[str, list[int]] = {}  # conditional jumps that were met, by label: number of motions before
        self.motions = 0

    def run(self, body: Sequence[Instruction | Block]) -> None:
        """Run a program from its beginning."""
        labels = {
            label_of(one): at for at, one in enumerate(body) if isinstance(one, Instruction) and one.kind == "label"
        }
        endless = endless_labels(body, labels)
        repeated = repeated_labels(body, labels)
        seen: set[int] = set()
        at = 0
        try:
            while at < len(body):
                one = body[at]
                if isinstance(one, Instruction) and one.kind == "jump":
                    target = labels.get(label_of(one))
                    if target is None:
                        self.unknown(one.line.number, f"{short(one.code)} leads nowhere")
                        return
                    if target <= at or at in seen:
                        return
                    seen.add(at)
                    at = target
                    continue
                if isinstance(one, Instruction) and one.kind == "label":
                    self._label(one, endless=at in endless, repeated=at in repeated)
                else:
                    self._one(one)
                at += 1
        except Leave:
            pass

    def _one(self, one: Instruction | Block) -> None:
        self.count((one.head if isinstance(one, Block) else one).line.number)
        if isinstance(one, Block):
            if one.head.kind == "for_":
                self._for(one)
            else:
                self._skip(one)
            return
        announced, self.added = self.added, None
        if one.tree is None:
            self._plain(one)
        elif one.kind == "wait":
            self._wait(one, one.tree, announced)
        elif one.kind == "end":
            raise Leave("program")
        else:
            rule = getattr(self, f"_{one.kind}", None)
            if rule is not None:
                rule(one, one.tree)

    def _plain(self, one: Instruction) -> None:
        """An instruction without a tree: empty, a remark, or not understood."""
        if one.code == ADDED:
            self.added = one
        elif one.code and not is_remark(one.code) and not one.code.startswith("-"):
            if one.code[:1].upper() in _KINDS and one.code[1:2].isspace() and one.code[2:].lstrip()[:1] == "P":
                self.unknown(one.line.number, f"the motion is not understood{flaw_of(one.code)}: {short(one.code)}")
            else:
                self.unknown(
                    one.line.number,
                    f"not understood{flaw_of(one.code)}, it may move the robot: {short(one.code)}",
                    may_stand=True,
                )

    # Motions

    def _motion(self, one: Instruction, tree: Node) -> None:
        self.motions += 1
        move, *points = (str(token) for token in tree.children if isinstance(token, Token))
        kind = _KINDS[move.upper()]
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
        self._forget_all(one, [one])  # by what it calls on its way
        if "SKIP" in words:
            self.unknown(one.line.number, f"the motion to {label} may be skipped")

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

    def _wait(self, one: Instruction, tree: Node, announced: Instruction | None) -> None:
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

    def _forget_all(self, one: Instruction, body: Sequence[Instruction | Block]) -> None:
        """What instructions set that run or not, nobody knows; `one` decides."""
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
        elif _may_be_macro(one) and " ".join(one.code.upper().split()) not in self.beside.still:
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
            self._forget_all(one, [one])
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

    # Jumps and loops

    def _label(self, one: Instruction, *, endless: bool, repeated: bool) -> None:
        name = label_of(one)
        self.labels[name] = self.motions
        if endless:
            self.events.append(CycleStart(one.line.number))
        elif repeated or any(before < self.motions for before in self.jumps.get(name, [])):
            self.unknown(
                one.line.number, f"{name} is reached from several places: the robot's position is not known behind it"
            )

    def _branch(self, one: Instruction, tree: Node) -> None:
        action, code, line = action_of(one), short(one.code), one.line.number
        self._forget_all(one, [one])
        label = next((plain_label(str(token)) for token in action if token.type == "LABEL"), None)
        if label is not None:
            if self.labels.get(label) == self.motions:  # goes round until it need not
                self.events.append(Wait(one.code_start, line, None, code))
            self.jumps.setdefault(label, []).append(self.motions)
            self.note(line, f"whether it jumps is not known, it is taken not to: {code}")
        elif action and action[0].upper() in ("END", "ABORT"):
            self.note(line, f"whether the program ends here is not known, it is taken not to: {code}")
        elif action and action[0].upper() == "PAUSE":
            self.events.append(Wait(one.code_start, line, None, code))
        elif assigns(action) or is_payload(action) or (action and _is_harmless(action[0])):
            self.note(line, f"whether it runs is not known, it is kept: {code}")
        else:
            self.unknown(line, f"whether it runs is not known, it may move the robot: {code}", may_stand=True)

    def _for(self, block: Block) -> None:
        tree = block.head.tree
        assert tree is not None
        register, *rest = tree.children
        split = next(at for at, one in enumerate(rest) if isinstance(one, Token))
        first, last = (
            self.registers.total(
                [one.children[0] for one in part if isinstance(one, Tree) and isinstance(one.children[0], Token)]
            )
            for part in (rest[:split], rest[split + 1 :])
        )
        number = index_of(str(register))
        jumps = any(one.kind in ("label", "jump") for one in within(block.body))
        if first is None or last is None or number is None or jumps:
            self._skip(block)
            return
        step = -1.0 if "DOWN" in str(rest[split]).upper() else 1.0
        value = first
        while (value <= last) if step > 0.0 else (value >= last):
            self.registers.values[number] = value
            self.count(block.head.line.number)
            for one in block.body:
                self._one(one)
            value += step

    def _skip(self, block: Block) -> None:
        """Instructions that run or not, nobody knows: where the robot is behind them is not known, if they move it."""
        moves = waits = False
        for one in within([block]):
            waits |= one.kind in ("wait", "pause")
            moves |= one.kind in ("motion", "call", "jump", "branch", "label") or _may_be_macro(one)
        self._forget_all(block.head, [block])
        head = block.head
        self.skipped(head.line.number, head.code_start, head.code, moves=moves, waits=waits)


def _may_be_macro(one: Instruction) -> bool:
    """Whether an instruction is none that is known to move nothing."""
    if one.tree is None:
        return bool(one.code) and not is_remark(one.code)
    return one.kind == "statement" and not _is_harmless(str(one.tree.children[0]))


def _is_harmless(first: str) -> bool:
    """Whether an instruction that begins with a word is one that is known to move nothing."""
    word = first.split("[")[0].upper()
    return word in _HARMLESS or word.startswith("$")
