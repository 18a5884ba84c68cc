"""Operation trees of vendors' programs: positions followed from motion to motion, speeds as shares of the limits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.vendor.speeds import motion_percent
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
)
from robojoule.inputs import counted
from robojoule.programs.operation_tree import (
    FORMAT,
    FORMAT_VERSION,
    LEAST_SPEED_PERCENT,
    CoarseZone,
    MoveOperation,
    OperationTree,
    WaitOperation,
)
from robojoule.robots.pendant_file import Angles
from robojoule.robots.robot import Robot

Position = tuple[float, ...]
STILL_RAD = 1e-9  # below, a joint has not turned
_RADIUS_PER_SHARE_M = 0.1  # what stands for a share of the way while no robot is known; nothing is computed with it
LEAST_RADIUS_M = 1e-6


@dataclass(frozen=True)
class Execution:
    """One execution of a motion that is part of the tree.

    Attributes:
        motion: The motion.
        start_rad: Where it begins, angles as the program counts them. [rad]
        target_rad: Where it ends. [rad]
    """

    motion: Motion
    start_rad: Position
    target_rad: Position


@dataclass(frozen=True)
class Resolution:
    """A program as an operation tree.

    Attributes:
        tree: The tree; its `angles` say how its numbers count.
        places: Lines of start and targets by their keys, for messages.
        notes: What is kept, assumed or not known, in the order of lines.
        executions: Motions by the names of their moves in the tree.
        added: Waits of an earlier plan by the name of their move, and whether they stand before it.
    """

    tree: OperationTree
    places: Mapping[str, str]
    notes: tuple[Note, ...]
    executions: Mapping[str, Execution]
    added: Mapping[tuple[str, bool], tuple[Wait, ...]] = field(default_factory=dict)


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
    return _Resolver(trace, name, robot, angles).resolution()


class _Resolver:
    """Follows the events of a trace."""

    def __init__(self, trace: Trace, name: str, robot: Robot | None, angles: Angles) -> None:
        self.trace = trace
        self.name = name
        self.robot = robot
        self.angles: Angles = angles
        self.notes = {(note.line, note.text): note for note in trace.notes}
        self.position: Position | None = None
        self.start: Position | None = None
        self.start_line = 0
        self.operations: list[MoveOperation | WaitOperation] = []
        self.lines: list[int] = []
        self.executions: dict[str, Execution] = {}
        self.added: dict[tuple[str, bool], list[Wait]] = {}
        self.first_waits: list[Wait] = []
        events = trace.events
        self.repeated = Counter(event.statement for event in events if isinstance(event, Motion))
        self.labels = Counter(event.label for event in events if isinstance(event, Motion))
        self.numbers: Counter[str] = Counter()

    def resolution(self) -> Resolution:
        events = self.trace.events
        for index, event in enumerate(events):
            following = events[index + 1] if index + 1 < len(events) else None
            self._take(event, following)
        if self.start is None or not self.executions:
            kept = next(iter(self.notes.values()), None)
            problem = "there is no motion between known positions that a plan could change"
            raise InputError(problem + (f" ({kept})" if kept else ""))
        tree = OperationTree(
            format=FORMAT,
            version=FORMAT_VERSION,
            name=self.name,
            angles=self.angles,
            start_rad=self.start,
            operations=tuple(self.operations),
        )
        places = {f"operations.{i}.target_rad": f"line {line}" for i, line in enumerate(self.lines)}
        places["start_rad"] = f"line {self.start_line}"
        notes = tuple(sorted(self.notes.values(), key=lambda note: note.line))
        added = {key: tuple(waits) for key, waits in self.added.items()}
        return Resolution(tree, places, notes, self.executions, added)

    def _note(self, line: int, text: str) -> None:
        self.notes.setdefault((line, text), Note(line, text))

    def _take(self, event: Event, following: Event | None) -> None:
        if isinstance(event, Motion):
            self._move(event, following)
        elif isinstance(event, Wait):
            self._wait(event)
        elif isinstance(event, Unknown):
            self._note(event.line, event.what)
            self._lose(event.line)
        elif isinstance(event, CycleStart):
            self._begin_cycle(event)
        elif isinstance(event, Load):
            self._note(event.line, f"{event.what or 'the payload'} is not taken over: --payload holds for all motions")

    def _lose(self, line: int) -> None:
        """The position is not known from here on."""
        if self.executions:
            raise InputError("what follows an unknown position cannot be planned yet", key=f"line {line}")
        self.position = self.start = None
        self.operations.clear()
        self.lines.clear()

    def _begin_cycle(self, event: CycleStart) -> None:
        if self.executions:
            self._note(event.line, "the loop without end is the cycle: motions before it are kept as they are")
            self.operations.clear()
            self.lines.clear()
            self.executions.clear()
            self.added.clear()
        self.start, self.start_line = self.position, event.line

    def _wait(self, event: Wait) -> None:
        if event.added:
            self._added_wait(event)
            return
        if event.duration_s is None:
            self._note(event.line, f"how long {event.what or 'the wait'} takes is not in the file: taken as 0 s")
            return
        if event.duration_s > 0.0 and self.start is not None:
            what = f"wait-{event.line}"
            self.numbers[what] += 1
            suffix = f"-{self.numbers[what]}" if self.numbers[what] > 1 else ""
            self.operations.append(WaitOperation(name=what + suffix, duration_s=event.duration_s))
            self.lines.append(event.line)

    def _added_wait(self, event: Wait) -> None:
        """A wait that a plan has added: to the move before it, or to the first move."""
        moves = [index for index, one in enumerate(self.operations) if isinstance(one, MoveOperation)]
        if not moves:
            self.first_waits.append(event)
            return
        move = self.operations[moves[-1]]
        assert isinstance(move, MoveOperation)
        seconds = move.added_wait_after_s + (event.duration_s or 0.0)
        self.operations[moves[-1]] = move.model_copy(update={"added_wait_after_s": seconds})
        self.added.setdefault((move.name, False), []).append(event)

    def _move(self, motion: Motion, following: Event | None) -> None:
        target = self._target(motion)
        if target is None:
            self._note(motion.line, f"{motion.label or 'the motion'} is kept as it is: {motion.reason or 'not known'}")
            self._lose(motion.line)
            return
        if self.position is None:
            self.position = target
            if self.start is None:
                self.start, self.start_line = target, motion.line
                self._note(motion.line, "the first motion starts at an unknown position and is kept as it is")
            return
        if motion.kind != "joint":
            self._note(motion.line, f"the {motion.kind} motion is kept as it is")
            self._lose(motion.line)
            return
        execution = Execution(motion, self.position, target)
        move = self._operation(execution, following)
        self.position = target
        if self.first_waits:
            seconds = sum(wait.duration_s or 0.0 for wait in self.first_waits)
            move = move.model_copy(update={"added_wait_before_s": seconds})
            self.added[move.name, True] = self.first_waits
            self.first_waits = []
        self.operations.append(move)
        self.lines.append(motion.line)
        self.executions[move.name] = execution

    def _operation(self, execution: Execution, following: Event | None) -> MoveOperation:
        motion = execution.motion
        percent = motion_percent(execution.motion.speed, execution.start_rad, execution.target_rad, self.robot, motion)
        if percent is None:
            self._note(motion.line, "the program does not say how fast the motion is: taken as 100 %")
            percent = 100.0
        is_fixed = not motion.speed.writable
        if self.repeated[motion.statement] > 1:
            self._note(motion.line, f"the motion runs {self.repeated[motion.statement]} times: its speed is kept")
            is_fixed = True
        return MoveOperation(
            name=self._move_name(motion),
            target_rad=execution.target_rad,
            zone=self._zone(motion, following),
            speed_limit_percent=min(max(percent, LEAST_SPEED_PERCENT), 100.0),
            fixed=is_fixed,
        )

    def _move_name(self, motion: Motion) -> str:
        label = motion.label or "move"
        self.numbers[label] += 1
        return label if self.labels[motion.label] == 1 and motion.label else f"{label}-{self.numbers[label]}"

    def _zone(self, motion: Motion, following: Event | None) -> CoarseZone | str:
        """The zone in which the next motion may begin; where something else follows, the controller stops."""
        blend = motion.blend
        if blend is None or not isinstance(following, Motion):
            return "fine"
        radius_m = blend.radius_m if blend.radius_m is not None else (blend.share or 0.0) * _RADIUS_PER_SHARE_M
        return CoarseZone(radius_m=radius_m) if radius_m > LEAST_RADIUS_M else "fine"

    def _target(self, motion: Motion) -> Position | None:
        """Where a motion ends; None where that is not known."""
        target = motion.target
        if isinstance(target, JointTarget):
            return self._joint_target(motion, target)
        if isinstance(target, PoseTarget) and self.robot is None:
            problem = f"the target of {motion.label or 'the motion'} is a place of the tool, which needs a robot"
            raise NeedsRobot(problem, key=f"line {motion.line}", allowed="a robot, with the program or as --robot")
        return None

    def _joint_target(self, motion: Motion, target: JointTarget) -> Position | None:
        given = target.angles_rad
        if self.robot is not None and len(given) > self.robot.joint_count:
            raise InputError(
                f"the target has {counted(len(given), 'axis')}, but {self.robot.name} has {self.robot.joint_count}",
                key=f"line {motion.line}",
            )
        if self.position is None:
            if target.relative or None in given:
                return None
            return tuple(float(value) for value in given if value is not None)
        if len(given) > len(self.position):
            raise InputError("the target has another number of axes", key=f"line {motion.line}")
        values = np.array(self.position)
        for joint, value in enumerate(given):
            if value is not None:
                values[joint] = values[joint] + value if target.relative else value
        return tuple(values.tolist())
