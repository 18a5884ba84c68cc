"""The flow of a KRL program: which lines run, as far as constants tell."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from lark import Tree

from robojoule.formats.vendor.krl.expressions import Variables, path_of, root_of, value_of
from robojoule.formats.vendor.krl.syntax import Block, kind_of, within
from robojoule.formats.vendor.lines import Line, short
from robojoule.formats.vendor.running import Leave, Running
from robojoule.formats.vendor.trace import CycleStart
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number

# Routines of the controller that move nothing.
HARMLESS = {"SET_CD_PARAMS", "USE_CM_PRO_VALUES", "MSGNOTIFY", "MSGSTATE", "MSGQUIT", "PULSE", "ANIN", "CLEAR_KRLMSG"}
HARMLESS |= {"CWRITE", "SWRITE", "LOAD_DATA", "SET_OPSTATE", "USERLOG", "RDOUT", "VARSTATE", "INITMSG"}


class Flow(Running, ABC):
    """Runs lines and blocks and collects events."""

    def __init__(self) -> None:
        super().__init__()
        self.variables = Variables()
        self.in_cycle = False
        self.still: frozenset[str] = frozenset()

    @abstractmethod
    def step(self, line: Line) -> None:
        """Run one line that opens no block."""

    @abstractmethod
    def set_speed(self, value: Value) -> None:
        """Set the speed of all axes."""

    def run_body(self, body: list[Line | Block]) -> None:
        """Run lines and blocks in order."""
        for one in body:
            self.count(one.head.number if isinstance(one, Block) else one.number)
            if isinstance(one, Block):
                self._block(one)
            else:
                self.step(one)

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
                self.unknown(block.foot.number, f"how often the loop runs is not known: {short(block.foot.code)}")
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
        self.count(block.head.number)
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
        head = block.head
        self.skipped(head.number, head.code_start, head.code, moves=moves, waits=waits)
