"""Running a KRL program as far as constants reach."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from lark import Token, Tree

from robojoule.formats.vendor.krl.expressions import arguments_of, path_of, root_of, value_of
from robojoule.formats.vendor.krl.flow import HARMLESS, Flow
from robojoule.formats.vendor.krl.syntax import Routine
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
from robojoule.formats.vendor.trace import Load, Motion, PoseTarget, Wait
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, number
from robojoule.robots.robot import Payload

ADDED = ";robojoule"  # begins the comment of waits that plans add
AXES = 6
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


@dataclass
class Setting:
    """How the speed of one motion statement is set.

    Attributes:
        line: Its line.
        percent: The speed that counted; None: it is not known. [%]
        data: Where the velocity of its motion data stands, if it has any.
    """

    line: Line
    percent: float | None
    data: set[Number] = field(default_factory=set)


@dataclass(frozen=True)
class Executed:
    """One execution of a joint motion.

    Attributes:
        statement: First character of its statement.
        set_by: Which setting of the speed of axes was in force; a number of its own where the motion says it itself.
        origin: Where that speed stands as a number; None: nowhere.
        percent: That speed; None: it is not known. [%]
    """

    statement: int
    set_by: int
    origin: Span | None
    percent: float | None


class Machine(Flow):
    """Executes routines and collects events."""

    def __init__(self, routines: list[Routine], data: list[Line], frames: Frames) -> None:
        super().__init__()
        self.routines = {routine.name: routine for routine in routines}
        self.frames = frames
        self.beside = frames.beside
        self.still = frames.beside.still
        self.carried: Payload | None = None
        self.told: set[str] = set()  # names of what is not simulated
        self.tool_settings = 0
        self.settings: dict[int, Setting] = {}
        self.executions: list[Executed] = []
        self.sets = 0
        self.continues = False
        self.calls_elsewhere = False  # programs of other files may move the robot at the speed that is set
        self.variables.values["$NULLFRAME"] = {name: Number(0.0) for name in "XYZABC"}
        for line in data:
            if line.kind in ("declaration", "assignment"):
                self.step(line)

    def run(self, routine: Routine) -> None:
        """Run a routine from its beginning."""
        self.calls.append(routine.name)
        try:
            self.run_body(routine.body)
        except Leave:
            pass
        finally:
            self.calls.pop()

    def step(self, line: Line) -> None:
        """One line that opens no block."""
        tree = line.tree
        if tree is None:
            if line.code and not line.code.startswith("&"):
                self._not_understood(line)
            return
        continues, self.continues = self.continues, line.kind == "continue_"
        if line.kind == "motion":
            self._motion(line, tree)
        elif line.kind in ("wait_sec", "wait_for"):
            self._wait(line, tree)
        elif line.kind == "assignment":
            self._assign(line, tree, continues=continues)
        elif line.kind == "declaration":
            self._declare(line, tree)
        elif line.kind == "call_line":
            self._call(line, tree)
        elif line.kind == "exit":
            raise Leave("loop")
        elif line.kind == "return_":
            raise Leave("routine")
        elif line.kind == "halt":
            self.events.append(Wait(line.code_start, line.number, None, "HALT"))
        elif line.kind == "goto":
            self.unknown(line.number, "GOTO is not followed")
            raise Leave("routine")

    def _not_understood(self, line: Line) -> None:
        word = first_word(line.code).upper()
        if word in ("PTP", "LIN", "CIRC", "SPTP", "SLIN", "SCIRC", "SPL", "PTP_REL", "LIN_REL", "CIRC_REL"):
            self.unknown(line.number, f"the motion is not understood{flaw_of(line.code)}: {short(line.code)}")
        elif word not in ("EXT", "EXTFCT", "GLOBAL", "INTERRUPT", "SIGNAL", "TRIGGER", "ENUM", "STRUC", "IMPORT"):
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
        told = self._told(line, tree)
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
        if is_joint:
            setting = self.settings.setdefault(line.code_start, Setting(line, speed.percent))
            setting.percent = speed.percent
            own = vel is not None
            set_by = -len(self.executions) - 1 if own else self.sets
            self.executions.append(Executed(line.code_start, set_by, origin, speed.percent))
            data = told.get("data", self.variables.values.get("PDAT_ACT"))
            if isinstance(data, Mapping) and isinstance(data.get("VEL"), Number):
                setting.data.add(data["VEL"])
        words = [str(one).upper() for one in tree.children if isinstance(one, Token) and one.type == "BLEND"]
        blend = blend_of(words, is_joint=is_joint, told=told, variables=self.variables)
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

    def _assign(self, line: Line, tree: Node, *, continues: bool) -> None:
        target, expression = tree.children
        assert isinstance(target, Tree)
        value = value_of(expression, line, self.variables)
        path = path_of(target, line, self.variables)
        if path is None:
            self.variables.forget(root_of(target))
            return
        self.variables.set(path, value)
        root = path[0]
        if path == ("$APO", "CPTP"):
            self.variables.set(APO_MODE, "")
        self.sets += root.startswith("$VEL_AXIS[")
        self._note_modal(root, path, value, line)
        if root in ("$TOOL", "$BASE"):
            self._frame(root, expression, value, line)
        elif root.startswith("TOOL_DATA[") or root.startswith("BASE_DATA["):
            self.frames.define(root, self.variables.values[root])
        elif root == "$LOAD":
            self._carry(line, payload_of(self.variables.values[root]), short(line.code))
        elif root.startswith(("$OUT", "$ANOUT")) and not continues:
            self.events.append(Wait(line.code_start, line.number, 0.0, short(line.code)))

    def _note_modal(self, root: str, path: tuple[str, ...], value: Value, line: Line) -> None:
        """Tell once of what acts on all motions and is not simulated."""
        name = root.partition("[")[0]
        is_full = number(value) == _FULL_PERCENT
        if name in NOT_SIMULATED and path != ("$ACC", "CP") and not is_full and name not in self.told:
            self.told.add(name)
            self.note(line.number, f"{name} is kept and not simulated: {NOT_SIMULATED[name]}")

    def _frame(self, root: str, expression: Node | Token, value: Value, line: Line) -> None:
        path = (
            path_of(expression, line, self.variables)
            if isinstance(expression, Tree) and expression.data == "ref"
            else None
        )
        self.frames.present(root, path[0] if path else "", self.variables.values[root] if path is None else value)

    def _carry(self, line: Line, payload: Payload | None, what: str) -> None:
        """What the robot carries, as far as that is news."""
        if payload != self.carried:
            self.carried = payload
            self.events.append(Load(line.number, payload, what))

    def _carry_by_tool(self, line: Line) -> None:
        """The load that belongs to the present tool's number, if its figures are known, where the tool was set."""
        if self.tool_settings == self.frames.tool_settings:
            return
        self.tool_settings = self.frames.tool_settings
        which = self.frames.tool_number
        payload = payload_of(self.variables.values.get(f"LOAD_DATA[{which}]")) or self.beside.payloads.get(which)
        if payload is not None:
            self._carry(line, payload, f"LOAD_DATA[{which}]")

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
            self.variables.set((name,), value_of(given[0], line, self.variables))

    # Calls

    def _call(self, line: Line, tree: Node) -> None:
        name = str(tree.children[0]).upper()
        nodes = arguments_of(tree)
        if name == "BAS":
            self._bas(line, nodes)
        elif name in self.routines:
            if not self.may_call(line.number, name):
                return
            routine = self.routines[name]
            for parameter, node in zip(routine.parameters, nodes, strict=False):
                self.variables.set((parameter,), value_of(node, line, self.variables))
            self.run(routine)
        elif name not in HARMLESS and name not in self.still:
            self.calls_elsewhere = True
            self.unknown(line.number, f"{name}() is not in this file, it may move the robot", may_stand=True)

    def _bas(self, line: Line, nodes: list[Node]) -> None:
        """The routine of the controller that sets speeds and frames."""
        word = str(value_of(nodes[0], line, self.variables)).upper()
        value = value_of(nodes[1], line, self.variables) if len(nodes) > 1 else UNKNOWN
        data, frame = (self.variables.values.get(name) for name in ("PDAT_ACT", "FDAT_ACT"))
        if word == "#INITMOV":
            self.set_speed(Number(100.0))
            self.frames.reset()
        elif word in ("#VEL_PTP", "#PTP_PARAMS"):
            self.set_speed(value)
        elif word == "#PTP_DAT":
            self.set_speed(data.get("VEL", UNKNOWN) if isinstance(data, Mapping) else UNKNOWN)
        elif word in ("#VEL_CP", "#CP_PARAMS"):
            self.variables.set(("$VEL", "CP"), value)
        elif word == "#ACC_CP":
            self.variables.set(("$ACC", "CP"), value)
        elif word == "#CP_DAT":
            path = self.variables.values.get("LDAT_ACT")
            self.variables.set(("$VEL", "CP"), path.get("VEL", UNKNOWN) if isinstance(path, Mapping) else UNKNOWN)
        if word in ("#PTP_PARAMS", "#PTP_DAT", "#CP_PARAMS", "#CP_DAT"):
            acting = data if "PTP" in word else self.variables.values.get("LDAT_ACT")
            distance = acting.get("APO_DIST", UNKNOWN) if isinstance(acting, Mapping) else UNKNOWN
            self.variables.set(("$APO", "CPTP"), distance)
            self.variables.set(("$APO", "CDIS"), distance)
            mode = acting.get("APO_MODE") if isinstance(acting, Mapping) and "PTP" in word else None
            self.variables.set(APO_MODE, mode if isinstance(mode, str) else "")
        if word in ("#FRAMES", "#PTP_PARAMS", "#CP_PARAMS") and isinstance(frame, Mapping):
            self.frames.take(frame)
        elif word == "#TOOL":
            self.frames.set_tool(value)
        elif word == "#BASE":
            self.frames.set_base(value)

    def set_speed(self, value: Value) -> None:
        """See `Flow`."""
        self.sets += 1
        for axis in range(1, AXES + 1):
            self.variables.values[f"$VEL_AXIS[{axis}]"] = value
