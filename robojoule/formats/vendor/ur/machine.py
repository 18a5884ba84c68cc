"""Running a URScript program as far as constants reach."""

from __future__ import annotations

import math

from lark import Token, Tree

from robojoule.errors import InputError
from robojoule.formats.vendor.lines import Line, Node, first_word, flaw_of, short
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import (
    Beside,
    Blend,
    CycleStart,
    Event,
    Load,
    Motion,
    Note,
    PoseTarget,
    Unknown,
    Wait,
)
from robojoule.formats.vendor.ur.expressions import Pose, arguments_of, value_of
from robojoule.formats.vendor.ur.motions import MOTIONS, Call, label_of, speed_of, target_of
from robojoule.formats.vendor.ur.syntax import Block, kind_of
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload

ADDED = "# robojoule"  # begins the comment of waits that plans add
MOST_STEPS = 200_000  # of a program; beyond it a loop was not meant
_STANDING = ("sleep", "popup")
STREAMS = ("servoj", "servoc", "servol", "speedj", "speedl", "freedrive_mode", "teach_mode", "force_mode", "movex")
# Words that name what is known to move nothing, at the beginning of a function's name.
HARMLESS: tuple[str, ...] = (
    "set_",
    "get_",
    "read_",
    "write_",
    "textmsg",
    "socket_",
    "modbus_",
    "rpc_",
    "is_",
    "powerdown",
    "tool_",
)
HARMLESS += ("end_", "stop", "sync", "enable_", "disable_", "zero_", "reset_", "step_", "conveyor_", "norm", "assert")
HARMLESS += ("request_", "rtde_", "powerdown", "encoder_", "check_", "to_", "str_", "varmsg", "eoat_", "begin_")


class Leave(Exception):
    """The end of a loop, a function or the program, found within it."""

    def __init__(self, what: str) -> None:
        self.what = what


