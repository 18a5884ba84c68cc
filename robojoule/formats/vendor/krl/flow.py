"""The flow of a KRL program: which lines run, as far as constants tell."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from lark import Tree

from robojoule.errors import InputError
from robojoule.formats.vendor.krl.expressions import Variables, path_of, root_of, value_of
from robojoule.formats.vendor.krl.syntax import Block, kind_of, within
from robojoule.formats.vendor.lines import Line, flaw_of, short
from robojoule.formats.vendor.trace import CycleStart, Event, Note, Unknown, Wait
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number

MOST_STEPS = 200_000  # of a program; beyond it a loop was not meant
# Routines of the controller that move nothing.
HARMLESS = {"SET_CD_PARAMS", "USE_CM_PRO_VALUES", "MSGNOTIFY", "MSGSTATE", "MSGQUIT", "PULSE", "ANIN", "CLEAR_KRLMSG"}
HARMLESS |= {"CWRITE", "SWRITE", "LOAD_DATA", "SET_OPSTATE", "USERLOG", "RDOUT", "VARSTATE", "INITMSG"}


class Leave(Exception):
    """The end of a loop or a routine, found within it."""

    def __init__(self, what: str) -> None:
        self.what = what


class Flow(ABC):
    """Runs lines and blocks and collects events."""

    def __init__(self) -> None:
        self.variables = Variables()
        self.events: list[Event] = []
        self.notes: dict[tuple[int, str], Note] = {}
        self.steps = 0
        self.in_cycle = False
        self.still: frozenset[str] = frozenset()

    @abstractmethod
    def step(self, line: Line) -> None:
        """Run one line that opens no block."""

    @abstractmethod
    def set_speed(self, value: Value) -> None:
        """Set the speed of all axes."""

    def note(self, line: Line, text: str) -> None:
        """Report something about a line, once."""
        self.notes.setdefault((line.number, text), Note(line.number, text))

    def run_body(self, body: list[Line | Block]) -> None:
        """Run lines and blocks in order."""
        for one in body:
            self.steps += 1
            if self.steps > MOST_STEPS:
                raise InputError(f"the program does not end within {MOST_STEPS} steps", key=f"line {_number(one)}")
            if isinstance(one, Block):
                self._block(one)
            else:
                self.step(one)

    def unknown(self, line: Line, what: str, *, may_stand: bool = False) -> None:
        """The robot may be anywhere from here on."""
        self.events.append(Unknown(line.number, what, may_stand))

    def _block(self, block: Block) -> None:
        if block.head.tree is None:
            self._skip(block)
            return
        kind = block.head.kind
        rule: Callable[[Block], None] = getattr(self, f"_{kind.rstrip('_')}_block")
        rule(block)

    def _condition(self, line: Line) -> Value:
        assert line.tree is not None
        return value_of(line.tree.children[0], line, self.variables)

    def _if_block(self, block: Block) -> None:
        condition = self._condition(block.head)
        if condition is True:
            self.run_body(block.body)
        elif condition is False:
            for _, body in block.parts:
                self.run_body(body)
        else:
            self._skip(block)

    def _switch_block(self, block: Block) -> None:
        value = self._condition(block.head)
        known = value if isinstance(value, str) else number(value)
        if known is None:
            self._skip(block)
            return
        for line, body in block.parts:
            assert line.tree is not None
            cases = [value_of(one, line, self.variables) for one in line.tree.children]
            if line.kind == "default" or known in [one if isinstance(one, str) else number(one) for one in cases]:
                self.run_body(body)
                return

    def _for_block(self, block: Block) -> None:
        line = block.head
        assert line.tree is not None
        target, *rest = line.tree.children
        assert isinstance(target, Tree)
        bounds = [number(value_of(one, line, self.variables)) for one in rest]
        path = path_of(target, line, self.variables)
        if path is None or None in bounds:
            self._skip(block)
            return
        first, last, *steps = [bound for bound in bounds if bound is not None]
        step = steps[0] if steps else 1.0
        if step == 0.0:
            self._skip(block)
            return
        value = first
        while (value <= last) if step > 0.0 else (value >= last):
            self.variables.set(path, Number(value, None, value.is_integer()))
            if not self._pass(block):
                return
            value += step
        self.variables.forget(root_of(target))  # what a controller leaves in the counter is not published

    def _while_block(self, block: Block) -> None:
        condition = self._condition(block.head)
        if condition is True and isinstance(block.head.tree, Tree) and block.head.tree.children[0].data == "true":  # type: ignore[union-attr]
            self._loop_block(block)
            return
        while condition is True:
            if not self._pass(block):
                return
            condition = self._condition(block.head)
        if condition is not False:
            self._skip(block)

    def _repeat_block(self, block: Block) -> None:
        if block.foot is None:
            self._skip(block)
            return
        while True:
            if not self._pass(block):
                return
            condition = self._condition(block.foot)
            if condition is True:
                return
            if condition is not False:
                self.unknown(block.foot, f"how often the loop runs is not known: {short(block.foot.code)}")
                return

    def _loop_block(self, block: Block) -> None:
        """A loop without end: one pass of it is the cycle."""
        if self.in_cycle:
            self._skip(block)
            return
        self.in_cycle = True
        self.events.append(CycleStart(block.head.number))
        self._pass(block)
        raise Leave("program")

    def _spline_block(self, block: Block) -> None:
        self.run_body(block.body)

    def _pass(self, block: Block) -> bool:
        """Run a loop's body once; false: it has left the loop."""
        self.steps += 1
        try:
            self.run_body(block.body)
        except Leave as leave:
            if leave.what != "loop":
                raise
            return False
        return True

    def _skip(self, block: Block) -> None:
        """Lines that run or not, nobody knows: what they set is not known behind them, nor where the robot is."""
        moves, waits = False, kind_of(block.head).rstrip("_") in ("while", "repeat", "loop")
        for line in within([block]):
            if line.tree is None:
                continue
            waits |= line.kind in ("wait_sec", "wait_for")
            if line.kind == "assignment":
                self.variables.forget(root_of(line.tree.children[0]))  # type: ignore[arg-type]
            elif line.kind == "call_line":
                name = str(line.tree.children[0]).upper()
                moves |= name not in HARMLESS and name != "BAS" and name not in self.still
                if name == "BAS":
                    self.set_speed(UNKNOWN)
            moves |= line.kind in ("motion", "goto", "exit", "return_")
        text = f"{short(block.head.code)}{flaw_of(block.head.code)}"
        if moves:
            self.unknown(block.head, f"whether this runs is not known, it may move the robot: {text}", may_stand=True)
        elif waits:
            self.events.append(Wait(block.head.code_start, block.head.number, None, text))
        else:
            self.note(block.head, f"whether this runs is not known, it is kept: {text}")


def _number(one: Line | Block) -> int:
    return one.head.number if isinstance(one, Block) else one.number
