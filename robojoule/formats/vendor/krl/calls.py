"""Calls in a KRL program: its own routines, those of the controller, and those of other files."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

from lark import Token

from robojoule.formats.vendor.krl.changes import (
    HARMLESS,
    calls_of,
    changed_by,
    handed_over,
    name_of,
    stops_advance,
)
from robojoule.formats.vendor.krl.expressions import FUNCTIONS, arguments_of, path_of, root_of, value_of
from robojoule.formats.vendor.krl.flow import Flow
from robojoule.formats.vendor.krl.syntax import Routine, within
from robojoule.formats.vendor.krl.targets import APO_MODE, Frames
from robojoule.formats.vendor.lines import Line, Node, short
from robojoule.formats.vendor.running import Leave, own_names
from robojoule.formats.vendor.trace import Load, Wait
from robojoule.formats.vendor.values import UNKNOWN, Number, Value, unplaced
from robojoule.robots.robot import Payload

AXES = 6


class Calls(Flow):
    """Runs calls, and keeps what they and assignments set for all motions: speeds, frames, the payload."""

    def __init__(self, routines: list[Routine], frames: Frames) -> None:
        super().__init__()
        self.routines = {routine.name: routine for routine in routines}
        self.frames = frames
        self.still = frames.beside.still
        self.carried: Payload | None = None
        self.sets = 0  # how often the speed of axes was set
        self.executed = 0  # how many joint motions have run
        self.set_before = [0] * AXES  # how many of them had when the speed of each axis was set
        self.calls_elsewhere = False  # programs of other files may move the robot at the speed that is set
        self.continues = False  # the line before is a CONTINUE
        self.result: Value = UNKNOWN  # of the function that has run last

    def run(self, routine: Routine) -> None:
        """Run a program from its beginning."""
        with suppress(Leave):
            self._routine(routine)

    def _routine(self, routine: Routine) -> None:
        """Run a routine; only the end of the program goes on to its caller."""
        self.calls.append(routine.name)
        outer = self.may_have_left
        try:
            self.run_body(routine.body)
        except Leave as leave:
            if leave.what == "program":
                raise
        finally:
            self.calls.pop()
            self.may_have_left = outer

    def call_functions(self, line: Line) -> None:
        """See `Flow`."""
        continued, self.continues = self.continues, line.kind == "continue_"
        for call in calls_of(line):
            if call is not line.tree and name_of(call) not in FUNCTIONS:
                self.variables.returned[id(call)] = self._called(line, call)
        if not continued and stops_advance(line):
            self.events.append(Wait(line.code_start, line.number, 0.0, short(line.code)))

    def call(self, line: Line, tree: Node) -> None:
        """A line that is a call."""
        if name_of(tree) == "BAS":
            self._bas(line, arguments_of(tree))
        else:
            self._called(line, tree)

    def _called(self, line: Line, call: Node) -> Value:
        """Run a routine of the file, or tell of one that is elsewhere."""
        name, arguments = name_of(call), arguments_of(call)
        if name in self.routines:
            return self._own(line, self.routines[name], arguments)
        if name in HARMLESS:
            return UNKNOWN
        for root in sorted(set(handed_over(arguments, None))):
            self.forget(root, line)
        if name not in self.still:
            self.calls_elsewhere = True
            self.unknown(line.number, f"{name}() is not in this file, it may move the robot", may_stand=True)
        return UNKNOWN

    def _own(self, line: Line, routine: Routine, arguments: list[Node]) -> Value:
        """Run a routine of the file in its place, with names of its own."""
        if not self.may_call(line.number, routine.name):
            for root in sorted(changed_by(within(routine.body), self.routines) - routine.own):
                self.forget(root, line)
            return UNKNOWN
        values = self.variables.values
        given = [unplaced(value_of(node, line, self.variables)) for node in arguments]
        parameters = list(zip(routine.parameters, routine.modes, arguments, given, strict=False))
        with own_names(values, routine.own):
            values.update({name: value for name, _, _, value in parameters})
            self.result = UNKNOWN
            self._routine(routine)
            result = self.result
            ends = [values.get(name, UNKNOWN) for name, _, _, _ in parameters]
        for (_, mode, node, before), end in zip(parameters, ends, strict=True):
            if node.data == "ref" and mode != "IN":
                self._hand_back(line, node, end if mode == "OUT" or end == before else UNKNOWN)
        return result

    def _hand_back(self, line: Line, node: Node, value: Value) -> None:
        """Give a variable that was handed over by reference the value that it has at the end of a call."""
        path = path_of(node, line, self.variables)
        is_whole_array = any(isinstance(part.children[0], Token) for part in node.find_data("indices"))
        if path is None or is_whole_array:
            self.forget(root_of(node), line)
        else:
            self.variables.set(path, value)

    def forget(self, name: str, line: Line) -> None:
        """See `Flow`."""
        self.variables.forget(name)
        if name == "$VEL_AXIS":
            self.set_speed(UNKNOWN)
        elif name == "$TOOL":
            self.frames.set_tool(UNKNOWN)
        elif name == "$BASE":
            self.frames.set_base(UNKNOWN)
        elif name in ("TOOL_DATA", "BASE_DATA"):
            self.frames.overwrite(name)
        elif name == "$LOAD":
            self.carry(line, None, f"$LOAD behind {short(line.code)}")

    def carry(self, line: Line, payload: Payload | None, what: str) -> None:
        """What the robot carries, as far as that is news; None: it is not known."""
        if payload is None or payload != self.carried:
            self.carried = payload
            self.events.append(Load(line.number, payload, what))

    def set_speed(self, value: Value) -> None:
        """Set the speed of all axes."""
        self.sets += 1
        for axis in range(1, AXES + 1):
            self.variables.values[f"$VEL_AXIS[{axis}]"] = value
        self.set_before = [self.executed] * AXES

    def set_axis(self, root: str) -> None:
        """The speed of one axis was set; those of external axes do not count."""
        for axis in range(1, AXES + 1):
            if root == f"$VEL_AXIS[{axis}]":
                self.sets += 1
                self.set_before[axis - 1] = self.executed

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
