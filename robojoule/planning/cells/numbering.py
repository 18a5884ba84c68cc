"""A cell by numbers: activities, locations, stays and movements in arrays, in the order of the cell.

A *stay* is a location in one power mode. Modes that another one undercuts in both power and minimal idle time are left
out where that is so.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index
from robojoule.profile.monomials import MonomialProfile
from robojoule.programs.cell import Cell

_HALVINGS = 50


@dataclass(frozen=True)
class Lag:
    """A time lag by numbers; -1 stands for none.

    Attributes:
        first: Static activity v; the lag begins at its start, or at its end where `first_move` is not -1.
        first_move: Dynamic activity that leaves v.
        second: Static activity, as `first`.
        second_move: Dynamic activity, as `first_move`.
        length_s: Length. [s]
        cycles: Cycles between the two.
        every: Whether it holds whatever the order: the activities are done in each, or all that leave v have the lag.
    """

    first: int
    first_move: int
    second: int
    second_move: int
    length_s: float
    cycles: int
    every: bool


@dataclass(frozen=True)
class Meeting:
    """Two activities of different robots with choices that exclude each other in time.

    Attributes:
        first: Number of the activity, static before dynamic ones.
        second: The other one, of a later robot.
        choices: Pairs of locations (static) or movements (dynamic).
    """

    first: int
    second: int
    choices: tuple[tuple[int, int], ...]


class Numbering:
    """Arrays of a cell with R robots, V static and E dynamic activities, L locations, S stays and T movements.

    Args:
        cell: The cell.
    """

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self.cycle_time_s = cell.cycle_time_s
        robots = {robot.name: r for r, robot in enumerate(cell.robots)}
        self.static_names = list(cell.static)
        self.dynamic_names = list(cell.dynamic)
        static = {name: v for v, name in enumerate(self.static_names)}
        self.static_robot = _index(robots[cell.robot_of[name]] for name in self.static_names)
        self.dynamic_robot = _index(robots[cell.robot_of[name]] for name in self.dynamic_names)
        self.last = _index(static[robot.last] for robot in cell.robots)
        self.tail = _index(static[one.start] for one in cell.dynamic.values())
        self.head = _index(static[one.end] for one in cell.dynamic.values())
        locations = [(v, one) for v, activity in enumerate(cell.static.values()) for one in activity.locations]
        self.location_static = _index(v for v, _ in locations)
        self.location_names = [one.name for _, one in locations]
        place = {(v, one.name): number for number, (v, one) in enumerate(locations)}
        self._number_stays()
        movements = [(e, one) for e, activity in enumerate(cell.dynamic.values()) for one in activity.movements]
        self.movement_dynamic = _index(e for e, _ in movements)
        self.movement_names = [one.name for _, one in movements]
        self.movement_start = _index(place[int(self.tail[e]), one.start] for e, one in movements)
        self.movement_end = _index(place[int(self.head[e]), one.end] for e, one in movements)
        self.profiles = [one.profile for _, one in movements]
        self.d_min_s = np.array([profile.d_min_s for profile in self.profiles])
        self.d_max_s = np.array([profile.d_max_s for profile in self.profiles])
        self._place = place
        self._movement = {(e, one.name): number for number, (e, one) in enumerate(movements)}
        self._static = static
        self._dynamic = {name: e for e, name in enumerate(self.dynamic_names)}

    def _number_stays(self) -> None:
        rows = []
        for location, v in enumerate(self.location_static):
            robot = self.cell.robots[self.static_robot[v]]
            activity = self.cell.static[self.static_names[v]]
            powers = next(one for one in activity.locations if one.name == self.location_names[location]).powers_w
            modes = sorted(
                ((max(activity.least_s, mode.least_idle_s), powers[mode.name], m) for m, mode in enumerate(robot.modes))
            )
            cheapest = np.inf
            for least, power, m in modes:  # by rising idle time: each must cost less than all before it
                if power < cheapest and least <= activity.longest_s:
                    rows.append((location, m, power, least, activity.longest_s))
                    cheapest = power
        self.stay_location = _index(row[0] for row in rows)
        self.stay_mode = _index(row[1] for row in rows)
        self.stay_power_w = np.array([row[2] for row in rows])
        self.stay_least_s = np.array([row[3] for row in rows])
        self.stay_longest_s = np.array([row[4] for row in rows])
        self.stay_static = self.location_static[self.stay_location]

    @property
    def robots(self) -> int:
        """R."""
        return len(self.cell.robots)

    @property
    def statics(self) -> int:
        """V."""
        return len(self.static_names)

    @property
    def dynamics(self) -> int:
        """E."""
        return len(self.dynamic_names)

    @property
    def locations(self) -> int:
        """L."""
        return len(self.location_names)

    @property
    def stays(self) -> int:
        """S."""
        return int(self.stay_location.size)

    @property
    def movements(self) -> int:
        """T."""
        return len(self.movement_names)

    def group(self, keys: Index, count: int) -> list[Index]:
        """Numbers of the entries with each key, `count` of them."""
        order = np.argsort(keys, kind="stable")
        return np.split(order, np.searchsorted(keys[order], np.arange(1, count)))

    @cached_property
    def leaving(self) -> list[Index]:
        """Dynamic activities that leave each static one."""
        return self.group(self.tail, self.statics)

    @cached_property
    def entering(self) -> list[Index]:
        """Dynamic activities that enter each static one."""
        return self.group(self.head, self.statics)

    @cached_property
    def movements_of(self) -> list[Index]:
        """Movements of each dynamic activity."""
        return self.group(self.movement_dynamic, self.dynamics)

    @cached_property
    def movements_from(self) -> list[Index]:
        """Movements that leave each location."""
        return self.group(self.movement_start, self.locations)

    @cached_property
    def movements_to(self) -> list[Index]:
        """Movements that enter each location."""
        return self.group(self.movement_end, self.locations)

    @cached_property
    def locations_of(self) -> list[Index]:
        """Locations of each static activity."""
        return self.group(self.location_static, self.statics)

    @cached_property
    def stays_of(self) -> list[Index]:
        """Stays of each location."""
        return self.group(self.stay_location, self.locations)

    @cached_property
    def least_stay_s(self) -> Array:
        """Shortest stay of each static activity, shape (V,). [s]"""
        least = np.full(self.statics, np.inf)
        np.minimum.at(least, self.stay_static, self.stay_least_s)
        return least

    @cached_property
    def least_move_s(self) -> Array:
        """Shortest movement of each dynamic activity, shape (E,). [s]"""
        least = np.full(self.dynamics, np.inf)
        np.minimum.at(least, self.movement_dynamic, self.d_min_s)
        return least

    @cached_property
    def earliest_s(self) -> Array:
        """Earliest start of each dynamic activity since the start of its robot's cycle, shape (E,). [s]"""
        reached = np.full(self.statics, np.inf)  # the least time at which a static activity ends
        reached[self.last] = 0.0
        for _ in range(self.statics):
            before = reached.copy()
            arrive = reached[self.tail] + self.least_move_s + self.least_stay_s[self.head]
            arrive[np.isin(self.head, self.last)] = np.inf
            np.minimum.at(reached, self.head, arrive)
            if np.array_equal(before, reached):
                break
        return reached[self.tail]

    @cached_property
    def latest_s(self) -> Array:
        """Latest start of each dynamic activity since the start of its robot's cycle, shape (E,). [s]"""
        left = np.full(self.statics, np.inf)  # the least time from the start of a static activity to the cycle's end
        left[self.last] = self.least_stay_s[self.last]
        for _ in range(self.statics):
            before = left.copy()
            onward = self.least_stay_s[self.tail] + self.least_move_s + left[self.head]
            onward[np.isin(self.tail, self.last)] = np.inf
            np.minimum.at(left, self.tail, onward)
            if np.array_equal(before, left):
                break
        return np.asarray(self.cycle_time_s - self.least_move_s - left[self.head])

    @cached_property
    def lags(self) -> list[Lag]:
        """Time lags, each said once where all dynamic activities that leave a static one share it."""
        groups: dict[tuple[int, bool, int, bool, float, int], set[tuple[int, int]]] = {}
        for lag in self.cell.lags:
            (v, e), (w, f) = self._end(lag.first), self._end(lag.second)
            groups.setdefault((v, e >= 0, w, f >= 0, lag.length_s, lag.cycles), set()).add((e, f))
        lags = []
        for (v, moving, w, other_moving, length, cycles), ends in groups.items():
            every = (len(self.leaving[v]) if moving else 1) * (len(self.leaving[w]) if other_moving else 1)
            whole = len(ends) == every
            for e, f in sorted(ends)[: 1 if whole else None]:
                lags.append(Lag(v, e, w, f, length, cycles, whole))
        return lags

    def _end(self, name: str) -> tuple[int, int]:
        if name in self._static:
            return self._static[name], -1
        e = self._dynamic[name]
        return int(self.tail[e]), e

    @cached_property
    def handovers(self) -> list[tuple[int, int, list[tuple[int, int]]]]:
        """Static activities and their pairs of locations that fit; several between two activities must all hold."""
        found = []
        for one in self.cell.handovers:
            v, w = self._static[one.first], self._static[one.second]
            found.append((v, w, sorted({(self._place[v, a], self._place[w, b]) for a, b in one.pairs})))
        return found

    @cached_property
    def meetings(self) -> list[Meeting]:
        """Pairs of activities with choices that collide."""
        found: dict[tuple[int, int], set[tuple[int, int]]] = {}
        for collision in self.cell.collisions:
            ends = [self._choice(*choice) for choice in collision]
            (a, x), (b, y) = sorted(ends, key=lambda end: (self.robot_of(end[0]), end[0]))
            found.setdefault((a, b), set()).add((x, y))
        return [Meeting(a, b, tuple(sorted(choices))) for (a, b), choices in sorted(found.items())]

    def _choice(self, activity: str, option: str) -> tuple[int, int]:
        if activity in self._static:
            v = self._static[activity]
            return v, self._place[v, option]
        e = self._dynamic[activity]
        return self.statics + e, self._movement[e, option]

    def robot_of(self, activity: int) -> int:
        """Robot of an activity, static ones before dynamic ones."""
        v = activity - self.statics
        return int(self.static_robot[activity] if v < 0 else self.dynamic_robot[v])

    def energies_j(self, movements: ArrayLike, durations_s: ArrayLike) -> Array:
        """Energy of some movements at durations of the same shape. [J]"""
        numbers, durations = np.atleast_1d(movements), np.atleast_1d(np.asarray(durations_s, dtype=float))
        coefficients, degrees = self._terms
        if coefficients is not None:
            return np.asarray((coefficients[numbers] * durations[:, None] ** degrees).sum(axis=1))
        return np.array([float(self._clipped(t, d)) for t, d in zip(numbers.tolist(), durations.tolist(), strict=True)])

    def marginal_powers_w(self, movements: ArrayLike, durations_s: ArrayLike) -> Array:
        """Slope of the energy of some movements at durations of the same shape. [W]"""
        numbers, durations = np.atleast_1d(movements), np.atleast_1d(np.asarray(durations_s, dtype=float))
        coefficients, degrees = self._terms
        if coefficients is not None:
            return np.asarray((coefficients[numbers] * degrees * durations[:, None] ** (degrees - 1.0)).sum(axis=1))
        pairs = zip(numbers.tolist(), durations.tolist(), strict=True)
        return np.array([float(self.profiles[t].marginal_power_w(d)) for t, d in pairs])

    def durations_at(self, movements: Sequence[int] | Index, power_w: float | Array) -> Array:
        """Duration at which each movement's slope reaches a power, within its window. [s]"""
        if self._terms[0] is not None:
            return self._bisected(np.asarray(movements, dtype=np.intp), power_w)
        powers = np.broadcast_to(np.asarray(power_w, dtype=float), len(movements)).tolist()
        return np.array([self.profiles[t].duration_at(w) for t, w in zip(movements, powers, strict=True)], dtype=float)

    def _bisected(self, movements: Index, power_w: float | Array) -> Array:
        """`durations_at` of sums of powers, all at once."""
        coefficients, degrees = self._terms
        if coefficients is None:
            raise TypeError("only sums of powers")
        slopes = coefficients[movements] * degrees
        low, high = self.d_min_s[movements], self.d_max_s[movements]
        at_low, at_high = (self.marginal_powers_w(movements, end) for end in (low, high))
        shortest, longest = at_low >= power_w, at_high <= power_w
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            slower = (slopes * middle[:, None] ** (degrees - 1.0)).sum(axis=1) < power_w
            low, high = np.where(slower, middle, low), np.where(slower, high, middle)
        return np.where(
            shortest, self.d_min_s[movements], np.where(longest, self.d_max_s[movements], 0.5 * (low + high))
        )

    def _clipped(self, movement: int, duration_s: float) -> Array:
        profile = self.profiles[movement]
        return profile.value(min(max(duration_s, profile.d_min_s), profile.d_max_s))

    @cached_property
    def _terms(self) -> tuple[Array | None, Array]:
        """Coefficients (T, n) and degrees (n,) where all profiles are sums of powers."""
        sums = [profile for profile in self.profiles if isinstance(profile, MonomialProfile)]
        degrees = np.array(sorted({degree for profile in sums for degree, _ in profile.terms}))
        if len(sums) < len(self.profiles):
            return None, degrees
        coefficients = np.zeros((len(sums), degrees.size))
        for t, profile in enumerate(sums):
            for degree, coefficient in profile.terms:
                coefficients[t, np.searchsorted(degrees, degree)] += coefficient
        return coefficients, degrees


def _index(values: Iterable[int]) -> Index:
    return np.array(list(values), dtype=np.intp)
