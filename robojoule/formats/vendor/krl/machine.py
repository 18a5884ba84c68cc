"""Running a KRL program as far as constants reach."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace

from lark import Token, Tree

from robojoule.formats.vendor.krl.calls import AXES, Calls
from robojoule.formats.vendor.krl.changes import MOTIONS, changed_by, may_move
from robojoule.formats.vendor.krl.executions import Executed, Mark, Setting, Spline
from robojoule.formats.vendor.krl.expressions import arguments_of, path_of, root_of, value_of
from robojoule.formats.vendor.krl.syntax import Block, Routine, action_of, within
from robojoule.formats.vendor.krl.targets import (
    APO_MODE,
    Frames,
    blend_of,
    path_speed_of,
    payload_of,
    speed_of,
    target_of,
)
from robojoule.formats.vendor.lines import Line, Node, first_word, flaw_of, short
from robojoule.formats.vendor.running import Leave
from robojoule.formats.vendor.text import Span
from robojoule.formats.vendor.trace import Blend, Motion, PoseTarget, Wait
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number, unplaced
from robojoule.formats.vendor.zones import ASSUMED_BLEND

ADDED = ";robojoule"  # begins the comment of waits that plans add
_FULL_PERCENT = 100.0
NOT_SIMULATED = {
    "$OV_PRO": "speeds are those at an override of 100 %",
    "$ACC_AXIS": "accelerations are those of the robot",
    "$ACC_AXIS_C": "accelerations are those of the robot",
    "$ACC": "turns of the tool have accelerations that are assumed",
    "$VEL_AXIS_C": "speeds within zones are those of the motions",
    "$GEAR_JERK": "the jerk is that of the robot",
    "$RED_VEL": "speeds are those that the program gives",
}


class Machine(Calls):
    """Executes routines and collects events."""

    def __init__(self, routines: list[Routine], data: list[Line], frames: Frames) -> None:
        super().__init__(routines, frames)
        self.beside = frames.beside
        self.told: set[str] = set()  # names of what is not simulated
        self.tool_settings = 0
        self.settings: dict[int, Setting] = {}
        self.executions: list[Executed] = []
        self.spline: Spline | None = None
        self.splined: set[int] = set()  # motions that have run in blocks of splines
        self.variables.values["$NULLFRAME"] = {name: Number(0.0) for name in "XYZABC"}
        for line in data:
            if line.kind in ("declaration", "assignment"):
                self.step(line)

    def mark(self) -> Mark:
        """See `Flow`."""
        settings = {statement: replace(one, data=set(one.data)) for statement, one in self.settings.items()}
        return Mark(len(self.events), len(self.executions), self.carried, settings)

    def back_to(self, mark: object) -> None:
        """See `Flow`."""
        assert isinstance(mark, Mark)
        del self.events[mark.events :], self.executions[mark.executions :]
        self.carried, self.settings = mark.carried, mark.settings

    def state(self) -> object:
        """See `Flow`."""
        frames = self.frames
        return (self.variables.values.copy(), frames.tool, frames.base, sorted(frames.overwritten), self.carried)

    def step(self, line: Line) -> None:
        """One line that opens no block."""
        tree = line.tree
        if tree is None:
            if line.code and not line.code.startswith("&"):
                self._not_understood(line)
            return
        self.call_functions(line)
        if line.kind == "motion":
            self._motion(line, tree)
        elif line.kind in ("wait_sec", "wait_for"):
            self._wait(line, tree)
        elif line.kind == "assignment":
            self._assign(line, tree)
        elif line.kind == "declaration":
            self._declare(line, tree)
        elif line.kind == "call_line":
            self.call(line, tree)
        elif line.kind == "exit":
            raise Leave("loop")
        elif line.kind == "return_":
            self.result = value_of(tree.children[0], line, self.variables) if tree.children else UNKNOWN
            raise Leave("routine")
        elif line.kind == "halt":
            self.events.append(Wait(line.code_start, line.number, None, "HALT"))
        elif line.kind == "label":
            self._label(line, str(tree.children[0]).upper())
        elif line.kind == "goto":
            self.unknown(line.number, "GOTO is not followed")
            raise Leave("goto")

    def _label(self, line: Line, name: str) -> None:
        """A label: a GOTO of its routine may have led here, from where other lines have run."""
        lines = list(within(self.routines[self.calls[-1]].body))
        for jump in lines:
            if jump.kind == "goto" and jump.tree is not None and str(jump.tree.children[0]).upper() == name:
                ends = sorted((jump.number, line.number))
                for root in sorted(changed_by([one for one in lines if ends[0] < one.number < ends[1]], self.routines)):
                    self.forget(root, line)
                self.unknown(
                    line.number, f"{name} is reached from several places: the robot's position is not known behind it"
                )

    def _beside(self, line: Line, word: str) -> None:
        """What a TRIGGER does on the way of a motion, or an INTERRUPT at any time."""
        action = action_of(line)
        sets = changed_by([action], self.routines)
        for root in sorted(sets):
            self.forget(root, line)
        if word != "TRIGGER":
            self.variables.changing |= sets
            if may_move([action], self.routines, self.still):
                text = f"the interrupt may move the robot, apart from the cycle: {action.code}"
                self.note(line.number, text)

    def _not_understood(self, line: Line) -> None:
        word = first_word(line.code.upper().removeprefix("GLOBAL ")).upper()
        for root in sorted(changed_by([line], self.routines)):
            self.forget(root, line)
        if word in ("INTERRUPT", "TRIGGER"):
            self._beside(line, word)
        elif word in MOTIONS:
            self.unknown(line.number, f"the motion is not understood{flaw_of(line.code)}: {short(line.code)}")
        elif word not in ("EXT", "EXTFCT", "GLOBAL", "SIGNAL", "ENUM", "STRUC", "IMPORT"):
            self.note(line.number, f"not understood and kept{flaw_of(line.code)}: {short(line.code)}")

    # Motions

    def _motion(self, line: Line, tree: Node) -> None:
        kind = str(tree.children[0]).upper()
        expressions = [
            one for one in tree.children[1:] if isinstance(one, Tree) and one.data not in ("angle", "with_part")
        ]
        first = expressions[0]
        if first.data == "ref" and root_of(first) in ("$AXIS_ACT", "$POS_ACT"):
            return  # to where the robot is
        spline, frames = self.spline, copy(self.frames)
        told = {**(spline.told if spline is not None else {}), **self._told(line, tree)}
        self._carry_by_tool(line)
        values = [value_of(one, line, self.variables) for one in expressions]
        label = "".join(
            line.code[one.meta.start_pos : one.meta.end_pos] for one in expressions[-1:] if one.data == "ref"
        )
        name = label[1:] if label[:1].upper() == "X" and len(label) > 1 else label
        target, reason = target_of(kind, values[-1], self.frames, label or "the target", "#TOOL" in line.code.upper())
        via = target_of(kind, values[0], self.frames, label, False)[0] if len(values) > 1 else None
        is_joint = "PTP" in kind
        if any(True for _ in tree.find_data("angle")):
            target, reason = None, "the angle CA is not followed"
        vel = told.get("$VEL_AXIS[1]") if "$VEL_AXIS[1]" in told else None
        axes = (
            [vel]
            if vel is not None
            else [self.variables.values.get(f"$VEL_AXIS[{axis}]") for axis in range(1, AXES + 1)]
        )
        speed, origin = speed_of(axes)
        if not is_joint:
            speed = path_speed_of(told, self.variables)
        own = vel is not None
        if spline is not None:
            speed = replace(speed, writable=False)
        if is_joint and not (spline is not None and own):
            head = line if spline is None else spline.block.head  # before which a line may set its speed
            setting = self.settings.setdefault(head.code_start, Setting(head, speed.percent))
            setting.percent = speed.percent
            set_by = -len(self.executions) - 1 if own else self.sets
            self.executed += 1
            shared = frozenset(one.origin for one in axes if isinstance(one, Number) and one.origin is not None)
            is_partly_set = not own and len({*self.set_before}) > 1
            others = shared if is_partly_set or origin is None else frozenset()
            self.executions.append(Executed(head.code_start, set_by, origin, speed.percent, others, is_partly_set))
            data = told.get("data", self.variables.values.get("PDAT_ACT"))
            if spline is None and isinstance(data, Mapping) and isinstance(data.get("VEL"), Number):
                setting.data.add(data["VEL"])
        blend = self._blend(line, tree, told, is_joint=is_joint)
        if spline is None or line.code_start == spline.last:
            self.note_zone(line.number, blend)
        motion = Motion(
            statement=line.code_start,
            line=line.number,
            label=name,
            kind="joint" if is_joint else "circular" if "CIRC" in kind else "linear",
            target=target,
            speed=speed,
            blend=blend,
            via=via if isinstance(via, PoseTarget) else None,
            reason=reason,
            tool=self.frames.tool,
        )
        self.events.append(motion)
        self._back_to_frames(frames)

    def _back_to_frames(self, frames: Frames) -> None:
        """Tool and base as they were before WITH has set them for one motion, or for one block."""
        was = self.frames.tool_settings
        frames.tool_settings = was + (was != frames.tool_settings)
        self.frames = frames

    def _blend(self, line: Line, tree: Node, told: Mapping[str, Value], *, is_joint: bool) -> Blend | None:
        """How a motion is blended; in a block of splines, all but the last one pass their points."""
        if self.spline is not None:
            foot = self.spline.block.foot
            if line.code_start != self.spline.last:
                return ASSUMED_BLEND
            assert foot is None or foot.tree is not None
            tree = foot.tree if foot is not None and foot.tree is not None else Tree("nothing", [])
        words = [str(one).upper() for one in tree.children if isinstance(one, Token) and one.type == "BLEND"]
        return blend_of(words, is_joint=is_joint, told=told, variables=self.variables)

    def _spline_block(self, block: Block) -> None:
        """See `Flow`."""
        head, motions = block.head, [line.code_start for line in block.lines() if line.kind == "motion"]
        if not motions or head.tree is None:
            self.run_body(block.body)
            return
        what = "motions of this block keep their speed, without waits between them"
        self.note(head.number, f"{what}; each is taken to pass its point within half of the way")
        self.splined |= {*motions}
        frames = copy(self.frames)
        self.spline = Spline(block, motions[-1], self._told(head, head.tree))
        try:
            self.run_body(block.body)
        finally:
            self.spline = None
        self._back_to_frames(frames)

    def _told(self, line: Line, tree: Node) -> dict[str, Value]:
        """What WITH sets for one motion: speeds, tool and base, motion data."""
        told: dict[str, Value] = {}
        for one in tree.find_data("setting"):
            path = path_of(one.children[0], line, self.variables)  # type: ignore[arg-type]
            node = one.children[1]
            if path is None or not isinstance(node, Tree):
                continue
            name = str(node.children[0]).upper() if node.data == "call" else ""
            inner = [value_of(arg, line, self.variables) for arg in arguments_of(node)] if name else []
            value = inner[0] if inner else UNKNOWN
            if path[0].startswith("$VEL_AXIS["):
                told["$VEL_AXIS[1]"] = value if name == "SVEL_JOINT" else value_of(node, line, self.variables)
            elif path[0] == "$VEL" and name == "SVEL_CP":
                told["$VEL.CP"] = value
            elif name == "STOOL2":
                self.frames.set_tool(value.get("TOOL_NO") if isinstance(value, Mapping) else UNKNOWN)
            elif name == "SBASE":
                self.frames.set_base(value)
            elif path in (("$TOOL",), ("$BASE",)):
                self._frame(path[0], node, value_of(node, line, self.variables), line)
            elif name in ("SAPO_PTP", "SAPO"):
                told["data"] = value
        return told

    # Waits

    def _wait(self, line: Line, tree: Node) -> None:
        if line.kind == "wait_sec":
            value = value_of(tree.children[0], line, self.variables)
            seconds = number(value)
            added = line.comment.startswith(ADDED) and isinstance(value, Number) and value.origin is not None
            self.events.append(
                Wait(
                    line.code_start,
                    line.number,
                    None if seconds is None else max(seconds, 0.0),
                    short(line.code),
                    added=added,
                    value=value.origin if isinstance(value, Number) and added else None,
                    whole=Span(line.start, line.end, line.file) if added else None,
                )
            )
        else:
            self.events.append(Wait(line.code_start, line.number, None, short(line.code)))

    # Variables

    def _assign(self, line: Line, tree: Node) -> None:
        target, expression = tree.children
        assert isinstance(target, Tree)
        value = value_of(expression, line, self.variables)
        path = path_of(target, line, self.variables)
        if path is None:
            self.forget(root_of(target), line)
            return
        root = path[0]
        self.variables.set(path, value if root.startswith("$VEL_AXIS[") or len(path) > 1 else unplaced(value))
        if path == ("$APO", "CPTP"):
            self.variables.set(APO_MODE, "")
        self.set_axis(root)
        self._note_modal(root, path, value, line)
        if root in ("$TOOL", "$BASE"):
            self._frame(root, expression if len(path) == 1 else target, self.variables.values[root], line)
        elif root.startswith("TOOL_DATA[") or root.startswith("BASE_DATA["):
            self.frames.define(root, self.variables.values[root])
        elif root == "$LOAD":
            self.carry(line, payload_of(self.variables.values[root]), short(line.code))

    def _note_modal(self, root: str, path: tuple[str, ...], value: Value, line: Line) -> None:
        """Tell once of what acts on all motions and is not simulated."""
        name = root.partition("[")[0]
        is_full = number(value) == _FULL_PERCENT
        if name in NOT_SIMULATED and path != ("$ACC", "CP") and not is_full and name not in self.told:
            self.told.add(name)
            self.note(line.number, f"{name} is kept and not simulated: {NOT_SIMULATED[name]}")

    def _frame(self, root: str, node: Node | Token, value: Value, line: Line) -> None:
        """Tool or base is set, by a variable or by a value."""
        path = path_of(node, line, self.variables) if isinstance(node, Tree) and node.data == "ref" else None
        self.frames.present(root, path[0] if path else "", value)

    def _carry_by_tool(self, line: Line) -> None:
        """The load that belongs to the present tool's number, if its figures are known, where the tool was set."""
        if self.tool_settings == self.frames.tool_settings:
            return
        self.tool_settings = self.frames.tool_settings
        which = self.frames.tool_number
        payload = payload_of(self.variables.values.get(f"LOAD_DATA[{which}]")) or self.beside.payloads.get(which)
        if payload is not None or self.carried is not None:
            self.carry(line, payload, f"LOAD_DATA[{which}]" if which else "the load of the tool")

    def _declare(self, line: Line, tree: Node) -> None:
        for one in tree.find_data("declarator"):
            name = str(one.children[0]).upper()
            given = [part for part in one.children[1:] if isinstance(part, Tree) and part.data != "indices"]
            if not given:
                if line.file == 0 and name not in self.variables.values:
                    self.variables.values[name] = UNKNOWN
                continue
            indices = [part for part in one.children[1:] if isinstance(part, Tree) and part.data == "indices"]
            if indices and indices[0].children and not isinstance(indices[0].children[0], Token):
                continue
            self.variables.set((name,), unplaced(value_of(given[0], line, self.variables)))
