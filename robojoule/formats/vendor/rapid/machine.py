"""Running a RAPID program as far as constants reach."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from lark import Tree

from robojoule.formats.vendor.lines import flaw_of, short
from robojoule.formats.vendor.rapid.data import payload_of, tool_of
from robojoule.formats.vendor.rapid.effects import declared_by, given_to, is_return, own_names_of, shared_by
from robojoule.formats.vendor.rapid.expressions import arguments_of, path_of, value_of
from robojoule.formats.vendor.rapid.flow import Flow
from robojoule.formats.vendor.rapid.instructions import CHANGING, HARMLESS, NOT_SIMULATED, SETTINGS, WAITS
from robojoule.formats.vendor.rapid.motions import FORMS, read_motion
from robojoule.formats.vendor.rapid.syntax import Node, Routine, Statement, within
from robojoule.formats.vendor.running import Leave
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import Beside, Load, Wait
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload

ADDED = "!robojoule"  # begins the comment of waits that plans add
_NOTHING_KG = 0.001  # load0's mass, which stands for none


class Machine(Flow):
    """Executes procedures and collects events."""

    def __init__(self, routines: Sequence[Routine], data: Sequence[Statement], beside: Beside) -> None:
        super().__init__(routines, beside)
        self.places: dict[int, Span] = {}
        self.grip: Value = self.variables.values["LOAD0"]
        self.tool: Value = None
        self.load: Payload | None = None
        self.is_carried_known = True
        for one in data:
            if one.kind == "declaration" and one.tree is not None:
                self.step(one)
                name, is_constant = declared_by(one.tree), "CONST" in one.code.upper().split()
                (self.variables.fixed.add if is_constant else self.variables.fixed.discard)(name)
        self.shared = {name: one.line for one in data if (name := shared_by(one))}
        self.variables.read.clear()
        for trap in (one for one in routines if one.is_trap):
            effects = self.search.of(within(trap.body))
            self.variables.changing |= effects.sets - own_names_of(trap)
            if effects.moves:
                text = f"the trap {trap.name} may move the robot, apart from the cycle"
                self.note(trap.line, text)

    def run(self, routine: Routine) -> None:
        """Run a program from the beginning of its main procedure."""
        with suppress(Leave):
            self.run_routine(routine)
        text = "PERS data count as the file has them, other modules and tasks may change them"
        for name in sorted(self.shared.keys() & self.variables.read):
            self.note(self.shared[name], text)

    def state(self) -> object:
        """See `Flow`."""
        return (self.variables.values.copy(), self.setting, self.grip, self.load)

    def step(self, one: Statement) -> None:
        """One statement that opens no block."""
        tree = one.tree
        if tree is None:
            text = f"not understood{flaw_of(one.code)}, it may move the robot: {short(one.code)}"
            self.forget(one, self.search.of([one]))
            self.unknown(one.line, text, may_stand=True)
            return
        if one.kind == "compact_if":
            self._compact_if(one, tree)
            return
        self.look_at(one, tree)
        if one.kind == "declaration":
            self._declare(one, tree)
        elif one.kind == "assignment":
            self._assign(one, tree)
        elif one.kind == "call":
            self._call(one, tree)
        elif one.kind == "late_call":
            self._late_call(one, tree)
        elif one.kind == "stop":
            self.events.append(Wait(one.start, one.line, None, "Stop"))
        elif one.kind == "label":
            self._label(one, str(tree.children[0]))
        elif one.kind == "goto":
            self.unknown(one.line, "GOTO is not followed")
            raise Leave("routine")
        elif one.kind == "return_":
            raise Leave("routine" if is_return(one) else "program")

    def _label(self, one: Statement, name: str) -> None:
        """A label: a GOTO of its routine may have led here, from where other statements have run."""
        found = list(within(self.routines[self.calls[-1]].body))
        for jump in found:
            jumps = [] if jump.tree is None else jump.tree.find_data("goto")
            if any(str(node.children[0]).upper() == name.upper() for node in jumps):
                first, last = sorted((jump.start, one.start))
                self.forget(one, self.search.of(other for other in found if first < other.start < last))
                self.unknown(
                    one.line, f"{name} is reached from several places: the robot's position is not known behind it"
                )

    # Data

    def _declare(self, one: Statement, tree: Node) -> None:
        given = [
            child for child in tree.children if isinstance(child, Tree) and child.data not in ("scope", "dimensions")
        ]
        name = declared_by(tree)
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
        elif name in SETTINGS:
            getattr(self, f"_{name.lower()}")(one, tree)
        elif name in HARMLESS:
            if name in CHANGING:
                self._forget_first(one, tree)
            if name in NOT_SIMULATED:
                self.note(one.line, f"{tree.children[0]} is kept and not simulated: {NOT_SIMULATED[name]}")
        elif name not in self.beside.still:
            self.unknown(one.line, f"{tree.children[0]} is not in this file, it may move the robot", may_stand=True)

    def _own_call(self, one: Statement, tree: Node, routine: Routine) -> None:
        if not self.may_call(one.line, routine.name):
            self.forget(one, self.search.of_calls([routine.name]))
            return
        given = given_to(routine, *arguments_of(tree))
        values = {name: True if node is None else value_of(node, one, self.variables) for name, node in given.items()}
        references = {
            name: (str(node.children[0]), path_of(node, one, self.variables))
            for name, node in given.items()
            if name in routine.by_reference and isinstance(node, Tree) and node.data == "ref"
        }
        ends = self.run_routine(routine, values)
        for name, (root, path) in references.items():
            if path is None:
                self.variables.forget(root)
            else:
                self.variables.set(path, ends.get(name, UNKNOWN))

    def _late_call(self, one: Statement, tree: Node) -> None:
        name = value_of(tree.children[0], one, self.variables)
        if isinstance(name, str) and name.upper() in self.routines:
            self._own_call(one, tree, self.routines[name.upper()])
        else:
            self.unknown(
                one.line, f"which procedure runs is not known, it may move the robot: {short(one.code)}", may_stand=True
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
                self.note(one.line, "the speed is taken for the flange's: the tool is not in the file")
        self.note_zone(one.line, found.motion.blend)
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
            self.note(one.line, f"{short(one.code)} is not known: neither are speeds by speeddata behind it")
            self.setting.velocity_share = None
            return
        self.setting.velocity_share, self.setting.most_m_s = min(share, 100.0) / 100.0, most / 1e3
        if share != 100.0:
            self.note(one.line, r"VelSet is taken to act on speeddata and not on \T")

    def _accset(self, one: Statement, tree: Node) -> None:
        plain, _ = arguments_of(tree)
        shares = [number(value_of(node, one, self.variables)) for node in plain]
        if any(share != 100.0 for share in shares):
            self.note(one.line, f"{short(one.code)} is kept and not simulated: accelerations are those of the robot")

    def _confj(self, one: Statement, tree: Node) -> None:
        _, named = arguments_of(tree)
        self.setting.configured = "OFF" not in named

    def _confl(self, one: Statement, tree: Node) -> None:
        _, named = arguments_of(tree)
        self.setting.path_configured = "OFF" not in named

    def _pdispon(self, one: Statement, tree: Node) -> None:
        self.setting.is_displaced = True

    _pdispset = _pdispon

    def _pdispoff(self, one: Statement, tree: Node) -> None:
        self.setting.is_displaced = False

    def _gripload(self, one: Statement, tree: Node) -> None:
        plain, _ = arguments_of(tree)
        self.grip = value_of(plain[0], one, self.variables) if plain else UNKNOWN
        self._carry(one)

    def _carry(self, one: Statement) -> None:
        """Say what the robot carries where that has changed: its tool and what is gripped."""
        held = self.tool[2] if isinstance(self.tool, list) and len(self.tool) == 3 else None
        parts, frame = [payload_of(held), payload_of(self.grip)], tool_of(self.tool)
        if parts[1] is None and self.is_carried_known:
            self.is_carried_known, self.load = False, None
            self.events.append(Load(one.line, None, f"what is gripped by {short(one.code)}"))
        if parts[0] is None or parts[1] is None or frame is None:
            return
        load = _both(parts[0], parts[1], frame)
        says_nothing = load.mass_kg <= (_NOTHING_KG if self.load is None else 0.0)  # as tool0 does
        if load != self.load and not says_nothing:
            self.load, self.is_carried_known = load, True
            self.events.append(Load(one.line, load, f"{load.mass_kg:g} kg by tooldata and loaddata"))

    def forget_settings(self, one: Statement, names: set[str]) -> None:
        """Instructions that hold for what comes behind them may have run."""
        if "VELSET" in names:
            self.setting.velocity_share = None
        self.setting.is_displaced |= not names.isdisjoint(("PDISPON", "PDISPSET"))
        if "GRIPLOAD" in names:
            self.grip = UNKNOWN
            self._carry(one)
        for name in sorted(names & {"CONFJ", "CONFL"}):
            self.note(one.line, f"whether {name.title()[:-1]}{name[-1]} acts is not known behind it: taken as before")

    def _compact_if(self, one: Statement, tree: Node) -> None:
        condition, inner = tree.children
        assert isinstance(inner, Tree)
        self.look_at(one, condition)
        value = value_of(condition, one, self.variables)
        part = Statement(one.line, one.start, one.end, one.code, inner, one.comment, one.lines)
        if value is True:
            self.step(part)
        elif value is not False:
            self.skip(one, [part])


def _both(tool: Payload, part: Payload, frame: Placement) -> Payload:
    """A tool, whose figures are in the flange's frame, and what it grips, whose figures are in the tool's, as one."""
    if part.mass_kg <= _NOTHING_KG:
        return tool
    body = tool.body + part.body.placed(frame)
    return Payload(body.mass_kg, tuple(body.center_m.tolist()), body.inertia_kg_m2)
