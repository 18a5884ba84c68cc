"""The flow of a KRL program: which lines run, as far as constants tell."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from lark import Tree

from robojoule.formats.vendor.cycles import keep_cycle
from robojoule.formats.vendor.krl.changes import changed_by, may_move, may_wait
from robojoule.formats.vendor.krl.expressions import Variables, path_of, root_of, value_of
from robojoule.formats.vendor.krl.syntax import Block, Routine, kind_of, leaves_loop, within
from robojoule.formats.vendor.lines import Line, short
from robojoule.formats.vendor.running import Leave, Running
from robojoule.formats.vendor.trace import CycleStart
from robojoule.formats.vendor.values import Number, Value, number


class Flow(Running, ABC):
    """Runs lines and blocks and collects events."""

    def __init__(self) -> None:
        super().__init__()
        self.variables = Variables()
        self.routines: dict[str, Routine] = {}
        self.still: frozenset[str] = frozenset()
        self.loops = 0  # loops without end that are being looked through
        self.may_have_left = False  # whether the innermost one may have been left, nobody knows

    @abstractmethod
    def step(self, line: Line) -> None:
        """Run one line that opens no block."""

    @abstractmethod
    def call_functions(self, line: Line) -> None:
        """Run the functions of the file that a line's expressions call, before these are evaluated."""

    @abstractmethod
    def forget(self, name: str, line: Line) -> None:
        """A variable, with all that belongs to it, is not known from a line on."""

    @abstractmethod
    def mark(self) -> object:
        """How far the program has been run."""

    @abstractmethod
    def back_to(self, mark: object) -> None:
        """Take back what has happened since; values of variables stay."""

    @abstractmethod
    def state(self) -> object:
        """What is known of variables and settings, to compare passes of a loop."""

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
        self.call_functions(line)
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
        self.call_functions(line)
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
        value: float | None = first
        while value is not None and ((value <= last) if step > 0.0 else (value >= last)):
            self.variables.set(path, Number(value, None, value.is_integer()))
            if not self._inner_pass(block):
                return
            value = number(self.variables.get(path))  # lines within may have set it
            if value is None:
                self._skip(block)
                return
            value += step
        self.variables.forget(root_of(target))  # what a controller leaves in the counter is not published

    def _while_block(self, block: Block) -> None:
        condition = self._condition(block.head)
        if condition is True and isinstance(block.head.tree, Tree) and block.head.tree.children[0].data == "true":  # type: ignore[union-attr]
            self._loop_block(block)
            return
        while condition is True:
            if not self._inner_pass(block):
                return
            condition = self._condition(block.head)
        if condition is not False:
            self._skip(block)

    def _repeat_block(self, block: Block) -> None:
        if block.foot is None:
            self._skip(block)
            return
        while True:
            if not self._inner_pass(block):
                return
            condition = self._condition(block.foot)
            if condition is True:
                return
            if condition is not False:
                for name in sorted(changed_by(block.lines(), self.routines)):
                    self.forget(name, block.head)
                what = f"how often the loop runs is not known: {short(block.foot.code)}"
                self.unknown(block.foot.number, what)
                return

    def _loop_block(self, block: Block) -> None:
        """A loop without end: one pass of it is the cycle, unless it is known to be left."""
        start, line = self.mark(), block.head.number
        since, outer = len(self.events), self.may_have_left
        place = since
        self.may_have_left = False
        self.loops += 1
        try:
            if not self._pass(block):
                return
            may_end = leaves_loop(block.body) and not self.may_have_left
            found = keep_cycle(self, since, line, lambda: self._pass(block), self.state, may_end=may_end)
            if found is None:
                return
            place = found
            may_have_left = self.may_have_left
        except Leave as leave:
            if leave.what != "goto":
                raise
            may_have_left = False
        finally:
            self.loops -= 1
            self.may_have_left = outer
        if may_have_left and (self.loops or not may_move(block.lines(), self.routines, self.still)):
            self.back_to(start)
            self._skip(block)
            return
        self.events.insert(place, CycleStart(line))
        raise Leave("program")

    @abstractmethod
    def _spline_block(self, block: Block) -> None:
        """Motions without a stop between them."""

    def _inner_pass(self, block: Block) -> bool:
        """A pass of a loop that has an end: what may leave it does not leave the loop around it."""
        outer = self.may_have_left
        try:
            return self._pass(block)
        finally:
            self.may_have_left = outer

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
        head, lines = block.head, list(within([block]))
        for name in sorted(changed_by(lines, self.routines)):
            self.forget(name, head)
        leaves = leaves_loop([block])
        self.may_have_left |= leaves
        if kind_of(head) != "while_":  # what its condition calls has run already, and runs no more
            lines = lines[1:]
        moves = leaves or may_move(lines, self.routines, self.still)
        waits = kind_of(head) in ("while_", "repeat", "loop") or may_wait(lines, self.routines)
        self.skipped(head.number, head.code_start, head.code, moves=moves, waits=waits)
