"""How a RAPID program goes from statement to statement: routines, blocks, conditions, and what may have run."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence

from lark import Token

from robojoule.formats.vendor.cycles import keep_cycle
from robojoule.formats.vendor.lines import short
from robojoule.formats.vendor.rapid.effects import Effects, Search, functions_in, own_names_of
from robojoule.formats.vendor.rapid.expressions import Variables, value_of
from robojoule.formats.vendor.rapid.motions import Setting
from robojoule.formats.vendor.rapid.syntax import Block, Node, Routine, Statement, within
from robojoule.formats.vendor.running import Leave, Running, own_names
from robojoule.formats.vendor.trace import Beside, CycleStart, Motion, Unknown, Wait
from robojoule.formats.vendor.values import Number, Value, number


class Flow(Running):
    """Runs routines and blocks; what a statement does is for `step` to say."""

    def __init__(self, routines: Sequence[Routine], beside: Beside) -> None:
        super().__init__()
        self.routines = {routine.name: routine for routine in routines if not routine.is_trap}
        self.beside = beside
        self.search = Search(self.routines, beside.still)
        self.variables = Variables()
        self.setting = Setting()
        self.left: list[set[int]] = []  # of each routine that runs: lines that end it, nobody knows whether

    @abstractmethod
    def step(self, one: Statement) -> None:
        """Run one statement that opens no block."""

    @abstractmethod
    def forget_settings(self, one: Statement, names: set[str]) -> None:
        """Instructions that hold for what comes behind them may have run."""

    @abstractmethod
    def state(self) -> object:
        """What is known of data and settings, to compare passes of a loop."""

    def run_routine(self, routine: Routine, given: Mapping[str, Value] | None = None) -> dict[str, Value]:
        """Run a routine with these parameters; gives what they are at its end."""
        since = len(self.events)
        self.calls.append(routine.name)
        self.left.append(set())
        try:
            with own_names(self.variables.values, own_names_of(routine)):
                self.variables.values.update(given or {})
                try:
                    self.run_body(routine.body)
                except Leave as leave:
                    if leave.what != "routine":
                        raise
                ends = {name: self.variables.values[name] for name in given or {}}
        finally:
            self.calls.pop()
            left = self.left.pop()
        at = next(within(routine.body), None)
        if left and self.calls and at is not None:
            effects = self.search.of_calls([routine.name])
            self.forget(at, effects)
            if any(isinstance(event, (Motion, Unknown)) for event in self.events[since:]):
                places = ", ".join(map(str, sorted(left)))
                text = f"whether line {places} ends {routine.name} early is not known, nor where the robot is then"
                self.unknown(at.line, text)
        return ends

    def run_body(self, body: Sequence[Statement | Block]) -> None:
        """Run statements one after the other."""
        for one in body:
            self.count(one.head.line if isinstance(one, Block) else one.line)
            if isinstance(one, Block) and one.head.tree is None:
                self.skip(one.head, list(within([one]))[1:])
            elif isinstance(one, Block):
                rule: Callable[[Block], None] = getattr(self, f"_{one.head.kind.rstrip('_')}_block")
                rule(one)
            else:
                self.step(one)

    def look_at(self, one: Statement, node: Node | Token) -> None:
        """Functions that an expression calls may move the robot and set data."""
        for name in functions_in(node):
            effects = self.search.of_calls([name])
            self.forget(one, effects)
            if effects.moves:
                whose = "" if name in self.routines else " is not in this file, it"
                self.unknown(one.line, f"{name}(){whose} may move the robot: {short(one.code)}", may_stand=True)
            elif effects.waits:
                self.events.append(Wait(one.start, one.line, None, short(one.code)))

    def forget(self, one: Statement, effects: Effects) -> None:
        """What may have been set is not known any more."""
        for name in effects.sets:
            self.variables.forget(name)
        self.forget_settings(one, effects.settings)

    def _condition(self, one: Statement) -> Value:
        assert one.tree is not None
        self.look_at(one, one.tree.children[0])
        return value_of(one.tree.children[0], one, self.variables)

    def _if_block(self, block: Block) -> None:
        for head, body in [(block.head, block.body), *block.parts]:
            value = True if head.kind == "else_" else self._condition(head)
            if value is True:
                self.run_body(body)
                return
            if value is not False:
                self.skip(block.head, list(within([block]))[1:])
                return

    def _test_block(self, block: Block) -> None:
        value = self._condition(block.head)
        known = value if isinstance(value, str) else number(value)
        if known is None:
            self.skip(block.head, list(within([block]))[1:])
            return
        for head, body in block.parts:
            assert head.tree is not None
            cases = [value_of(one, head, self.variables) for one in head.tree.children]
            if head.kind == "default" or known in [one if isinstance(one, str) else number(one) for one in cases]:
                self.run_body(body)
                return

    def _for_block(self, block: Block) -> None:
        one = block.head
        assert one.tree is not None
        self.look_at(one, one.tree)
        counter, *rest = one.tree.children
        bounds = [number(value_of(node, one, self.variables)) for node in rest]
        known = [bound for bound in bounds if bound is not None]
        if len(known) < len(bounds) or (len(known) > 2 and known[2] == 0.0):
            self.skip(one, list(within([block]))[1:])
            return
        first, last = known[:2]
        step = known[2] if len(known) > 2 else math.copysign(1.0, last - first)
        value, name = first, str(counter).upper()
        with own_names(self.variables.values, [name]):
            while (value <= last) if step > 0.0 else (value >= last):
                self.count(one.line)
                self.variables.values[name] = Number(value, None, value.is_integer())
                self.run_body(block.body)
                value += step

    def _while_block(self, block: Block) -> None:
        """A loop: counted out, or, where nothing that is known ends it, one pass of it as the cycle."""
        one, since = block.head, len(self.events)
        effects = self.search.of(list(within([block]))[1:])
        is_endless = self._is_constant(one, effects)

        def next_pass() -> bool:
            self.count(one.line)
            self.run_body(block.body)
            return True

        while (condition := self._condition(one)) is True:
            next_pass()
            if is_endless:
                may_end = not effects.returns | effects.ends <= self.left[-1]
                self._end_with(one, since, keep_cycle(self, since, one.line, next_pass, self.state, may_end=may_end))
        if condition is not False:
            self.skip(one, list(within([block]))[1:])

    def _is_constant(self, one: Statement, effects: Effects) -> bool:
        """Whether a loop's condition stays what it is while it runs."""
        assert one.tree is not None
        named = {str(ref.children[0]).upper() for ref in one.tree.find_data("ref")}
        return not functions_in(one.tree) and not named & effects.sets

    def _end_with(self, one: Statement, since: int, place: int | None) -> None:
        """End with a loop that nothing known ends: it is the cycle, if it moves the robot."""
        if any(isinstance(event, (Motion, Unknown)) for event in self.events[since:]):
            self.events.insert(since if place is None else place, CycleStart(one.line))
        else:
            del self.events[since:]
            self.note(one.line, "the loop without end does not move the robot: it is planned up to there")
        raise Leave("program")

    def skip(self, head: Statement, body: Sequence[Statement]) -> None:
        """Statements that run or not, nobody knows: what they set is not known behind them, nor where the robot is."""
        effects = self.search.of(body)
        self.forget(head, effects)
        self.left[-1] |= effects.returns | effects.ends
        moves = effects.moves or bool(effects.ends) or (bool(effects.returns) and len(self.calls) < 2)
        waits = effects.waits or head.code.upper().startswith("WHILE")
        self.skipped(head.line, head.start, head.code, moves=moves, waits=waits)
