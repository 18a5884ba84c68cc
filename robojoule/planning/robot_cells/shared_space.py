"""Which activities of different robots may not take place at the same time, from geometry and from named zones."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.robot_cell import Place, RobotCell
from robojoule.planning.robot_cells.work import RobotWork
from robojoule.programs.cell import Choice
from robojoule.progress import told
from robojoule.robots.clearance import PlacedArm, come_close, gaps_m

Pairs = tuple[tuple[Choice, Choice], ...]


def arms_of(cell: RobotCell) -> tuple[PlacedArm, ...]:
    """The robots of a cell as bodies in it."""
    return tuple(PlacedArm(one.robot, one.base) for one in cell.robots)


def meeting_pairs(cell: RobotCell, works: Sequence[RobotWork], arms: Sequence[PlacedArm]) -> Pairs:
    """Standing and motions of two robots that may come closer than the safety distance, wherever they are on their way.

    No speed changes the way of a motion, so these pairs hold at every speed.

    Raises:
        InputError: Two robots stand within each other whatever they do.
    """
    found: list[tuple[Choice, Choice]] = []
    options = [work.courses() for work in works]
    for a, b in told("shared space of two robots", list(combinations(range(len(works)), 2))):
        _check_bases(cell, arms, a, b)
        (names, courses), (others, other_courses) = options[a], options[b]
        close = come_close(arms[a], courses, arms[b], other_courses, cell.safety_distance_m)
        if close.all():
            problem = f"{works[a].name} and {works[b].name} are too close in everything that they do"
            allowed = f"programs that keep {cell.safety_distance_m:g} m somewhere, or bases further apart"
            raise InputError(problem, allowed=allowed)
        found += [(Choice(*names[i]), Choice(*others[j])) for i, j in zip(*np.nonzero(close), strict=True)]
    return tuple(found)


def _check_bases(cell: RobotCell, arms: Sequence[PlacedArm], a: int, b: int) -> None:
    """Refuse robots whose bases, which never move, are too close."""
    first, second = (
        [k for k in range(len(arm.model.names)) if not arm.model.levers_m[k].any()] for arm in (arms[a], arms[b])
    )
    poses = [np.array([one.robot.home_rad]) for one in (cell.robots[a], cell.robots[b])]
    gaps = gaps_m(arms[a], poses[0], arms[b], poses[1])[np.ix_(first, second)]
    if gaps.size and gaps.min() < cell.safety_distance_m:
        problem = f"the bases of {cell.robots[a].name} and {cell.robots[b].name} are {gaps.min():.3f} m apart"
        raise InputError(problem, key="base", allowed=f"at least {cell.safety_distance_m:g} m")


def zone_pairs(cell: RobotCell, works: Sequence[RobotWork]) -> Pairs:
    """What named zones let only one robot do at a time."""
    by_name = {work.name: work for work in works}
    found: list[tuple[Choice, Choice]] = []
    for zone in cell.zones:
        members = [(place.robot, _choices(by_name[place.robot], place)) for place in zone.members]
        for (robot, choices), (other, others) in combinations(members, 2):
            if robot != other:
                found += [(one, two) for one in choices for two in others]
    return tuple(found)


def _choices(work: RobotWork, place: Place) -> list[Choice]:
    for i, move in enumerate(work.moves):
        if move.name == place.operation:
            return [Choice(work.activity(i), work.motions[row].name) for row in work.rows(i)]
    for i, one in enumerate(work.standstills):
        if place.operation in one.spans_s:
            return [Choice(one.name, pose) for pose in work.poses_rad[i]]
    raise InputError(f"there is no operation {place}")
