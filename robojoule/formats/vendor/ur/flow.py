"""How a URScript program goes from line to line: blocks, loops, conditions, and what may have run."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field

from lark import Token, Tree

from robojoule.formats.vendor.cycles import keep_cycle
from robojoule.formats.vendor.lines import Line, Node, short
from robojoule.formats.vendor.running import Leave, Running
from robojoule.formats.vendor.trace import Beside, CycleStart, Load, Motion, Unknown, Wait
from robojoule.formats.vendor.ur.effects import Effects, Search, called_in
from robojoule.formats.vendor.ur.expressions import value_of
from robojoule.formats.vendor.ur.names import Names
from robojoule.formats.vendor.ur.payload import Carried
from robojoule.formats.vendor.ur.syntax import Block, functions_in, kind_of, name_of
from robojoule.formats.vendor.values import UNKNOWN, Value
from robojoule.robots.rigid_body import Placement


@dataclass
class Open:
    """A loop or a function that runs.

    Attributes:
        since: How many events there were before it.
        is_loop: Whether it is a loop.
        left: Lines that leave it, or end its pass, nobody knows whether.
    """

    since: int
    is_loop: bool
    left: set[int] = field(default_factory=set)


class Flow(Running):
    """Runs blocks of lines; what a line does is for `step` to say."""

    def __init__(self, top: list[Line | Block], beside: Beside) -> None:
        super().__init__()
        self.top = top
        self.functions = functions_in(top)
        self.names = Names()
        self.tool: Placement | None = beside.tool
        self.carried = Carried()
        self.beside = beside
        self.search = Search(self.functions, beside.still)
        self.opened: list[Open] = []

    @abstractmethod
    def step(self, line: Line) -> None:
        """Run one line that opens no block."""

    def run_body(self, body: list[Line | Block]) -> None:
        """Run lines one after the other."""
        self.functions.update({name_of(one.head): one for one in body if isinstance(one, Block) and defines(one)})
        for one in body:
            if isinstance(one, Line):
                self.count(one.number)
                self.step(one)
                continue
            self.count(one.head.number)
            if one.head.tree is None:
                self._skip(one)
            elif one.head.kind == "while_":
                self._while(one)
            elif one.head.kind == "if_":
                self._if(one)

    def value(self, node: Node | Token, line: Line) -> Value:
        """The value of an expression here."""
        return value_of(node, line, self.names)

    def look_at(self, line: Line, node: Node, *, without: Node | None = None) -> None:
        """What an expression calls, but for one call, may move the robot and set variables."""
        names = called_in(node)
        if without is not None:
            names.remove(str(without.children[0]))
        for name in dict.fromkeys(names):
            effects = self.search.of_calls([name])
            self.forget(line, effects)
            if effects.moves:
                whose = "" if name in self.functions else " is not in this file, it"
                text = f"{name}(){whose} may move the robot: {short(line.code)}"
                self.unknown(line.number, text, may_stand=True)
            elif effects.waits:
                self.events.append(Wait(line.code_start, line.number, None, short(line.code)))

    def forget(self, line: Line, effects: Effects) -> None:
        """What may have been set is not known any more."""
        for scope, name in effects.sets:
            self.names.set(name, UNKNOWN, scope)
        for name in effects.shared:
            self.names.forget_shared(name)
        if effects.tool:
            self.tool = self.beside.tool
        if effects.payload:
            self.carried = Carried()
            self.events.append(Load(line.number, None, short(line.code)))

    def may_have_left(self, opened: Open, line: Line, effects: Effects) -> None:
        """Behind a loop or a function that may have been left early, on grounds that nobody knows."""
        if not opened.left:
            return
        self.forget(line, effects)
        if any(isinstance(event, (Motion, Unknown)) for event in self.events[opened.since :]):
            places = ", ".join(map(str, sorted(opened.left)))
            text = f"whether line {places} ends it early is not known, nor where the robot is then: {short(line.code)}"
            self.unknown(line.number, text)

    def _condition(self, line: Line) -> Value:
        assert line.tree is not None
        node = line.tree.children[0]
        assert isinstance(node, Tree)
        self.look_at(line, node)
        return self.value(node, line)

    def _if(self, block: Block) -> None:
        for line, body in [(block.head, block.body), *block.parts]:
            condition = True if line.kind == "else_" else self._condition(line)
            if condition is True:
                self.run_body(body)
                return
            if condition is not False:
                self._skip(block)
                return

    def _while(self, block: Block) -> None:
        """A loop: counted out, or, where nothing that is known ends it, one pass of it as the cycle."""
        inner = self.search.of_block(block)
        body = self.search.of(block.body)
        ends = body.breaks | body.returns | body.halts
        is_endless = self._is_constant(block.head, inner)
        opened = Open(len(self.events), is_loop=True)
        self.opened.append(opened)
        try:
            while (condition := self._condition(block.head)) is True:
                if not self._pass(block):
                    break
                if is_endless:
                    place = self._cycle_of(block, opened, may_end=not ends <= opened.left)
                    if place is None:
                        break
                    if self._is_cycle(block, opened, place):
                        raise Leave("program")
                    del self.events[opened.since :]
                    condition = UNKNOWN
                    break
        finally:
            self.opened.pop()
        if condition is UNKNOWN or not isinstance(condition, bool):
            self._skip(block)
        else:
            self.may_have_left(opened, block.head, inner)

    def _is_constant(self, head: Line, effects: Effects) -> bool:
        """Whether a loop's condition stays what it is while it runs."""
        assert head.tree is not None
        named = {str(one.children[0]) for one in head.tree.iter_subtrees() if one.data == "name"}
        return not called_in(head.tree) and not named & effects.names

    def _cycle_of(self, block: Block, opened: Open, *, may_end: bool) -> int | None:
        """Where among the events the pass begins that is the cycle; None: one of the next passes has left the loop."""

        def state() -> object:
            return (self.names.known(), self.tool, self.carried)

        return keep_cycle(self, opened.since, block.head.number, lambda: self._pass(block), state, may_end=may_end)

    def _is_cycle(self, block: Block, opened: Open, place: int) -> bool:
        """Whether a loop that nothing known ends is the cycle, not a wait for what ends it."""
        head = block.head
        if any(isinstance(event, (Motion, Unknown)) for event in self.events[opened.since :]):
            self.events.insert(place, CycleStart(head.number))
            if opened.left:
                text = "the loop is taken for the cycle: what ends it is known only while the program runs"
                self.note(head.number, text)
            return True
        if not opened.left:
            self.note(head.number, "the loop without end does not move the robot: it is planned up to there")
        return not opened.left

    def _pass(self, block: Block) -> bool:
        """Run a loop's body once; false: it has left the loop."""
        self.count(block.head.number)
        try:
            self.run_body(block.body)
        except Leave as leave:
            if leave.what not in ("break_", "continue_"):
                raise
            return leave.what == "continue_"
        return True

    def _skip(self, block: Block) -> None:
        """Lines that run or not, nobody knows: what they set is not known behind them, nor where the robot is."""
        head = block.head
        effects = self.search.of_block(block)
        self.forget(head, effects)
        here = self._opened_here()
        loop = next((one for one in here if one.is_loop), None)
        if loop is not None:
            loop.left |= effects.breaks | effects.continues
        if effects.returns | effects.halts:
            for one in here:
                one.left |= effects.returns | effects.halts
        ends = effects.halts or (effects.returns and not self.calls)
        waits = effects.waits or kind_of(head) == "while_"
        moves = effects.moves or (bool(ends) and loop is None)
        self.skipped(head.number, head.code_start, head.code, moves=moves, waits=waits)

    def _opened_here(self) -> list[Open]:
        """Loops that run in this function, and the function."""
        found: list[Open] = []
        for one in reversed(self.opened):
            found.append(one)
            if not one.is_loop:
                break
        return found


def defines(one: Line | Block) -> bool:
    """Whether a block is a function or a thread."""
    return isinstance(one, Block) and one.head.kind in ("def_", "thread")
