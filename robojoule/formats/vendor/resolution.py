"""Operation trees of vendors' programs: positions followed from motion to motion, speeds as shares of the limits."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
from pydantic import ValidationError

from robojoule.errors import InputError
from robojoule.formats.vendor.poses import NotKnown, Poses, Position
from robojoule.formats.vendor.repetition import six_moments, tied
from robojoule.formats.vendor.resolved import Resolution
from robojoule.formats.vendor.speed_limits import Execution, SpeedLimits
from robojoule.formats.vendor.trace import (
    CycleStart,
    Event,
    JointTarget,
    Load,
    Motion,
    NeedsRobot,
    Note,
    PoseTarget,
    Trace,
    Unknown,
    Wait,
    check_bounds,
)
from robojoule.formats.vendor.zones import Step, with_ends, zone_of
from robojoule.inputs import counted, shown
from robojoule.programs.operation_tree import (
    FORMAT,
    FORMAT_VERSION,
    LEAST_SPEED_PERCENT,
    MoveOperation,
    OperationTree,
    PayloadOperation,
    UnknownOperation,
    WaitOperation,
)
from robojoule.robots.pendant_file import Angles
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.vendor_frames import payload_of_vendor

MOST_MOTIONS = 20_000  # of a cycle; beyond it a loop was not meant
SAME_EXTERNAL = 1e-6  # of positions of external axes: rounding
SAME_POSITION_RAD = 1e-6
_MOST_RAD = 1e3  # of a joint; simulations of farther ones would not end
_KEPT = "is kept as it is:"
_FIRST_MOTION = "the first motion starts at an unknown position and is kept as it is"


def resolve(trace: Trace, name: str, robot: Robot | None, angles: Angles = "pendant") -> Resolution:
    """The operation tree of a program.

    Args:
        trace: What the program does.
        name: Name of the tree.
        robot: Robot that executes it; None: joint angles and shares of speed limits must be enough.
        angles: How the program counts joint angles.

    Raises:
        NeedsRobot: A robot must be given; names the line.
        InputError: There is nothing that can be planned; says why.
    """
    first = _Resolver(trace, name, robot, angles)
    found = first.resolution()
    if first.cycles and first.start is not None:  # a further pass begins where the one before ended
        if first.position is None:
            return _Resolver(trace, name, robot, angles, is_lost=True).resolution()
        if np.abs(np.subtract(first.position, first.start)).max() > SAME_POSITION_RAD:
            return _Resolver(trace, name, robot, angles, first.position).resolution()
    return found


class _Resolver:
    """Follows the events of a trace."""

    def __init__(
        self,
        trace: Trace,
        name: str,
        robot: Robot | None,
        angles: Angles,
        entry: Position | None = None,
        *,
        is_lost: bool = False,
    ) -> None:
        self.trace = trace
        self.name = name
        self.robot = robot
        self.angles: Angles = angles
        self.poses = None if robot is None else Poses(robot, angles)
        self.limits = SpeedLimits(self.poses)
        self.entry, self.is_lost = entry, is_lost  # where a pass of the cycle begins, or that nobody knows
        self.notes = {(note.line, note.text): note for note in trace.notes}
        self.position: Position | None = None
        self.external: dict[str, float] = {}
        self.repeated = Counter(event.statement for event in trace.events if isinstance(event, Motion))
        self.labels = Counter(event.label for event in trace.events if isinstance(event, Motion))
        self.cycles = False
        self.lost_line = 0
        self.elsewhere: set[int] = set()
        self.last_load: Load | None = None
        self._begin(None, 0)

    def _begin(self, start: Position | None, line: int) -> None:
        """The cycle begins here; what came before happens once."""
        self.start: Position | None = None
        self.start_line = line
        self.operations: list[Step] = []
        self.lines: list[int] = []
        self.executions: dict[str, Execution] = {}
        self.added: dict[tuple[str, bool], list[Wait]] = {}
        self.first_waits: list[Wait] = []
        self.in_section = False  # a motion of this section is planned
        self.passing = False  # the motion before does not stop at its end
        self.passed: set[str] = set()
        self.numbers: Counter[str] = Counter()
        if start is not None:
            self._start(start, line)

    def resolution(self) -> Resolution:
        """The tree and what is to be known of it."""
        events = self._with_known_loads()
        if sum(isinstance(event, Motion) for event in events) > MOST_MOTIONS:
            raise InputError("the program moves too often", allowed=f"{MOST_MOTIONS} motions")
        for index, event in enumerate(events):
            following = events[index + 1] if index + 1 < len(events) else None
            self._take(event, following)
        if self.position is None and self.executions:
            self._append(UnknownOperation(name=self._number("unknown")), self.lost_line)
        if self.start is None or not self.executions:
            kept = min(self.notes.values(), key=_tells_least, default=None)
            problem = "there is no motion between known positions that a plan could change"
            raise InputError(problem + (f" ({kept})" if kept else ""))
        operations = tied(with_ends(self.operations), self.executions, self.elsewhere, self._note, self.robot)
        tree = OperationTree(
            format=FORMAT,
            version=FORMAT_VERSION,
            name=self.name,
            angles=self.angles,
            start_rad=self.start,
            operations=operations,
        )
        places = {f"operations.{i}.target_rad": f"line {line}" for i, line in enumerate(self.lines)}
        places["start_rad"] = f"line {self.start_line}"
        notes = tuple(sorted(self.notes.values(), key=lambda note: note.line))
        added = {key: tuple(waits) for key, waits in self.added.items()}
        counts = {name: self.repeated[one.motion.statement] for name, one in self.executions.items()}
        repeated = {name: count for name, count in counts.items() if count > 1}
        return Resolution(tree, places, notes, self.executions, added, repeated, frozenset(self.passed))

    def _note(self, line: int, text: str) -> None:
        self.notes.setdefault((line, text), Note(line, text))

    def _keep(self, motion: Motion, reason: str) -> None:
        self._note(motion.line, f"{motion.label or 'the motion'} {_KEPT} {reason}")

    def _take(self, event: Event, following: Event | None) -> None:
        check_bounds(event)
        try:
            self._took(event, following)
        except ValidationError as error:  # such as a wait of more than a day
            details = error.errors(include_url=False)[0]
            said = details["msg"].removeprefix("Value error, ")
            problem = f"{said[:1].lower()}{said[1:]} (found {shown(details['input'])})"
            raise InputError(problem, key=f"line {event.line}") from None

    def _took(self, event: Event, following: Event | None) -> None:
        if isinstance(event, Motion):
            self._move(event, following)
        elif isinstance(event, Wait):
            self._wait(event)
        elif isinstance(event, Unknown):
            self._note(
                event.line, f"{event.what}{'; if it does not, --wait gives its length' if event.may_stand else ''}"
            )
            self._lose(event.line)
        elif isinstance(event, CycleStart):
            if self.executions:
                self._note(event.line, "the loop without end is the cycle: motions before it are kept as they are")
            self.cycles = True
            self.position = None if self.is_lost else self.entry or self.position
            self._begin(self.position, event.line)
        elif isinstance(event, Load):
            self._load(event)

    # Payloads

    def _with_known_loads(self) -> list[Event]:
        """The events, with changes of payload alone where there is one whose figures are known."""
        found: list[Event] = []
        carried: Payload | None = None
        for event in self.trace.events:
            if not isinstance(event, Load):
                found.append(event)
            elif event.payload is None:
                self._note(event.line, f"{event.what or 'the payload'} is not known: what was carried before counts on")
            elif event.payload != carried:
                carried = event.payload
                found.append(event)
        return found

    def _load(self, event: Load) -> None:
        """What the robot carries from here on; before the cycle begins, from its beginning on."""
        self.last_load = event
        payload = event.payload
        if self.start is None or payload is None:
            return
        if self.robot is not None:
            payload = payload_of_vendor(self.robot, payload)
        moments = payload.inertia_kg_m2
        inertia = six_moments(moments) if moments is not None else None
        self._note(event.line, f"the robot carries {payload.mass_kg:g} kg from here on, in place of --payload")
        name = self._number("payload")
        carried = PayloadOperation(name=name, mass_kg=payload.mass_kg, com_m=payload.com_m, inertia_kg_m2=inertia)
        self._append(carried, event.line)

    def _start(self, position: Position, line: int) -> None:
        """The cycle starts here."""
        self.start, self.start_line = position, line
        if self.last_load is not None:
            self._load(self.last_load)

    # Waits

    def _wait(self, event: Wait) -> None:
        if event.added:
            self._added_wait(event)
        elif event.duration_s is None:
            self._note(event.line, f"how long it takes is not in the file, see --wait: {event.what or 'a wait'}")
            if self.start is not None and self.position is not None:
                self._append(UnknownOperation(name=self._number("unknown")), event.line)
        elif event.duration_s > 0.0 and self.start is not None:
            self._append(WaitOperation(name=self._number("wait"), duration_s=event.duration_s), event.line)

    def _append(self, operation: Step, line: int) -> None:
        if isinstance(operation, UnknownOperation):
            self.in_section = False
        self.operations.append(operation)
        self.lines.append(line)

    def _number(self, word: str) -> str:
        self.numbers[word] += 1
        return f"{word}-{self.numbers[word]}"

    def _added_wait(self, event: Wait) -> None:
        """A wait that a plan has added: to the move before it, or to the first move."""
        move = self.operations[-1] if self.operations else None
        if isinstance(move, MoveOperation) and self.position is not None:
            seconds = move.added_wait_after_s + (event.duration_s or 0.0)
            self.operations[-1] = move.model_copy(update={"added_wait_after_s": seconds})
            self.added.setdefault((move.name, False), []).append(event)
        elif not self.in_section:
            self.first_waits.append(event)
        else:
            self._wait(replace(event, added=False))

    # Motions

    def _move(self, motion: Motion, following: Event | None) -> None:
        passing, self.passing = self.passing, zone_of(motion, following) != "fine"
        target = self._target(motion)
        if self.start is not None and (target is None or self.position is None):
            self.elsewhere.add(motion.statement)
        moves_outside = self._moves_outside(motion)
        if target is None:
            self._lose(motion.line)
        elif self.position is None:
            self._arrive(motion, target)
        elif moves_outside:
            self._keep(motion, "it moves an external axis")
            self._append(UnknownOperation(name=self._number("unknown"), target_rad=target), motion.line)
            self.position = target
        else:
            self._travel(Execution(motion, self.position, target), following, passing)

    def _arrive(self, motion: Motion, target: Position) -> None:
        """A motion from where nobody knows: its end is known."""
        self.position = target
        if self.start is None:
            self._start(target, motion.line)
            self._note(motion.line, _FIRST_MOTION)
            return
        self._keep(motion, "it starts at an unknown position")
        self._append(UnknownOperation(name=self._number("unknown"), target_rad=target), self.lost_line)

    def _lose(self, line: int) -> None:
        """The position is not known from here on."""
        if self.position is not None:
            self.lost_line = line
        self.position = None

    def _travel(self, execution: Execution, following: Event | None, passing: bool) -> None:
        """A motion between known positions, which begins without a stop or with one."""
        motion = execution.motion
        self.position = execution.target_rad
        limit = self.limits.of(execution, is_blended=passing or zone_of(motion, following) != "fine")
        if limit.reason:
            self._keep(motion, limit.reason)
        if limit.remark:
            self._note(motion.line, limit.remark)
        percent, is_fixed = limit.percent, limit.is_fixed
        if percent is None:
            self._append(UnknownOperation(name=self._number("unknown"), target_rad=execution.target_rad), motion.line)
            return
        move = MoveOperation(
            name=self._move_name(motion),
            target_rad=execution.target_rad,
            zone=zone_of(motion, following),
            speed_limit_percent=min(max(percent, LEAST_SPEED_PERCENT), 100.0),
            fixed=is_fixed,
            path=limit.path or "joint",
        )
        if self.first_waits:
            seconds = sum(wait.duration_s or 0.0 for wait in self.first_waits)
            move = move.model_copy(update={"added_wait_before_s": seconds})
            self.added[move.name, True] = self.first_waits
            self.first_waits = []
        self._append(move, motion.line)
        self.in_section = True
        self.passed |= {move.name} if passing else set()
        self.executions[move.name] = execution

    def _moves_outside(self, motion: Motion) -> bool:
        """Whether a motion moves an external axis."""
        given = motion.target.external if motion.target is not None else {}
        moved = [n for n, value in given.items() if abs(value - self.external.get(n, value)) > SAME_EXTERNAL]
        self.external.update(given)
        return bool(moved)

    def _move_name(self, motion: Motion) -> str:
        label = motion.label or "move"
        numbered = self._number(label)
        return label if self.labels[motion.label] == 1 and motion.label else numbered

    # Targets

    def _target(self, motion: Motion) -> Position | None:
        """Where a motion ends; None where that is not known."""
        target = motion.target
        if isinstance(target, JointTarget):
            return self._joint_target(motion, target)
        if not isinstance(target, PoseTarget):
            self._keep(motion, motion.reason or "its target is not known")
            return None
        if self.poses is None:
            problem = f"the target of {motion.label or 'the motion'} is a place of the tool, which needs a robot"
            raise NeedsRobot(problem, key=motion.place, allowed="a robot, with the program or as --robot")
        try:
            found = self.poses.joints(target, self.position)
        except NotKnown as error:
            self._keep(motion, str(error))
            return None
        if found.remark:
            self._note(motion.line, f"{motion.label or 'the target'}: {found.remark}")
        return found.position

    def _joint_target(self, motion: Motion, target: JointTarget) -> Position | None:
        given = target.angles_rad
        for value in given:
            if value is not None and abs(value) > _MOST_RAD:
                raise InputError(f"{np.degrees(value):g} degrees are beyond the limits of any joint", key=motion.place)
        if self.robot is not None and len(given) > self.robot.joint_count:
            problem = f"the target has {counted(len(given), 'angle')}, but {self.robot.name} has"
            raise InputError(f"{problem} {counted(self.robot.joint_count, 'joint')}", key=motion.place)
        if self.position is None:
            if target.relative or None in given:
                self._keep(motion, "it depends on where the robot is, which is not known")
                return None
            return tuple(float(value) for value in given if value is not None)
        if len(given) > len(self.position):
            raise InputError("the target has another number of angles", key=motion.place)
        values = np.array(self.position)
        for joint, value in enumerate(given):
            if value is not None:
                values[joint] = values[joint] + value if target.relative else value
        return tuple(values.tolist())


def _tells_least(note: Note) -> tuple[bool, bool]:
    """How little a note says of why nothing can be planned."""
    return note.text == _FIRST_MOTION, _KEPT not in note.text
