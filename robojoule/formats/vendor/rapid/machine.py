"""Running a RAPID program as far as constants reach."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress

from lark import Token, Tree

from robojoule.errors import InputError
from robojoule.formats.vendor.lines import flaw_of, short
from robojoule.formats.vendor.rapid.data import payload_of, tool_of
from robojoule.formats.vendor.rapid.expressions import Variables, arguments_of, path_of, value_of
from robojoule.formats.vendor.rapid.instructions import CHANGING, HARMLESS, NOT_SIMULATED, WAITS
from robojoule.formats.vendor.rapid.motions import FORMS, Setting, read_motion
from robojoule.formats.vendor.rapid.syntax import Block, Node, Routine, Statement, within
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import Beside, CycleStart, Event, Load, Note, Unknown, Wait
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload

ADDED = "!robojoule"  # begins the comment of waits that plans add
MOST_STEPS = 200_000  # of a program; beyond it a loop was not meant
_DEEPEST_CALLS = 50
_NOTHING_KG = 0.001  # load0's mass, which stands for none


class _Leave(Exception):
    """The end of a routine or of the program, found within it."""

    def __init__(self, what: str) -> None:
        self.what = what


class Machine:
    """Executes procedures and collects events."""

    def __init__(self, routines: Sequence[Routine], data: Sequence[Statement], beside: Beside) -> None:
        self.routines = {routine.name: routine for routine in routines}
        self.beside = beside
        self.variables = Variables()
        self.setting = Setting()
        self.events: list[Event] = []
        self.notes: dict[tuple[int, str], Note] = {}
        self.places: dict[int, Span] = {}
        self.steps = 0
        self.depth = 0
        self.in_cycle = False
        self.grip: Value = self.variables.values["LOAD0"]
        self.tool: Value = None
        self.load: Payload | None = None
        for one in data:
            if one.kind == "declaration":
                self._step(one)

    def run(self, routine: Routine) -> None:
        """Run a program from the beginning of its main procedure."""
        with suppress(_Leave):
            self._routine(routine)

    def note(self, one: Statement, text: str) -> None:
        """Report something about a statement, once."""
        self.notes.setdefault((one.line, text), Note(one.line, text))

    def _unknown(self, one: Statement, what: str, *, may_stand: bool = False) -> None:
        self.events.append(Unknown(one.line, what, may_stand))

    def _routine(self, routine: Routine) -> None:
        self.depth += 1
        try:
            self._body(routine.body)
        except _Leave as leave:
            if leave.what != "routine":
                raise
        finally:
            self.depth -= 1

    def _count(self, one: Statement) -> None:
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise InputError(f"the program does not end within {MOST_STEPS} steps", key=f"line {one.line}")

    def _body(self, body: Sequence[Statement | Block]) -> None:
        for one in body:
            self._count(one.head if isinstance(one, Block) else one)
            if isinstance(one, Block) and one.head.tree is None:
                self._skip(one.head, list(within([one]))[1:])
            elif isinstance(one, Block):
                rule: Callable[[Block], None] = getattr(self, f"_{one.head.kind.rstrip('_')}_block")
                rule(one)
            else:
                self._step(one)

    def _step(self, one: Statement) -> None:
        """One statement that opens no block."""
        tree = one.tree
        if tree is None:
            self._unknown(
                one, f"not understood{flaw_of(one.code)}, it may move the robot: {short(one.code)}", may_stand=True
            )
        elif one.kind == "declaration":
            self._declare(one, tree)
        elif one.kind == "assignment":
            self._assign(one, tree)
        elif one.kind == "call":
            self._call(one, tree)
        elif one.kind == "late_call":
            self._late_call(one, tree)
        elif one.kind == "compact_if":
            self._compact_if(one, tree)
        elif one.kind == "stop":
            self.events.append(Wait(one.start, one.line, None, "Stop"))
        elif one.kind == "goto":
            self._unknown(one, "GOTO is not followed")
            raise _Leave("routine")
        elif one.kind == "return_":
            raise _Leave("routine" if one.code.upper().startswith("RETURN") else "program")

    # Data

    def _declare(self, one: Statement, tree: Node) -> None:
        names = [str(child) for child in tree.children if isinstance(child, Token)]
        given = [
            child for child in tree.children if isinstance(child, Tree) and child.data not in ("scope", "dimensions")
        ]
        name = names[-1].upper()
        if given:
            self.variables.values[name] = value_of(given[0], one, self.variables)
        else:
            self.variables.values[name] = UNKNOWN

    def _assign(self, one: Statement, tree: Node) -> None:
        target, expression = tree.children
        assert isinstance(target, Tree)
        path = path_of(target, one, self.variables)
        value = value_of(expression, one, self.variables)
        if path is None:
            self.variables.forget(str(target.children[0]))
        else:
            self.variables.set(path, value)

    # Calls

    def _call(self, one: Statement, tree: Node) -> None:
        name = str(tree.children[0]).upper()
        if name in self.routines:
            self._own_call(one, tree, self.routines[name])
        elif name in FORMS:
            self._motion(one, tree)
        elif name == "WAITTIME":
            self._wait(one, tree)
        elif name in WAITS:
            self.events.append(Wait(one.start, one.line, None, short(one.code)))
        elif name in ("VELSET", "ACCSET", "CONFJ", "CONFL", "GRIPLOAD"):
            getattr(self, f"_{name.lower()}")(one, tree)
        elif name in HARMLESS:
            if name in CHANGING:
                self._forget_first(one, tree)
            if name in NOT_SIMULATED:
                self.note(one, f"{tree.children[0]} is kept and not simulated: {NOT_SIMULATED[name]}")
        elif name not in self.beside.still:
            self._unknown(one, f"{tree.children[0]} is not in this file, it may move the robot", may_stand=True)

    def _own_call(self, one: Statement, tree: Node, routine: Routine) -> None:
        if self.depth >= _DEEPEST_CALLS:
            self._unknown(one, f"{routine.name} calls itself")
            return
        plain, named = arguments_of(tree)
        values = [value_of(node, one, self.variables) for node in plain]
        optional = [name for name in routine.parameters if name in named]
        for name, value in zip([p for p in routine.parameters if p not in optional], values, strict=False):
            self.variables.values[name] = value
        for name in optional:
            node = named[name]
            self.variables.values[name] = True if node is None else value_of(node, one, self.variables)
        self._routine(routine)

    def _late_call(self, one: Statement, tree: Node) -> None:
        name = value_of(tree.children[0], one, self.variables)
        if isinstance(name, str) and name.upper() in self.routines:
            self._own_call(one, tree, self.routines[name.upper()])
        else:
            self._unknown(
                one, f"which procedure runs is not known, it may move the robot: {short(one.code)}", may_stand=True
            )

    def _forget_first(self, one: Statement, tree: Node) -> None:
        plain, _ = arguments_of(tree)
        if plain and isinstance(plain[0], Tree) and plain[0].data == "ref":
            path = path_of(plain[0], one, self.variables)
            name = str(tree.children[0]).upper()
            if path is None:
                self.variables.forget(str(plain[0].children[0]))
                return
            old = number(self.variables.get(path))
            step = {"INCR": 1.0, "DECR": -1.0}.get(name)
            if name == "CLEAR":
                self.variables.set(path, Number(0.0))
            elif step is not None and old is not None:
                self.variables.set(path, Number(old + step))
            else:
                self.variables.set(path, UNKNOWN)

    def _motion(self, one: Statement, tree: Node) -> None:
        found = read_motion(one, tree, self.variables, self.setting, self.beside)
        self.tool = found.tool
        self._carry(one)
        if found.place is not None:
            self.places[one.start] = found.place
            if found.motion.tool is None and found.motion.speed.tool_m_s is not None:
                self.note(one, "the speed is taken for the flange's: the tool is not in the file")
        self.events.append(found.motion)

    def _wait(self, one: Statement, tree: Node) -> None:
        plain, _ = arguments_of(tree)
        value = value_of(plain[0], one, self.variables) if plain else UNKNOWN
        seconds = number(value)
        is_added = one.comment.startswith(ADDED) and isinstance(value, Number) and value.origin is not None
        self.events.append(
            Wait(
                one.start,
                one.line,
                None if seconds is None else max(seconds, 0.0),
                short(one.code),
                added=is_added,
                value=value.origin if is_added and isinstance(value, Number) else None,
                whole=one.lines if is_added else None,
            )
        )

    # Settings

    def _velset(self, one: Statement, tree: Node) -> None:
        plain, _ = arguments_of(tree)
        share, most = ([number(value_of(node, one, self.variables)) for node in plain] + [None, None])[:2]
        if share is None or most is None or share <= 0.0:
            self.note(one, f"{short(one.code)} is not known and left out")
            return
        self.setting.velocity_share, self.setting.most_m_s = min(share, 100.0) / 100.0, most / 1e3
        if share != 100.0:
            self.note(one, r"VelSet is taken to act on speeddata and not on \T")

    def _accset(self, one: Statement, tree: Node) -> None:
        plain, _ = arguments_of(tree)
        shares = [number(value_of(node, one, self.variables)) for node in plain]
        if any(share != 100.0 for share in shares):
            self.note(one, f"{short(one.code)} is kept and not simulated: accelerations are those of the robot")

    def _confj(self, one: Statement, tree: Node) -> None:
        _, named = arguments_of(tree)
        self.setting.configured = "OFF" not in named

    def _confl(self, one: Statement, tree: Node) -> None:
        _, named = arguments_of(tree)
        self.setting.path_configured = "OFF" not in named

    def _gripload(self, one: Statement, tree: Node) -> None:
        plain, _ = arguments_of(tree)
        self.grip = value_of(plain[0], one, self.variables) if plain else UNKNOWN
        self._carry(one)

    def _carry(self, one: Statement) -> None:
        """Say what the robot carries where that has changed: its tool and what is gripped."""
        held = self.tool[2] if isinstance(self.tool, list) and len(self.tool) == 3 else None
        parts, frame = [payload_of(held), payload_of(self.grip)], tool_of(self.tool)
        if parts[0] is None or parts[1] is None or frame is None:
            return
        load = _both(parts[0], parts[1], frame)
        says_nothing = load.mass_kg <= (_NOTHING_KG if self.load is None else 0.0)  # as tool0 does
        if load != self.load and not says_nothing:
            self.load = load
            self.events.append(Load(one.line, load, f"{load.mass_kg:g} kg by tooldata and loaddata"))

    # Blocks

    def _compact_if(self, one: Statement, tree: Node) -> None:
        condition, inner = tree.children
        value = value_of(condition, one, self.variables)
        assert isinstance(inner, Tree)
        part = Statement(one.line, one.start, one.end, one.code, inner, one.comment, one.lines)
        if value is True:
            self._step(part)
        elif value is not False:
            self._skip(one, [part])

    def _condition(self, one: Statement) -> Value:
        assert one.tree is not None
        return value_of(one.tree.children[0], one, self.variables)

    def _if_block(self, block: Block) -> None:
        for head, body in [(block.head, block.body), *block.parts]:
            value = True if head.kind == "else_" else self._condition(head)
            if value is True:
                self._body(body)
                return
            if value is not False:
                self._skip(block.head, list(within([block])))
                return

    def _test_block(self, block: Block) -> None:
        value = self._condition(block.head)
        known = value if isinstance(value, str) else number(value)
        if known is None:
            self._skip(block.head, list(within([block])))
            return
        for head, body in block.parts:
            assert head.tree is not None
            cases = [value_of(one, head, self.variables) for one in head.tree.children]
            if head.kind == "default" or known in [one if isinstance(one, str) else number(one) for one in cases]:
                self._body(body)
                return

    def _for_block(self, block: Block) -> None:
        one = block.head
        assert one.tree is not None
        name, *rest = one.tree.children
        bounds = [number(value_of(node, one, self.variables)) for node in rest]
        known = [bound for bound in bounds if bound is not None]
        if len(known) < len(bounds) or (len(known) > 2 and known[2] == 0.0):
            self._skip(one, list(within([block])))
            return
        first, last = known[:2]
        step = known[2] if len(known) > 2 else math.copysign(1.0, last - first)
        value = first
        while (value <= last) if step > 0.0 else (value >= last):
            self._count(one)
            self.variables.values[str(name).upper()] = Number(value, None, value.is_integer())
            self._body(block.body)
            value += step

    def _while_block(self, block: Block) -> None:
        one = block.head
        condition = self._condition(one)
        is_endless = isinstance(one.tree, Tree) and isinstance(one.tree.children[0], Tree)
        if is_endless and one.tree.children[0].data == "true" and not self.in_cycle:  # type: ignore[union-attr]
            self.in_cycle = True
            self.events.append(CycleStart(one.line))
            self._body(block.body)
            raise _Leave("program")
        while condition is True:
            self._count(one)
            self._body(block.body)
            condition = self._condition(one)
        if condition is not False:
            self._skip(one, list(within([block])))

    def _skip(self, head: Statement, body: Sequence[Statement]) -> None:
        """Statements that run or not, nobody knows: what they set is not known behind them, nor where the robot is."""
        moves, waits = False, head.code.upper().startswith("WHILE")
        for one in body:
            if one.kind == "assignment":
                assert one.tree is not None
                self.variables.forget(str(one.tree.children[0].children[0]))  # type: ignore[union-attr]
            name = str(one.tree.children[0]).upper() if one.tree is not None and one.kind == "call" else ""
            moves |= one.tree is None or one.kind in ("late_call", "goto", "return_")
            waits |= name in WAITS or name == "WAITTIME"
            moves |= bool(name) and name not in HARMLESS and name not in WAITS and name != "WAITTIME"
        text = f"{short(head.code)}{flaw_of(head.code)}"
        if moves:
            self._unknown(head, f"whether this runs is not known, it may move the robot: {text}", may_stand=True)
        elif waits:
            self.events.append(Wait(head.start, head.line, None, text))
        else:
            self.note(head, f"whether this runs is not known, it is kept: {text}")


def _both(tool: Payload, part: Payload, frame: Placement) -> Payload:
    """A tool, whose figures are in the flange's frame, and what it grips, whose figures are in the tool's, as one."""
    if part.mass_kg <= _NOTHING_KG:
        return tool
    body = tool.body + part.body.placed(frame)
    return Payload(body.mass_kg, tuple(body.center_m.tolist()), body.inertia_kg_m2)
