"""What one robot of a cell may do: it stands at poses and moves between them, with its power and its profiles.

A standstill is all that a robot does where it stands between two moves: waits and process steps of its program, in
their order, as soon as it arrives, and then what a plan lets it wait. The last one of a program goes on into the next
cycle, until the first move.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.formats.robot_cell import GIVEN, PlacedRobot
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.batch import speed_range
from robojoule.planning.tree_motions import check_single_moves, closes
from robojoule.programs.operation_tree import MoveOperation, OperationTree, ProcessOperation
from robojoule.programs.tree_check import in_model_angles
from robojoule.robots.clearance import Courses
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.standby import StandbyMode

MOTORS = "motors on"


@dataclass(frozen=True)
class Standstill:
    """What a robot does at the target of a move.

    Attributes:
        name: Name of the activity.
        least_s: How long the program lets it stand. [s]
        spans_s: When each step and wait starts and ends, since the arrival; those before the first move of a program
            belong to its next cycle. [s]
        process_w: Power of process steps beside that of the robot, with the times of their start and end. [s], [W]
    """

    name: str
    least_s: float
    spans_s: Mapping[str, tuple[float, float]]
    process_w: tuple[tuple[float, float, float], ...]

    @property
    def most_process_w(self) -> float:
        """Largest power of its process steps. [W]"""
        return max((power for _, _, power in self.process_w), default=0.0)


@dataclass(frozen=True)
class Motion:
    """A move between two poses: a row of the robot's paths.

    Attributes:
        move: Number of the move.
        start: Name of the pose in which it starts.
        end: Name of the pose in which it ends.
    """

    move: int
    start: str
    end: str

    @property
    def name(self) -> str:
        """Name of the movement."""
        if self.start == GIVEN:
            return GIVEN if self.end == GIVEN else f"to {self.end}"
        return f"from {self.start}" if self.end == GIVEN else f"{self.start} to {self.end}"


class RobotWork:
    """Standstills and motions of a robot in a cell.

    Args:
        placed: The robot.
        cycle_time_s: Cycle time; no motion is slower. [s]
        slowest_speed_limit: Least speed limit of a plan, a fraction in (0, 1].

    Attributes:
        tree: Its program in angles of the model, without waits of an earlier plan.
        moves: Moves of the program, V of them.
        standstills: After each move, V of them.
        poses_rad: Configurations in which each move may end, by their names, V of them. [rad]
        motions: All motions that may be needed, M of them.
        paths: Their physics.
        speed_range: Lowest and highest speed limit of each motion, each of shape (M,). [-]

    Raises:
        InputError: The program does not close or has a move without motion.
    """

    def __init__(self, placed: PlacedRobot, cycle_time_s: float, slowest_speed_limit: float) -> None:
        self.placed = placed
        self.name, self.robot = placed.name, placed.robot
        key = f"robot {placed.name}"
        self.tree: OperationTree = in_model_angles(placed.program.tree, placed.robot).without_plan()
        try:
            check_single_moves(self.tree)
        except InputError as error:
            raise InputError(error.problem, key=key, allowed=error.allowed) from None
        if not closes(self.tree):
            raise InputError("the program ends elsewhere than it starts: the way back is not part of it", key=key)
        self.moves: tuple[MoveOperation, ...] = self.tree.moves()
        self.standstills, self.before_s = _standstills(placed.name, self.tree)
        self.poses_rad = tuple(self._poses(move) for move in self.moves)
        self.motions = tuple(
            Motion(i, start, end)
            for i in range(len(self.moves))
            for start in self.poses_rad[i - 1]
            for end in self.poses_rad[i]
        )
        start = np.array([self.poses_rad[one.move - 1][one.start] for one in self.motions])
        end = np.array([self.poses_rad[one.move][one.end] for one in self.motions])
        self.paths = MotionPaths(self.robot, start, end)
        if not self.paths.moving.all():
            still = self.moves[self.motions[int(np.argmin(self.paths.moving))].move].name
            raise InputError(f"move '{still}' does not move the robot", key=key, allowed="a program without it")
        low, high = speed_range([self.moves[one.move] for one in self.motions], slowest_speed_limit)
        longest = np.maximum(self.paths.durations(high[:, None])[:, 0], cycle_time_s)
        self.speed_range = np.minimum(np.maximum(low, self.paths.speed_limits_for_durations(longest)), high), high
        self._cycle_time_s = cycle_time_s

    def _poses(self, move: MoveOperation) -> dict[str, Array]:
        found = self.placed.alternatives.get(move.name)
        names = self.placed.poses(move.name)
        poses = {names[0]: np.array(move.target_rad)}
        for name, given in (found.poses_rad if found is not None else {}).items():
            in_pendant = self.placed.program.angles == "pendant" and len(given) == self.robot.joint_count
            numbers = PendantAngles.of(self.robot).model_rad(given) if in_pendant else given
            where = f"robot {self.name}, pose '{name}' of move '{move.name}'"
            poses[name] = self.robot.check_configuration(numbers, where)
        return poses

    @property
    def modes(self) -> tuple[StandbyMode, ...]:
        """How it may stand, motors that hold it first; their power depends on the pose."""
        return (StandbyMode(MOTORS, 0.0, 0.0), *self.robot.standby)

    def activity(self, move: int) -> str:
        """Name of a move as an activity of the cell."""
        return f"{self.name}: {self.moves[move].name}"

    def rows(self, move: int) -> list[int]:
        """Motions of a move."""
        return [row for row, one in enumerate(self.motions) if one.move == move]

    def holding_w(self, move: int, pose: str) -> float:
        """Power of motors that hold the robot at a pose after a move. [W]"""
        row = next(row for row in self.rows(move) if self.motions[row].end == pose)
        return float(self.paths.idle_power_end_w[row])

    def powers_w(self, move: int, pose: str) -> dict[str, float]:
        """Power in each mode at a pose after a move. [W]"""
        holding = self.holding_w(move, pose)
        return {mode.name: holding if mode.name == MOTORS else mode.power_w for mode in self.modes}

    def start_of(self, operation: str) -> tuple[str, float]:
        """The activity with which an operation starts, and how long after it. [s]"""
        for i, move in enumerate(self.moves):
            if move.name == operation:
                return self.activity(i), 0.0
        return self._span(operation, 0)

    def end_of(self, operation: str) -> tuple[str, float]:
        """The activity after whose start an operation ends, and how long. [s]"""
        for i, move in enumerate(self.moves):
            if move.name == operation:
                return self.standstills[i].name, 0.0
        return self._span(operation, 1)

    def _span(self, operation: str, end: int) -> tuple[str, float]:
        found = next(one for one in self.standstills if operation in one.spans_s)
        return found.name, found.spans_s[operation][end] - (self._cycle_time_s if operation in self.before_s else 0.0)

    def courses(self) -> tuple[list[tuple[str, str]], Courses]:
        """Everything that it may do, as activity and option, with its courses; standing first."""
        names, start, delta = [], [], []
        for i, poses in enumerate(self.poses_rad):
            for pose, q in poses.items():
                names.append((self.standstills[i].name, pose))
                start.append(q)
                delta.append(np.zeros_like(q))
        for row, one in enumerate(self.motions):
            names.append((self.activity(one.move), one.name))
            start.append(self.paths.start_rad[row])
            delta.append(self.paths.delta_rad[row])
        return names, Courses(np.array(start), np.array(delta))


def _standstills(robot: str, tree: OperationTree) -> tuple[tuple[Standstill, ...], dict[str, float]]:
    """Standstills after each move, and the steps and waits before the first one with their lengths [s]."""
    times: list[float] = [0.0]  # of the standing before the first move, after it ...
    spans: list[dict[str, tuple[float, float]]] = [{}]
    powers: list[list[tuple[float, float, float]]] = [[]]
    names: list[str] = []
    for step in tree.atomic():
        if isinstance(step, MoveOperation):
            times[-1] += step.all_before_s
            names.append(step.name)
            times.append(step.all_after_s)
            spans.append({})
            powers.append([])
            continue
        begin, times[-1] = times[-1], times[-1] + step.duration_s
        spans[-1][step.name] = (begin, times[-1])
        if isinstance(step, ProcessOperation) and step.power_w > 0.0 and step.duration_s > 0.0:
            powers[-1].append((begin, times[-1], step.power_w))
    before = {name: end - begin for name, (begin, end) in spans[0].items()}
    arrived = times[-1]  # the first cycle's steps follow those of the last one
    spans[-1] |= {name: (begin + arrived, end + arrived) for name, (begin, end) in spans[0].items()}
    powers[-1] += [(begin + arrived, end + arrived, power) for begin, end, power in powers[0]]
    times[-1] += times[0]
    made = tuple(
        Standstill(f"{robot}: {name} (standing)", time, span, tuple(power))
        for name, time, span, power in zip(names, times[1:], spans[1:], powers[1:], strict=True)
    )
    return made, before
