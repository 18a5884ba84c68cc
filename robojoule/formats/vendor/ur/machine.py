"""Running a URScript program as far as constants reach."""

from __future__ import annotations

from lark import Tree

from robojoule.formats.vendor.lines import Line, Node, first_word, flaw_of, short
from robojoule.formats.vendor.running import Leave
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import Beside, Blend, Load, Motion, PoseTarget, Wait
from robojoule.formats.vendor.ur.builtins import PAYLOADS, STREAMS
from robojoule.formats.vendor.ur.effects import assigned_by, parameters_of, thread_of
from robojoule.formats.vendor.ur.expressions import Pose, arguments_of
from robojoule.formats.vendor.ur.flow import Flow, Open, defines
from robojoule.formats.vendor.ur.motions import MOTIONS, Call, label_of, speed_of, target_of
from robojoule.formats.vendor.ur.payload import PARAMETERS
from robojoule.formats.vendor.ur.syntax import Block, name_of
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number
from robojoule.formats.vendor.zones import ASSUMED_BLEND

ADDED = "# robojoule"  # begins the comment of waits that plans add


class Machine(Flow):
    """Executes lines and collects events."""

    def __init__(self, top: list[Line | Block], beside: Beside) -> None:
        super().__init__(top, beside)
        self.motions: dict[int, Call] = {}

    def run(self) -> None:
        """Run the program: its lines outside of functions, or else the function that no other one calls."""
        loose = [one for one in self.top if not defines(one)]
        functions = [one for one in self.top if isinstance(one, Block) and one.head.kind == "def_"]
        is_loose = any(isinstance(one, Block) or one.kind in ("call_line", "assignment") for one in loose)
        try:
            if is_loose or not functions:
                self.run_body(self.top)
            else:
                self.run_body(self._program_of(functions).body)
        except Leave:
            pass

    def _program_of(self, functions: list[Block]) -> Block:
        calls = {name: set(self.search.of(block.body).calls) for name, block in self.functions.items()}
        names = [name_of(one.head) for one in functions]
        free = [name for name in names if not any(name in called for by, called in calls.items() if by != name)]
        chosen = (free or names)[0]
        if len(functions) > 1:
            why = "which no other function calls" if len(free) == 1 else "the first function that no other one calls"
            text = f"there are no lines outside of functions: {chosen}() is planned, {why}"
            self.note(self.functions[chosen].head.number, text)
        return self.functions[chosen]

    def step(self, line: Line) -> None:
        """One line that opens no block."""
        tree = line.tree
        if tree is None:
            if line.code and not line.code.startswith("$"):
                self._not_understood(line)
        elif line.kind == "assignment":
            self._assign(line, tree)
        elif line.kind == "declared":
            scope, name = assigned_by(tree)
            if name:
                self.names.set(name, UNKNOWN, scope)
        elif line.kind == "call_line":
            self._call(line, tree)
        elif line.kind in ("break_", "continue_"):
            raise Leave(line.kind)
        elif line.kind == "return_":
            self.look_at(line, tree)
            raise Leave("function")
        elif line.kind == "halt":
            raise Leave("program")
        elif line.kind == "run":
            self._check_thread(line, tree)
        elif line.kind == "join":
            self.events.append(Wait(line.code_start, line.number, None, short(line.code)))

    def _not_understood(self, line: Line) -> None:
        word = first_word(line.code)
        self.forget(line, self.search.of([line]))
        if word in MOTIONS or word in STREAMS:
            self.unknown(line.number, f"the motion is not understood{flaw_of(line.code)}: {short(line.code)}")
        else:
            self.note(line.number, f"not understood and kept{flaw_of(line.code)}: {short(line.code)}")

    def _assign(self, line: Line, tree: Node) -> None:
        scope, name = assigned_by(tree)
        *indices, last = [one for one in tree.children if isinstance(one, Tree)]
        if last.data == "run":
            self._check_thread(line, last)
            return
        if last.data == "call" and str(last.children[0]) in self.functions:
            self.look_at(line, tree, without=last)
            self._enter(str(last.children[0]), line, last)
            self.names.set(name, UNKNOWN, scope)
            return
        self.look_at(line, tree)
        value = self.value(last, line)
        if indices:
            known, index = self.names.get(name), self.value(indices[0].children[0], line)
            place = int(index.value) if isinstance(index, Number) else -1
            is_there = isinstance(known, tuple) and 0 <= place < len(known) and len(indices) == 1
            value = (*known[:place], value, *known[place + 1 :]) if is_there else UNKNOWN
        self.names.set(name, value, scope)

    def _check_thread(self, line: Line, tree: Node) -> None:
        """A thread runs beside the program: it must not move the robot, and may set variables at any time."""
        if line.code.startswith("kill"):
            return
        name = thread_of(tree)
        effects = self.search.of_calls([] if name is None else [name])
        for shared in effects.shared:
            self.names.forget_shared(shared, for_good=True)
        self.forget(line, effects)
        if name is None or effects.moves:
            whose = "" if name in self.functions else ", which is not in this file,"
            self.unknown(line.number, f"thread {name or short(line.code)}{whose} may move the robot")

    # Calls

    def _call(self, line: Line, tree: Node) -> None:
        name = str(tree.children[0])
        self.look_at(line, tree, without=tree)
        if name in self.functions:
            self._enter(name, line, tree)
        elif name in MOTIONS:
            self._motion(name, line, tree)
        elif name == "sleep":
            self._sleep(line, tree)
        elif name == "set_tcp":
            values = [self.value(one, line) for one in arguments_of(tree)[0]]
            self.tool = values[0].place if values and isinstance(values[0], Pose) else self.beside.tool
        elif name in PAYLOADS:
            self._payload(name, line, tree)
        elif name == "popup":
            self.events.append(Wait(line.code_start, line.number, None, short(line.code)))
        elif name in STREAMS:
            self.unknown(line.number, f"{name}() is a stream, not a planned motion")
        elif not self.search.is_harmless(name):
            self.unknown(line.number, f"{name}() is not in this file, it may move the robot", may_stand=True)

    def _enter(self, name: str, line: Line, tree: Node) -> None:
        """Run a function of the file in its place."""
        block = self.functions[name]
        if not self.may_call(line.number, f"{name}()"):
            self.forget(line, self.search.of_calls([name]))
            return
        by_place, by_name = arguments_of(tree)
        assert block.head.tree is not None
        parameters, names = list(block.head.tree.find_data("parameter")), parameters_of(block)
        given = dict(zip(names, by_place, strict=False)) | {key: node for key, node in by_name.items() if key in names}
        values: dict[str, Value] = {}
        for parameter, key in zip(parameters, names, strict=True):
            node = given.get(key, parameter.children[-1])
            values[key] = self.value(node, line) if isinstance(node, Tree) else UNKNOWN
        self.calls.append(f"{name}()")
        self.opened.append(Open(len(self.events), is_loop=False))
        try:
            with self.names.within(values):
                self.run_body(block.body)
        except Leave as leave:
            if leave.what != "function":
                raise
        finally:
            self.calls.pop()
            opened = self.opened.pop()
        self.may_have_left(opened, line, self.search.of_calls([name]))

    def _sleep(self, line: Line, tree: Node) -> None:
        values = [self.value(one, line) for one in arguments_of(tree)[0]]
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

    def _payload(self, name: str, line: Line, tree: Node) -> None:
        by_place, by_name = arguments_of(tree)
        nodes = dict(zip(PARAMETERS[name], by_place, strict=False)) | by_name
        payload, remark = self.carried.set(name, {key: self.value(node, line) for key, node in nodes.items()})
        if remark and payload is not None:
            self.note(line.number, f"{short(line.code)}: {remark}")
        self.events.append(Load(line.number, payload, short(line.code)))

    # Motions

    def _motion(self, name: str, line: Line, tree: Node) -> None:
        kind, names, defaults = MOTIONS[name]
        by_place, by_name = arguments_of(tree)
        nodes = dict(zip(names, by_place, strict=False)) | {key: node for key, node in by_name.items() if key in names}
        values: dict[str, Value] = {key: Number(value) for key, value in defaults.items()}
        values |= {key: self.value(node, line) for key, node in nodes.items()}
        goal = "pose_to" if name == "movec" else names[0]
        text = "" if goal not in nodes else self._text(line, nodes[goal])
        target = target_of(values.get(goal, UNKNOWN), self.tool, self.beside.base)
        via = target_of(values.get("pose_via", UNKNOWN), self.tool, self.beside.base) if name == "movec" else None
        radius = number(values["r"])
        blend = Blend(radius_m=radius) if radius else None
        if radius is None:
            blend = ASSUMED_BLEND
            self.note_zone(line.number, blend)
        self.motions[line.code_start] = Call(
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
                blend=blend,
                via=via if isinstance(via, PoseTarget) else None,
                reason="" if target is not None else f"its target is known only while the program runs: {text}",
                tool=self.tool,
            )
        )

    def _text(self, line: Line, node: Node) -> str:
        span = line.span(node)
        return line.text[span.start - line.start : span.end - line.start]
