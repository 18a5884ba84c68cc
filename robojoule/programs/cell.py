"""The cell: several robots, each on a closed tour per cycle, that wait for each other and share space.

After L. Bukata, P. Sucha, Z. Hanzalek, P. Burget: *Energy Optimization of Robotic Cells*, IEEE Transactions on
Industrial Informatics 13(1), 2017. A tour alternates static activities (the robot stands: weld, grip, wait) and dynamic
ones (it moves). Every static activity is done once a cycle; which dynamic activities are done decides the order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from robojoule.errors import InputError
from robojoule.inputs import LONGEST_S, shown
from robojoule.profile.monomials import MonomialProfile
from robojoule.profile.piecewise import PiecewiseLinearProfile


@dataclass(frozen=True)
class PowerMode:
    """How a robot may stand: motors on, brakes, bus off.

    Attributes:
        name: Name, unique for the robot.
        least_idle_s: Least time that the robot stands in this mode. [s]
        label: What people call it.
    """

    name: str
    least_idle_s: float = 0.0
    label: str = ""


@dataclass(frozen=True)
class Location:
    """A pose in which a static activity may be done.

    Attributes:
        name: Name, unique for the activity.
        powers_w: Power in each mode of the robot, by the mode's name. [W]
    """

    name: str
    powers_w: Mapping[str, float]


@dataclass(frozen=True)
class StaticActivity:
    """The robot stands at one of some locations.

    Attributes:
        name: Name, unique in the cell.
        least_s: Shortest duration. [s]
        longest_s: Longest duration. [s]
        locations: Where it may be done; one is chosen.
        label: What people call it.
    """

    name: str
    least_s: float
    longest_s: float
    locations: tuple[Location, ...]
    label: str = ""


@dataclass(frozen=True)
class Movement:
    """A movement between two locations.

    Attributes:
        name: Name, unique for the activity.
        start: Location of the activity before it.
        end: Location of the activity after it.
        profile: Convex energy over duration.
    """

    name: str
    start: str
    end: str
    profile: MonomialProfile | PiecewiseLinearProfile


@dataclass(frozen=True)
class DynamicActivity:
    """The robot moves from one static activity to another, by one of some movements.

    It is optional where other dynamic activities leave the same static one.

    Attributes:
        name: Name, unique in the cell.
        start: Static activity before it.
        end: Static activity after it.
        movements: How it may be done; one is chosen where it is done.
        label: What people call it.
    """

    name: str
    start: str
    end: str
    movements: tuple[Movement, ...]
    label: str = ""


@dataclass(frozen=True)
class CellRobot:
    """A robot and what it may do in a cycle.

    Attributes:
        name: Name, unique in the cell.
        modes: How it may stand.
        static: Static activities, each done once a cycle.
        dynamic: Dynamic activities between them.
        last: Static activity whose end is the end of the robot's cycle.
    """

    name: str
    modes: tuple[PowerMode, ...]
    static: tuple[StaticActivity, ...]
    dynamic: tuple[DynamicActivity, ...]
    last: str


@dataclass(frozen=True)
class TimeLag:
    """Start of one activity after that of another: start(second) - start(first) >= length - cycles * cycle time.

    It holds where both activities are done.

    Attributes:
        first: Activity of one robot.
        second: Activity of another.
        length_s: Length of the lag. [s]
        cycles: By how many cycles `second` may belong to a later one.
    """

    first: str
    second: str
    length_s: float
    cycles: int = 0


class Choice(NamedTuple):
    """A static activity at a location, or a dynamic one by a movement."""

    activity: str
    option: str


@dataclass(frozen=True)
class Handover:
    """Two static activities of different robots whose locations must fit together.

    Attributes:
        first: Activity of one robot.
        second: Activity of the other.
        pairs: Locations of both that fit.
    """

    first: str
    second: str
    pairs: tuple[tuple[str, str], ...]


class Collision(NamedTuple):
    """Two choices of different robots that may not take place at the same time."""

    first: Choice
    second: Choice


@dataclass(frozen=True, eq=False)
class Cell:
    """Robots that work together at one cycle time; immutable and checked.

    Attributes:
        name: Name of the cell.
        cycle_time_s: Cycle time. [s]
        robots: The robots.
        lags: Waits for each other.
        handovers: Locations that must fit together.
        collisions: Choices that exclude each other in time.

    Raises:
        InputError: First violation; `key` names the activity or the robot.
    """

    name: str
    cycle_time_s: float
    robots: tuple[CellRobot, ...]
    lags: tuple[TimeLag, ...] = ()
    handovers: tuple[Handover, ...] = ()
    collisions: tuple[Collision, ...] = ()
    robot_of: Mapping[str, str] = field(init=False, repr=False)
    static: Mapping[str, StaticActivity] = field(init=False, repr=False)
    dynamic: Mapping[str, DynamicActivity] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not 0.0 < self.cycle_time_s <= LONGEST_S:
            raise InputError(
                f"the cycle time {shown(self.cycle_time_s)} s is out of range", allowed=f"up to {LONGEST_S:g} s"
            )
        _unique("robot", (robot.name for robot in self.robots))
        if not self.robots:
            raise InputError("the cell has no robot")
        static = [one for robot in self.robots for one in robot.static]
        dynamic = [one for robot in self.robots for one in robot.dynamic]
        _unique("activity", [*(one.name for one in static), *(one.name for one in dynamic)])
        robot_of = {one.name: robot.name for robot in self.robots for one in robot.static}
        robot_of |= {one.name: robot.name for robot in self.robots for one in robot.dynamic}
        object.__setattr__(self, "robot_of", robot_of)
        object.__setattr__(self, "static", {one.name: one for one in static})
        object.__setattr__(self, "dynamic", {one.name: one for one in dynamic})
        for robot in self.robots:
            _check_robot(robot)
        for place, lag in enumerate(self.lags):
            key = f"lags.{place}"
            self._check_pair("time lag", lag.first, lag.second, key)
            if not (abs(lag.length_s) <= LONGEST_S and isinstance(lag.cycles, int) and abs(lag.cycles) <= 1000):
                problem = f"the lag of {shown(lag.length_s)} s over {shown(lag.cycles)} cycles is out of range"
                raise InputError(problem, key=key)
        for place, handover in enumerate(self.handovers):
            key = f"handovers.{place}"
            self._check_pair("hand-over", handover.first, handover.second, key)
            for activity in (handover.first, handover.second):
                if activity not in self.static:
                    raise InputError(f"a hand-over needs static activities, not {shown(activity)}", key=key)
            for number, pair in enumerate(handover.pairs):
                for activity, location in zip((handover.first, handover.second), pair, strict=True):
                    self._check_choice(Choice(activity, location), f"{key}.pairs.{number}")
        for place, collision in enumerate(self.collisions):
            key = f"collisions.{place}"
            self._check_pair("collision", collision.first.activity, collision.second.activity, key)
            for choice in collision:
                self._check_choice(choice, key)

    def __repr__(self) -> str:
        return (
            f"Cell({self.name!r}: robots={len(self.robots)}, activities={len(self.robot_of)}, "
            f"cycle_time_s={self.cycle_time_s:.6g})"
        )

    def leaving(self, static: str) -> tuple[DynamicActivity, ...]:
        """Dynamic activities that leave a static one."""
        return tuple(one for one in self.dynamic.values() if one.start == static)

    def _check_pair(self, what: str, first: str, second: str, key: str) -> None:
        for name in (first, second):
            if name not in self.robot_of:
                raise InputError(f"the {what} names the activity {shown(name)}, which does not exist", key=key)
        if self.robot_of[first] == self.robot_of[second]:
            names = f"{shown(first)} and {shown(second)}"
            raise InputError(f"the {what} joins two activities of one robot, {names}", key=key)

    def _check_choice(self, choice: Choice, key: str) -> None:
        if choice.activity in self.static:
            kind, known = "location", [one.name for one in self.static[choice.activity].locations]
        else:
            kind, known = "movement", [one.name for one in self.dynamic[choice.activity].movements]
        if choice.option not in known:
            problem = f"activity {shown(choice.activity)} has no {kind} {shown(choice.option)}"
            raise InputError(problem, key=key, allowed=", ".join(known[:20]))


def _check_robot(robot: CellRobot) -> None:
    key = f"robot {robot.name}"
    _unique("power mode", (mode.name for mode in robot.modes), key)
    if not robot.modes:
        raise InputError("there is no power mode", key=key)
    for mode in robot.modes:
        if not 0.0 <= mode.least_idle_s <= LONGEST_S:
            raise InputError(f"the minimal idle time {shown(mode.least_idle_s)} s is out of range", key=key)
    static = {one.name: one for one in robot.static}
    if len(static) < 2:
        raise InputError("a closed tour needs two static activities or more", key=key)
    if robot.last not in static:
        problem = f"the last activity of the cycle, {shown(robot.last)}, is not a static activity of this robot"
        raise InputError(problem, key=key)
    for activity in robot.static:
        _check_static(activity, robot)
    for moving in robot.dynamic:
        _check_dynamic(moving, static)
    _check_tour(robot, key)


def _check_static(activity: StaticActivity, robot: CellRobot) -> None:
    key = f"activity {activity.name}"
    if not 0.0 <= activity.least_s <= activity.longest_s <= LONGEST_S:
        window = f"from {shown(activity.least_s)} s to {shown(activity.longest_s)} s"
        raise InputError(f"the window {window} is not usable", key=key, allowed="0 s or more, the shortest first")
    if activity.longest_s < min(mode.least_idle_s for mode in robot.modes):
        raise InputError("the longest duration is below the minimal idle time of every power mode", key=key)
    _unique("location", (one.name for one in activity.locations), key)
    if not activity.locations:
        raise InputError("there is no location", key=key)
    for location in activity.locations:
        for mode in robot.modes:
            power = location.powers_w.get(mode.name)
            if power is None:
                raise InputError(f"location {location.name} lacks the power in mode {mode.name}", key=key)
            if not 0.0 <= power < float("inf"):
                raise InputError(f"the power {shown(power)} W is not usable", key=key, allowed="0 W or more")
        if extra := location.powers_w.keys() - {mode.name for mode in robot.modes}:
            raise InputError(f"location {location.name} names an unknown power mode {shown(min(extra))}", key=key)


def _check_dynamic(activity: DynamicActivity, static: Mapping[str, StaticActivity]) -> None:
    key = f"activity {activity.name}"
    _unique("movement", (one.name for one in activity.movements), key)
    if not activity.movements:
        raise InputError("there is no movement", key=key)
    if activity.start == activity.end:
        raise InputError("the movements start and end at the same activity", key=key)
    for end in (activity.start, activity.end):
        if end not in static:
            problem = f"the movements join {shown(end)}, which is not a static activity of this robot"
            raise InputError(problem, key=key)
    for movement in activity.movements:
        for name, location in ((activity.start, movement.start), (activity.end, movement.end)):
            if location not in {one.name for one in static[name].locations}:
                problem = f"movement {movement.name} names location {shown(location)}, which activity {name} lacks"
                raise InputError(problem, key=key)
        if isinstance(movement.profile, PiecewiseLinearProfile):
            if not movement.profile.is_convex:
                raise InputError(f"the energy of movement {movement.name} is not convex over its duration", key=key)
            if movement.profile.energies_j.min() < 0.0 or movement.profile.d_max_s <= 0.0:
                problem = f"movement {movement.name} has a negative energy or no duration"
                raise InputError(problem, key=key, allowed="0 J or more, longer than 0 s")


def _check_tour(robot: CellRobot, key: str) -> None:
    """Every static activity must be reached from every other one."""
    places = {one.name: place for place, one in enumerate(robot.static)}
    tails = [places[one.start] for one in robot.dynamic]
    heads = [places[one.end] for one in robot.dynamic]
    graph = coo_array((np.ones(len(tails)), (tails, heads)), shape=(len(places), len(places)))
    count, part = connected_components(graph, connection="strong")
    if count > 1:
        apart = next(one.name for one in robot.static if part[places[one.name]] != part[places[robot.last]])
        problem = f"there is no closed tour: no movements lead from activity {robot.last} to {apart} and back"
        raise InputError(problem, key=key)


def _unique(what: str, names: Iterable[str], key: str | None = None) -> None:
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError(
            f"the {what} {shown(twice[0])} appears twice", key=f"{what} {twice[0]}" if key is None else key
        )
