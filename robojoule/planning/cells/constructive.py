"""First plans of large cells: single robots for prices of time and tours, annealing, then the timing problem."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import monotonic

import numpy as np

from robojoule.arrays import Array, Index, Mask
from robojoule.errors import PlanningError
from robojoule.planning.cells.annealing import Problem, State
from robojoule.planning.cells.annealing import run as anneal
from robojoule.planning.cells.annealing_costs import AT_END, AT_START, LEVELS, MIDDLE_LEVEL, MOST_LEVELS
from robojoule.planning.cells.exact import ExactSearch, Found
from robojoule.planning.cells.linear import Limits
from robojoule.planning.cells.model import CellModel, Parts
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.selection import Selection, poses_fit
from robojoule.planning.cells.timing import Timing, best_times

SLACK_W = 1000.0  # price of a second by which a first plan is late: more than any second of work brings
LEVEL = 0.015  # by how much longer most movements last at the next level of the price of time
LATE_S = 1e-6  # below: only rounding


@dataclass(frozen=True, eq=False)
class Single:
    """A robot planned alone.

    Attributes:
        found: Its plan, and the bound of its energy.
        price_w: What a second of its cycle is worth. [W]
    """

    found: Found
    price_w: float


def plan_alone(numbers: Numbering, robot: int, limits: Limits, seconds: float) -> Single:
    """Plan one robot without the others.

    Args:
        numbers: The cell.
        robot: The robot.
        limits: When to end in any case.
        seconds: When to end if there is a plan by then. [s]
    """
    soft = monotonic() + seconds

    def enough() -> bool:
        late = monotonic() > soft and search.best.selection is not None
        return late or (limits.stop is not None and limits.stop())

    search = ExactSearch(CellModel(numbers, [robot]), replace(limits, stop=enough))
    found = search.run()
    if found.selection is None or found.timing is None:
        return Single(found, search.prices_w.get(robot, 0.0))
    t, d = found.selection.movements[robot], found.timing.times.moves_s[robot]
    inside = (d > numbers.d_min_s[t] * (1 + 1e-6)) & (d < numbers.d_max_s[t] * (1 - 1e-6))
    slopes = numbers.marginal_powers_w(t, d)[inside]
    return Single(found, float(np.median(slopes)) if slopes.size else search.prices_w.get(robot, 0.0))


class Annealer:
    """Annealing of a cell at given prices of time.

    Args:
        numbers: The cell.
        singles: Its robots planned alone; every one has a plan.
    """

    def __init__(self, numbers: Numbering, singles: Sequence[Single]) -> None:
        self.numbers = numbers
        self.singles = tuple(singles)
        self.problem = self._problem()

    def run(self, iterations: int, seed: int, stop: Callable[[], bool] | None = None) -> Selection:
        """Choices of the best state of one run; `stop` may end it early."""
        state = self._start(seed)
        anneal(self.problem, state, iterations, seed, stop=stop)
        return self._selection(state)

    def rerun(
        self,
        selection: Selection,
        timing: Timing,
        iterations: int,
        seed: int,
        hot_j: float,
        stop: Callable[[], bool] | None = None,
    ) -> Selection:
        """Choices of the best state of a run that begins, less hot, with a plan."""
        state = self.state_of(selection, timing)
        anneal(self.problem, state, iterations, seed, hot_j, stop)
        return self._selection(state)

    def state_of(self, selection: Selection, timing: Timing) -> State:
        """The state that is nearest to a plan."""
        n, pace = self.numbers, np.zeros(self.numbers.statics)
        order, pose, share = [], np.zeros(n.statics, dtype=np.intp), np.full(n.statics, 1e-4)
        for r in range(n.robots):
            s = selection.stays[r]
            order.append(n.stay_static[s])
            pose[n.stay_static[s]] = n.stay_location[s]
            pace[n.tail[n.movement_dynamic[selection.movements[r]]]] = self._paces(
                r, selection.movements[r], timing.times.moves_s[r]
            )
            shortest = n.stay_least_s[self.problem.stay[n.stay_location[s]]]
            share[n.stay_static[s]] += np.maximum(timing.times.stays_s[r] - shortest, 0.0) / n.cycle_time_s
        phases = np.array([timing.times.phases_s[r] for r in range(n.robots)])
        return _state(np.concatenate(order), pose, share, phases, pace)

    def _paces(self, r: int, moves: Index, times_s: Array) -> Array:
        """Levels of movements against that of their robot, their median if it is not better to wait at that."""
        n = self.numbers
        inside = (times_s > n.d_min_s[moves] * (1 + 1e-6)) & (times_s < n.d_max_s[moves] * (1 - 1e-6))
        slopes = n.marginal_powers_w(moves, times_s)
        levels = (slopes - self.problem.price_w[r]) / self.step_w[r]
        own = min(np.median(levels[inside] if inside.any() else levels), self.problem.highest_level[r])
        return np.where(inside, np.clip(np.round(levels - own), -MOST_LEVELS, MOST_LEVELS), 0.0)

    def _problem(self) -> Problem:
        n, R = self.numbers, self.numbers.robots
        prices = np.array([single.price_w for single in self.singles])
        by_move = prices[n.dynamic_robot[n.movement_dynamic]]
        self.step_w = self._steps_w(prices)
        times, costs = self._tables(by_move, self.step_w[n.dynamic_robot[n.movement_dynamic]])
        least_w = np.array([n.stay_power_w[n.static_robot[n.stay_static] == r].min() for r in range(R)])
        highest = np.minimum(np.maximum(least_w - prices, 0.0) / self.step_w, MOST_LEVELS)
        first = np.searchsorted(n.static_robot, np.arange(R + 1))
        location = np.searchsorted(n.location_static, np.arange(n.statics + 1))
        stay = np.searchsorted(n.stay_location, np.arange(n.locations + 1))
        # By rising least duration: the first stay of a location is its shortest (see `Numbering`).
        shortest = stay[:-1]
        place_price = prices[n.static_robot[n.location_static]]
        place_cost = (n.stay_power_w[shortest] - place_price) * n.stay_least_s[shortest]
        table: list[Index] = []
        arcs: list[Mask] = []
        for r in range(R):
            low, width = int(location[first[r]]), int(location[first[r + 1]] - location[first[r]])
            own = np.full((width, width), -1)
            mine = np.flatnonzero(n.dynamic_robot[n.movement_dynamic] == r)
            # Of parallel movements the cheapest stays.
            for t in mine[np.argsort(-costs[mine, MIDDLE_LEVEL], kind="stable")]:
                own[n.movement_start[t] - low, n.movement_end[t] - low] = t
            count = int(first[r + 1] - first[r])
            joined = np.zeros((count, count), dtype=bool)
            mine = np.flatnonzero(n.dynamic_robot == r)
            joined[n.tail[mine] - first[r], n.head[mine] - first[r]] = True
            table.append(own.ravel())
            arcs.append(joined.ravel())
        lags = [
            (
                lag.first,
                _lag_end(lag.first_move, lag.every),
                lag.second,
                _lag_end(lag.second_move, lag.every),
            )
            for lag in n.lags
        ]
        lengths = [lag.length_s - n.cycle_time_s * lag.cycles for lag in n.lags]
        fits: list[Mask] = []
        for v, w, pairs in n.handovers:
            fitting = np.zeros((location[v + 1] - location[v], location[w + 1] - location[w]), dtype=bool)
            for a, b in pairs:
                fitting[a - location[v], b - location[w]] = True
            fits.append(fitting.ravel())
        meetings = [(m.first, i, m.second, j) for m in n.meetings for i, j in m.choices]
        robot = n.static_robot
        return Problem(
            n.cycle_time_s,
            robot,
            np.isin(np.arange(n.statics), n.last),
            first,
            location,
            stay,
            prices,
            np.concatenate(table),
            _origins(table),
            np.concatenate(arcs),
            _origins(arcs),
            costs,
            times,
            n.movement_dynamic,
            n.tail,
            place_cost,
            n.stay_power_w,
            n.stay_least_s,
            n.stay_longest_s,
            _matrix(lags, 4),
            np.array(lengths, dtype=float),
            highest,
            *_lists(R, [(robot[a], robot[b]) for a, _, b, _ in lags]),
            _matrix([(v, w) for v, w, _ in n.handovers], 2),
            np.concatenate(fits) if fits else np.zeros(0, dtype=bool),
            _origins(fits),
            *_lists(R, [(robot[v], robot[w]) for v, w, _ in n.handovers]),
            _matrix(meetings, 4),
            *_lists(R, [(n.robot_of(a), n.robot_of(b)) for a, _, b, _ in meetings]),
        )

    def _steps_w(self, prices_w: Array) -> Array:
        """Steps between the levels of each robot: such that most movements last `LEVEL` longer at the next one. [W]"""
        n = self.numbers
        steps = np.full(n.robots, LEVEL * (float(n.stay_power_w.mean()) or 1.0))  # standing may cost nothing
        for r, price in enumerate(prices_w):
            mine = np.flatnonzero(n.dynamic_robot[n.movement_dynamic] == r)
            at = n.durations_at(mine, price)
            longer = at * (1.0 + LEVEL)
            inside = (at > n.d_min_s[mine] * (1 + 1e-6)) & (longer < n.d_max_s[mine])
            slopes = n.marginal_powers_w(mine[inside], longer[inside]) - price
            if slopes.size and np.median(slopes) > 0.0:
                steps[r] = np.median(slopes)
        return steps

    def _tables(self, prices_w: Array, steps_w: Array) -> tuple[Array, Array]:
        """Durations of all movements at all levels, and their energies less the price of the time."""
        n, every = self.numbers, np.arange(self.numbers.movements)
        times = np.empty((n.movements, LEVELS))
        for level in range(LEVELS):
            times[:, level] = n.durations_at(every, prices_w + (level - MIDDLE_LEVEL) * steps_w)
        energies = np.stack([n.energies_j(every, at) for at in times.T], axis=1)
        return times, energies - prices_w[:, None] * times

    def _start(self, seed: int) -> State:
        """Robots as planned alone, their cycles anywhere; spare time where they waited, a little everywhere."""
        n, rng = self.numbers, np.random.default_rng(seed)
        order, pose, share = [], np.zeros(n.statics, dtype=np.intp), np.full(n.statics, 0.02)
        for r, single in enumerate(self.singles):
            if single.found.selection is None or single.found.timing is None:
                raise PlanningError("a robot has no plan of its own")
            s = single.found.selection.stays[r]
            order.append(n.stay_static[s])
            pose[n.stay_static[s]] = n.stay_location[s]
            share[n.stay_static[s]] += (single.found.timing.times.stays_s[r] - n.stay_least_s[s]) / n.cycle_time_s
        phases = rng.uniform(0.0, n.cycle_time_s, n.robots)
        return _state(np.concatenate(order), pose, share, phases, np.zeros(n.statics))

    def _selection(self, state: State) -> Selection:
        """The choices of a state: of the stays at a location the cheapest that fits into the time."""
        n, p = self.numbers, self.problem
        movements, stays = {}, {}
        for r in range(n.robots):
            order = state.order[p.first[r] : p.first[r + 1]]
            movements[r] = state.leaving[np.roll(order, 1)].copy()
            chosen = []
            for v in order:
                options = n.stays_of[int(state.pose[v])]
                fitting = options[n.stay_least_s[options] <= state.stay_s[v] + 1e-9]
                chosen.append((fitting if fitting.size else options[:1])[-1])
            stays[r] = np.array(chosen)
        return Selection(movements, stays)


def _state(order: Index, pose: Index, share: Array, phases_s: Array, pace: Array) -> State:
    """A state whose times are still to be found."""
    size = order.size
    leaving = np.full(size, -1, dtype=np.intp)
    return State(order, pose, share, phases_s, leaving, np.zeros(size), np.zeros(size), np.zeros(size), pace)


def _lag_end(move: int, every: bool) -> int:
    if move < 0:
        return AT_START
    return AT_END if every else move


def _origins(parts: Sequence[Index | Mask]) -> Index:
    """Where each part begins when they are put one behind the other."""
    return np.array([0, *np.cumsum([part.size for part in parts])[:-1]], dtype=np.intp)


def _matrix(rows: Sequence[Sequence[int]], width: int) -> Index:
    return np.array(rows, dtype=np.intp).reshape(len(rows), width)


def _lists(robots: int, pairs: Sequence[tuple[int, int]]) -> tuple[Index, Index]:
    """For each robot the numbers of the pairs that it is in."""
    own = [[number for number, pair in enumerate(pairs) if r in pair] for r in range(robots)]
    rows = np.concatenate([[0], np.cumsum([len(one) for one in own])]).astype(np.intp)
    return rows, np.array([number for one in own for number in one], dtype=np.intp)


def timed(numbers: Numbering, selection: Selection, limits: Limits) -> Timing | None:
    """The best times of the choices of an annealing run; `late_s` says how far they are from being feasible.

    None where poses of a hand-over do not fit together, which no times can mend.
    """
    if not poses_fit(numbers, selection):
        return None
    return best_times(numbers, Parts.of(numbers), selection, limits, slack_w=SLACK_W, tolerance=1e-6)