class Machine:
    """Executes lines and collects events."""

    def __init__(self, top: list[Line | Block], beside: Beside) -> None:
        self.functions = {_name(block.head): block for block in top if isinstance(block, Block)}
        self.top = top
        self.variables: dict[str, Value] = {"pi": Number(math.pi)}
        self.tool: Placement | None = beside.tool
        self.beside = beside
        self.events: list[Event] = []
        self.notes: dict[tuple[int, str], Note] = {}
        self.calls: dict[int, Call] = {}
        self.steps = 0
        self.in_cycle = False
        self.stack: list[str] = []

    def run(self) -> None:
        """Run the program: its lines outside of functions, or else its first function."""
        loose = [one for one in self.top if not _defines(one)]
        functions = [one for one in self.top if isinstance(one, Block) and one.head.kind == "def_"]
        is_loose = any(isinstance(one, Block) or one.kind in ("call_line", "assignment") for one in loose)
        try:
            if is_loose or not functions:
                self._body(self.top)
            else:
                self._body(functions[0].body)
        except Leave:
            pass

    def note(self, line: Line, text: str) -> None:
        """Report something about a line, once."""
        self.notes.setdefault((line.number, text), Note(line.number, text))

    def _unknown(self, line: Line, what: str, *, may_stand: bool = False) -> None:
        self.events.append(Unknown(line.number, what, may_stand))

    def _body(self, body: list[Line | Block]) -> None:
        for one in body:
            if isinstance(one, Block) and _defines(one):
                self.functions[_name(one.head)] = one
        for one in body:
            self.steps += 1
            head = one.head if isinstance(one, Block) else one
            if self.steps > MOST_STEPS:
                raise InputError(f"the program does not end within {MOST_STEPS} steps", key=f"line {head.number}")
            if isinstance(one, Line):
                self._step(one)
            elif one.head.tree is None:
                self._skip(one)
            elif one.head.kind == "while_":
                self._while(one)
            elif one.head.kind == "if_":
                self._if(one)

    def _step(self, line: Line) -> None:
        tree = line.tree
        if tree is None:
            if line.code and not line.code.startswith("$"):
                self._not_understood(line)
        elif line.kind == "assignment":
            self._assign(line, tree)
        elif line.kind == "call_line":
            self._call(line, tree)
        elif line.kind in ("break_", "continue_"):
            raise Leave(line.kind)
        elif line.kind == "return_":
            raise Leave("function")
        elif line.kind == "halt":
            raise Leave("program")
        elif line.kind == "run":
            self._check_thread(line, tree)
        elif line.kind == "join":
            self.events.append(Wait(line.code_start, line.number, None, short(line.code)))

    def _not_understood(self, line: Line) -> None:
        word = first_word(line.code)
        if word in MOTIONS or word in STREAMS:
            self._unknown(line, f"the motion is not understood{flaw_of(line.code)}: {short(line.code)}")
        else:
            self.note(line, f"not understood and kept{flaw_of(line.code)}: {short(line.code)}")

    def _value(self, node: Node | Token, line: Line) -> Value:
        return value_of(node, line, self.variables)

    def _assign(self, line: Line, tree: Node) -> None:
        names = [str(one) for one in tree.children if isinstance(one, Token) and one.type == "NAME"]
        *indices, last = [one for one in tree.children if isinstance(one, Tree)]
        if last.data == "run":
            self._check_thread(line, last)
            return
        if last.data == "call" and str(last.children[0]) in self.functions:
            self._enter(str(last.children[0]), line, last)
            self.variables[names[0]] = UNKNOWN
            return
        value = self._value(last, line)
        if not indices:
            self.variables[names[0]] = value
            return
        known = self.variables.get(names[0])
        index = self._value(indices[0].children[0], line)
        if isinstance(known, tuple) and isinstance(index, Number) and 0 <= int(index.value) < len(known):
            place = int(index.value)
            self.variables[names[0]] = (*known[:place], value, *known[place + 1 :])
        else:
            self.variables[names[0]] = UNKNOWN

    def _check_thread(self, line: Line, tree: Node) -> None:
        """A thread runs beside the program: it must not move the robot."""
        (call,) = tree.find_data("call") if any(True for _ in tree.find_data("call")) else (tree,)
        name = str(call.children[0])
        block = self.functions.get(name)
        moves = block is not None and any(_moves(one) for one in block.lines())
        if moves:
            self._unknown(line, f"thread {name} moves the robot")

    # Calls

    def _call(self, line: Line, tree: Node) -> None:
        name = str(tree.children[0])
        if name in MOTIONS:
            self._motion(name, line, tree)
        elif name in self.functions:
            self._enter(name, line, tree)
        elif name == "sleep":
            self._sleep(line, tree)
        elif name == "set_tcp":
            values = [self._value(one, line) for one in arguments_of(tree)[0]]
            self.tool = values[0].place if values and isinstance(values[0], Pose) else self.beside.tool
        elif name in ("set_payload", "set_target_payload", "set_payload_mass"):
            self._payload(line, tree)
        elif name == "popup":
            self.events.append(Wait(line.code_start, line.number, None, short(line.code)))
        elif name in STREAMS:
            self._unknown(line, f"{name}() is a stream, not a planned motion")
        elif not self._is_harmless(name):
            self._unknown(line, f"{name}() is not in this file, it may move the robot", may_stand=True)

    def _enter(self, name: str, line: Line, tree: Node) -> None:
        """Run a function of the file in its place."""
        if name in self.stack:
            self._unknown(line, f"{name}() calls itself")
            return
        block = self.functions[name]
        by_place, by_name = arguments_of(tree)
        assert block.head.tree is not None
        parameters = list(block.head.tree.find_data("parameter"))
        names = [str(one.children[0]) for one in parameters]
        given = dict(zip(names, by_place, strict=False)) | {key: node for key, node in by_name.items() if key in names}
        for parameter, key in zip(parameters, names, strict=True):
            node = given.get(key, parameter.children[-1])
            self.variables[key] = self._value(node, line) if isinstance(node, Tree) else UNKNOWN
        self.stack.append(name)
        try:
            self._body(block.body)
        except Leave as leave:
            if leave.what != "function":
                raise
        finally:
            self.stack.pop()

    def _sleep(self, line: Line, tree: Node) -> None:
        values = [self._value(one, line) for one in arguments_of(tree)[0]]
        seconds = number(values[0]) if values else None
        origin = values[0].origin if values and isinstance(values[0], Number) else None
        added = line.comment.startswith(ADDED) and origin is not None
        self.events.append(
            Wait(
                line.code_start,
                line.number,
                None if seconds is None else max(seconds, 0.0),
                short(line.code),
                added=added,
                value=origin if added else None,
                whole=Span(line.start, line.end) if added else None,
            )
        )

    def _payload(self, line: Line, tree: Node) -> None:
        values = [self._value(one, line) for one in arguments_of(tree)[0]]
        mass = number(values[0]) if values else None
        center = values[1] if len(values) > 1 else (Number(0.0), Number(0.0), Number(0.0))
        known = isinstance(center, tuple) and len(center) == 3 and all(isinstance(one, Number) for one in center)
        payload = None
        if mass is not None and mass >= 0.0 and known:
            x, y, z = (one.value for one in center)
            payload = Payload(mass, (x, y, z)) if max(abs(x), abs(y), abs(z)) <= 10.0 else None
        self.events.append(Load(line.number, payload, short(line.code)))

    # Motions

    def _motion(self, name: str, line: Line, tree: Node) -> None:
        kind, names, defaults = MOTIONS[name]
        by_place, by_name = arguments_of(tree)
        nodes = dict(zip(names, by_place, strict=False)) | {key: node for key, node in by_name.items() if key in names}
        values: dict[str, Value] = {key: Number(value) for key, value in defaults.items()}
        values |= {key: self._value(node, line) for key, node in nodes.items()}
        goal = "pose_to" if name == "movec" else names[0]
        text = "" if goal not in nodes else self._text(line, nodes[goal])
        target = target_of(values.get(goal, UNKNOWN), self.tool, self.beside.base)
        via = target_of(values.get("pose_via", UNKNOWN), self.tool, self.beside.base) if name == "movec" else None
        radius = number(values["r"])
        self.calls[line.code_start] = Call(
            line,
            name,
            {key: line.span(node) for key, node in nodes.items()},
            line.span(tree).end - 1,
            bool(by_name),
        )
        self.events.append(
            Motion(
                statement=line.code_start,
                line=line.number,
                label=label_of(text),
                kind=kind,
                target=target,
                speed=speed_of(kind, values),
                blend=Blend(radius_m=radius) if radius is not None and radius > 0.0 else None,
                via=via if isinstance(via, PoseTarget) else None,
                reason="" if target is not None else f"its target is known only while the program runs: {text}",
                tool=self.tool,
            )
        )

    def _text(self, line: Line, node: Node) -> str:
        span = line.span(node)
        return line.text[span.start - line.start : span.end - line.start]

    # Flow

    def _if(self, block: Block) -> None:
        for line, body in [(block.head, block.body), *block.parts]:
            assert line.tree is not None
            condition = True if line.kind == "else_" else self._value(line.tree.children[0], line)
            if condition is True:
                self._body(body)
                return
            if condition is not False:
                self._skip(block)
                return

    def _while(self, block: Block) -> None:
        line = block.head
        assert line.tree is not None
        node = line.tree.children[0]
        if isinstance(node, Tree) and node.data == "true" and not self.in_cycle and not _breaks(block):
            self.in_cycle = True
            self.events.append(CycleStart(line.number))
            self._pass(block)
            raise Leave("program")
        while (condition := self._value(node, line)) is True:
            if not self._pass(block):
                return
        if condition is not False:
            self._skip(block)

    def _pass(self, block: Block) -> bool:
        """Run a loop's body once; false: it has left the loop."""
        self.steps += 1
        try:
            self._body(block.body)
        except Leave as leave:
            if leave.what not in ("break_", "continue_"):
                raise
            return leave.what == "continue_"
        return True

    def _skip(self, block: Block) -> None:
        """Lines that run or not, nobody knows: what they set is not known behind them, nor where the robot is."""
        moves, waits = False, kind_of(block.head) == "while_"
        for line in block.lines():
            if line.kind == "assignment" and line.tree is not None:
                names = [one for one in line.tree.children if isinstance(one, Token) and one.type == "NAME"]
                self.variables[str(names[0])] = UNKNOWN
            moves |= self._may_move(line)
            waits |= line.kind == "call_line" and line.tree is not None and str(line.tree.children[0]) in _STANDING
        text = f"{short(block.head.code)}{flaw_of(block.head.code)}"
        if moves:
            self._unknown(block.head, f"whether this runs is not known, it may move the robot: {text}", may_stand=True)
        elif waits:
            self.events.append(Wait(block.head.code_start, block.head.number, None, text))
        else:
            self.note(block.head, f"whether this runs is not known, it is kept: {text}")

    def _may_move(self, line: Line) -> bool:
        if line.kind in ("halt", "return_"):
            return True
        if line.kind != "call_line" or line.tree is None:
            return line.tree is None and bool(line.code) and line.code.split("(")[0] in MOTIONS
        name = str(line.tree.children[0])
        if name in self.functions:
            return any(_moves(one) for one in self.functions[name].lines())
        return name in MOTIONS or name in STREAMS or not (self._is_harmless(name) or name in _STANDING)

    def _is_harmless(self, name: str) -> bool:
        return name.startswith(HARMLESS) or name.upper() in self.beside.still


def _name(head: Line) -> str:
    return str(head.tree.children[0]) if head.tree is not None and head.kind in ("def_", "thread") else ""


def _defines(one: Line | Block) -> bool:
    return isinstance(one, Block) and one.head.kind in ("def_", "thread")


def _moves(line: Line) -> bool:
    return line.code.split("(")[0].strip() in (*MOTIONS, *STREAMS)


def _breaks(block: Block) -> bool:
    """Whether a loop may be left from within."""
    return any(line.kind in ("break_", "return_") for line in block.lines())
