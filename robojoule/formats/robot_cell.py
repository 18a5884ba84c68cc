"""A cell of robots with their programs: where they stand, what they hand over, what space they share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.inputs import LONGEST_S, as_number, shown, unknown_name
from robojoule.programs.operation_tree import CompoundOperation, MoveOperation
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Robot

GIVEN = "as programmed"  # the name of a target without alternatives
SAFETY_DISTANCE_M = 0.02
FARTHEST_M = 1000.0  # of a base from the origin of the cell: beyond it the unit is wrong


@dataclass(frozen=True)
class Alternatives:
    """Several poses in which a move may end, one of which a plan chooses.

    Attributes:
        given: Name of the target that the program has.
        poses_rad: Other targets by their names, in the angles of the program. [rad]
    """

    given: str
    poses_rad: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, eq=False)
class PlacedRobot:
    """A robot in a cell.

    Attributes:
        name: Name, unique in the cell.
        robot: The robot with its payload and standby modes.
        base: Where its base frame is in the cell.
        program: What it does in a cycle, which ends where it starts.
        alternatives: Other targets of moves, by the name of the move.
        assumed: What was assumed of its program, a sentence each.
    """

    name: str
    robot: Robot
    base: Placement
    program: Program
    alternatives: Mapping[str, Alternatives] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()

    def poses(self, move: str) -> tuple[str, ...]:
        """Names of the poses in which a move may end, that of the program first."""
        found = self.alternatives.get(move)
        return (GIVEN,) if found is None else (found.given, *found.poses_rad)


@dataclass(frozen=True)
class Place:
    """An operation of a robot in a cell; a move stands for the robot's standing at its target where one is needed."""

    robot: str
    operation: str

    def __str__(self) -> str:
        return f"'{self.operation}' of {self.robot}"


@dataclass(frozen=True)
class PartHandover:
    """A part is laid down by one robot and taken by another, or one waits for the other for another reason.

    Attributes:
        first: What comes first.
        second: What comes after it.
        lag_s: Time from the end of the first to the start of the second at least. [s]
        cycles: By how many cycles the second may belong to a later one.
        poses: Poses of both that fit together; any if None.
    """

    first: Place
    second: Place
    lag_s: float = 0.0
    cycles: int = 0
    poses: tuple[tuple[str, str], ...] | None = None


@dataclass(frozen=True)
class Zone:
    """Space in which only one robot may be at a time, whatever its shape.

    Attributes:
        name: Name of the zone.
        members: What takes place in it: moves from their start to their end, steps and waits as long as the robot
            stands there.
    """

    name: str
    members: tuple[Place, ...]


@dataclass(frozen=True, eq=False)
class RobotCell:
    """Robots that work together at one cycle time, with their programs; checked.

    Attributes:
        name: Name of the cell.
        cycle_time_s: Cycle time. [s]
        robots: The robots.
        handovers: Who waits for whom.
        zones: Spaces for one robot at a time, beside those that are found from geometry.
        safety_distance_m: Distance that the robots keep from each other. [m]
        peak_power_w: Largest mains power of all robots together; any if None. [W]
        source: File that it was read from, if any.

    Raises:
        InputError: First violation; `key` names the robot.
    """

    name: str
    cycle_time_s: float
    robots: tuple[PlacedRobot, ...]
    handovers: tuple[PartHandover, ...] = ()
    zones: tuple[Zone, ...] = ()
    safety_distance_m: float = SAFETY_DISTANCE_M
    peak_power_w: float | None = None
    source: Path | None = None

    def __post_init__(self) -> None:
        as_number(self.cycle_time_s, "cycle_time_s", least=1e-3, most=LONGEST_S, unit="s")
        as_number(self.safety_distance_m, "safety_distance_m", least=0.0, most=10.0, unit="m")
        if not self.robots:
            raise InputError("the cell has no robot")
        names = [one.name for one in self.robots]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise InputError(f"the robot {shown(twice[0])} appears twice")
        for one in self.robots:
            _check_robot(one)
        for number, handover in enumerate(self.handovers):
            self._check_handover(handover, f"handovers.{number}")
        for number, zone in enumerate(self.zones):
            for member, place in enumerate(zone.members):
                self._check_place(place, f"zones.{number}.members.{member}")

    def __repr__(self) -> str:
        return f"RobotCell({self.name!r}: robots={len(self.robots)}, cycle_time_s={self.cycle_time_s:.6g})"

    def robot(self, name: str) -> PlacedRobot:
        """A robot by its name."""
        return next(one for one in self.robots if one.name == name)

    def _check_place(self, place: Place, key: str) -> None:
        names = [one.name for one in self.robots]
        if place.robot not in names:
            found = unknown_name("robot", place.robot, names)
            raise InputError(found.problem, key=key, allowed=found.allowed)
        steps = [one.name for one in self.robot(place.robot).program.tree.atomic()]
        if place.operation not in steps:
            found = unknown_name("operation", place.operation, steps)
            raise InputError(f"{found.problem} of robot {place.robot}", key=key, allowed=found.allowed)

    def _check_handover(self, handover: PartHandover, key: str) -> None:
        for end, place in (("first", handover.first), ("second", handover.second)):
            self._check_place(place, f"{key}.{end}")
        if handover.first.robot == handover.second.robot:
            raise InputError(f"a hand-over joins two steps of one robot, {handover.first.robot}", key=key)
        as_number(handover.lag_s, f"{key}.lag_s", least=0.0, most=LONGEST_S, unit="s")
        as_number(handover.cycles, f"{key}.cycles", least=-1000.0, most=1000.0, unit="cycles")
        for number, pair in enumerate(handover.poses or ()):
            for place, pose in zip((handover.first, handover.second), pair, strict=True):
                one = self.robot(place.robot)
                known = one.poses(move_before(one.program, place.operation))
                if pose not in known:
                    problem = f"{place} has no pose {shown(pose)}"
                    raise InputError(problem, key=f"{key}.poses.{number}", allowed=", ".join(known))


def move_before(program: Program, operation: str) -> str:
    """The move at whose target an operation takes place; before the first move that is the last one's."""
    moves = [step.name for step in program.tree.moves()]
    before = moves[-1]
    for step in program.tree.atomic():
        if isinstance(step, MoveOperation):
            before = step.name
        if step.name == operation:
            break
    return before


def _check_robot(one: PlacedRobot) -> None:
    key = f"robot {one.name}"
    moves = {move.name for move in one.program.tree.moves()}
    if len(moves) < 2:
        raise InputError("a program of a cell needs two moves or more", key=key)
    last = one.program.tree.moves()[-1].name
    for move, found in one.alternatives.items():
        if move not in moves:
            known = {step.name for _, step in one.program.tree.walk() if isinstance(step, CompoundOperation)}
            what = "is a group of operations" if move in known else "does not exist"
            raise InputError(f"alternatives are given for move {shown(move)}, which {what}", key=key)
        if move == last:
            raise InputError("the last move has alternatives, but the cycle must end where it starts", key=key)
        names = one.poses(move)
        if len(names) != len(set(names)) or not found.poses_rad:
            raise InputError(f"the poses of move '{move}' need two names or more, each once", key=key)
