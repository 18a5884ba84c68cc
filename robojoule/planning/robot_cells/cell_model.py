"""The cell (`robojoule.programs.cell`) that robots with their programs make up.

Twice: with convex profiles, for a plan of speeds, waits, poses and modes with a proven bound; and with single runs at
the whole percents that a controller takes, near that plan, each a movement of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.robot_cell import RobotCell
from robojoule.planning.robot_cells.shared_space import Pairs, arms_of, meeting_pairs, zone_pairs
from robojoule.planning.robot_cells.work import RobotWork
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.reference import reference_predictor
from robojoule.profile.source import ProfileSource
from robojoule.programs.cell import (
    Cell,
    CellRobot,
    Choice,
    Collision,
    DynamicActivity,
    Handover,
    Location,
    Movement,
    PowerMode,
    StaticActivity,
    TimeLag,
)
from robojoule.progress import within
from robojoule.robots.clearance import PlacedArm

PROFILE_ERROR = 3e-4  # of a simulated profile, of the least energy of its motion
_PREDICTED_LIMITS = 61

Profiles = PiecewiseLinearProfile
Variants = Mapping[tuple[int, int], Sequence[tuple[str, Profiles]]]  # by robot and motion: name and energy


@dataclass(frozen=True, eq=False)
class CellWork:
    """Everything about a cell that does not depend on a plan.

    Attributes:
        cell: The cell.
        works: What each robot may do.
        arms: The robots as bodies.
        profiles: Where energies come from: simulated or predicted.
        exclusive: Whether robots keep out of each other's way; without that plans may collide.
    """

    cell: RobotCell
    works: tuple[RobotWork, ...]
    arms: tuple[PlacedArm, ...]
    profiles: str = "simulated"
    exclusive: bool = True

    @classmethod
    def of(
        cls, cell: RobotCell, slowest_speed_limit: float, profiles: str = "simulated", *, exclusive: bool = True
    ) -> CellWork:
        """Everything about a cell.

        Raises:
            InputError: A program cannot be planned.
        """
        works = tuple(RobotWork(one, cell.cycle_time_s, slowest_speed_limit) for one in cell.robots)
        return cls(cell, works, arms_of(cell), profiles, exclusive)

    @cached_property
    def pairs(self) -> Pairs:
        """What may not take place at the same time."""
        if not self.exclusive:
            return ()
        return (*meeting_pairs(self.cell, self.works, self.arms), *zone_pairs(self.cell, self.works))

    @cached_property
    def convex(self) -> Variants:
        """Each motion with its convex profile, nowhere above the true one where that is simulated."""
        found: dict[tuple[int, int], list[tuple[str, Profiles]]] = {}
        for r, work in enumerate(self.works):
            with within(work.name):
                source = self._source(work)
            for row, motion in enumerate(work.motions):
                hull = source.enclosure(row).below.lower_hull
                found[r, row] = [(motion.name, hull)]
        return found

    @cached_property
    def process_j(self) -> float:
        """Energy of the process steps of all robots. [J]"""
        return sum(
            p * (end - begin) for work in self.works for one in work.standstills for begin, end, p in one.process_w
        )

    def _source(self, work: RobotWork) -> ProfileSource:
        low, high = work.speed_range
        if self.profiles == "predicted":
            shares = np.linspace(0.0, 1.0, _PREDICTED_LIMITS)
            top = np.clip(work.paths.fastest_speed_limits(), low, high)
            limits = np.minimum(low[:, None] + shares * (top - low)[:, None], 1.0)
            return reference_predictor(work.robot).predict(work.paths, limits)
        source = AdaptiveProfiles(work.paths, low, highest_speed_limit=high)
        # Where a robot may stand for less than a slower motion costs, it never moves slower.
        source.refine(PROFILE_ERROR, highest_slope_w=float(work.paths.idle_power_end_w.max()))
        return source

    def cell_of(
        self,
        variants: Variants,
        *,
        apart: Pairs = (),
        least_standing_s: Mapping[str, float] | None = None,
    ) -> Cell:
        """The cell with given movements.

        Args:
            variants: Energies of each motion that is allowed, by robot and motion.
            apart: Choices beside those of the geometry that exclude each other.
            least_standing_s: How long robots stand at least in some standstills, by their names. [s]

        Raises:
            InputError: The cell is not consistent.
        """
        least_s = least_standing_s or {}
        robots = tuple(self._robot(r, work, variants, least_s) for r, work in enumerate(self.works))
        known = _Known.of(robots, _names(self.works, variants))
        collisions = [
            Collision(Choice(one.activity, a), Choice(two.activity, b))
            for one, two in self.pairs
            for a in known.options(one)
            for b in known.options(two)
        ]
        collisions += [Collision(*pair) for pair in apart if all(known.has(choice) for choice in pair)]
        return Cell(
            self.cell.name,
            self.cell.cycle_time_s,
            robots,
            self._lags(),
            self._handovers(known),
            tuple(dict.fromkeys(collisions)),
        )

    def _robot(self, r: int, work: RobotWork, variants: Variants, least_standing_s: Mapping[str, float]) -> CellRobot:
        modes = work.modes
        used = [row for row in range(len(work.motions)) if variants.get((r, row))]
        static, dynamic = [], []
        for i, one in enumerate(work.standstills):
            ends = dict.fromkeys(work.motions[row].end for row in used if work.motions[row].move == i)
            places = []
            for pose in ends:
                powers = work.powers_w(i, pose)
                places.append(Location(pose, {mode.name: powers[mode.name] for mode in modes}))
            least = max(one.least_s, least_standing_s.get(one.name, 0.0))
            static.append(StaticActivity(one.name, least, max(self.cell.cycle_time_s, least), tuple(places)))
            movements = [
                Movement(name, work.motions[row].start, work.motions[row].end, profile)
                for row in used
                if work.motions[row].move == i
                for name, profile in variants[r, row]
            ]
            start = work.standstills[i - 1].name
            dynamic.append(DynamicActivity(work.activity(i), start, one.name, tuple(movements)))
        return CellRobot(
            work.name,
            tuple(PowerMode(mode.name, mode.least_idle_s, mode.name) for mode in modes),
            tuple(static),
            tuple(dynamic),
            work.standstills[-1].name,
        )

    def _lags(self) -> tuple[TimeLag, ...]:
        by_name = {work.name: work for work in self.works}
        lags = []
        for one in self.cell.handovers:
            first, ended_s = by_name[one.first.robot].end_of(one.first.operation)
            second, started_s = by_name[one.second.robot].start_of(one.second.operation)
            lags.append(TimeLag(first, second, one.lag_s + ended_s - started_s, one.cycles))
        return tuple(lags)

    def _handovers(self, known: _Known) -> tuple[Handover, ...]:
        by_name = {work.name: work for work in self.works}
        found = []
        for one in self.cell.handovers:
            if one.poses is None:
                continue
            stands = [_standing(by_name[place.robot], place.operation) for place in (one.first, one.second)]
            fitting = [
                pair
                for pair in one.poses
                if all(known.has(Choice(stand, pose)) for stand, pose in zip(stands, pair, strict=True))
            ]
            found.append(Handover(stands[0], stands[1], tuple(fitting)))
        return tuple(found)


def _standing(work: RobotWork, operation: str) -> str:
    """The standing at whose pose an operation takes place."""
    for one, move in zip(work.standstills, work.moves, strict=True):
        if operation == move.name or operation in one.spans_s:
            return one.name
    raise InputError(f"there is no operation '{operation}'", key=f"robot {work.name}")


@dataclass(frozen=True)
class _Known:
    """Options that a cell has."""

    options_of: Mapping[str, frozenset[str]]
    names: Mapping[tuple[str, str], Sequence[str]]

    @classmethod
    def of(cls, robots: Sequence[CellRobot], names: Mapping[tuple[str, str], Sequence[str]]) -> _Known:
        found: dict[str, frozenset[str]] = {}
        for robot in robots:
            found |= {one.name: frozenset(place.name for place in one.locations) for one in robot.static}
            found |= {one.name: frozenset(m.name for m in one.movements) for one in robot.dynamic}
        return cls(found, names)

    def has(self, choice: Choice) -> bool:
        return choice.option in self.options_of.get(choice.activity, frozenset())

    def options(self, choice: Choice) -> list[str]:
        """Options of a cell that stand for a choice of poses, at whatever speed."""
        names = self.names.get((choice.activity, choice.option), [choice.option])
        return [name for name in names if self.has(Choice(choice.activity, name))]


def _names(works: Sequence[RobotWork], variants: Variants) -> dict[tuple[str, str], list[str]]:
    """Names of the movements of each motion, by activity and name of the motion."""
    return {
        (work.activity(work.motions[row].move), work.motions[row].name): [
            name for name, _ in variants.get((r, row), ())
        ]
        for r, work in enumerate(works)
        for row in range(len(work.motions))
    }
