"""Times of a selection: durations and phases with the least true energy, order and choices being fixed.

    min  sum of powers times stays + sum of W_i
    W_i >= tangents of the movement's energy
    s_(i+1) = s_i + d_i along each tour, whose durations sum to CT
    s_b - s_a >= length - CT cycles                              lags of activities that are done
    d_a <= s_b - s_a + k CT <= CT - d_b                          pairs of chosen choices that collide; k integer

Tangents are added where the solution is until the model's energy is the true one. For given k that is a linear program,
and few pairs collide in a given selection.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import monotonic

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.planning.cells.linear import INF, Limits, LinearModel
from robojoule.planning.cells.model import Parts
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.phases import reach_s
from robojoule.planning.cells.selection import Selection, Times, energy_j
from robojoule.planning.cells.tangents import spread_durations_s

_ROUNDS = 40
_TANGENTS = 6


@dataclass(frozen=True, eq=False)
class Timing:
    """What the timing problem gave.

    Attributes:
        times: The times; exact, see `Times.exact`.
        energy_j: True energy. [J]
        late_s: By how much lags and meetings are violated in all, where slack is allowed. [s]
        cycles: k of each meeting that takes place, by its activities.
    """

    times: Times
    energy_j: float
    late_s: float
    cycles: dict[tuple[int, int], int]


def best_times(
    numbers: Numbering,
    parts: Parts,
    selection: Selection,
    limits: Limits,
    *,
    slack_w: float = 0.0,
    tolerance: float = 1e-7,
) -> Timing | None:
    """The best times of a selection; none where there are none (or none were found in time).

    Args:
        numbers: The cell.
        parts: Robots of the selection, with what is between them.
        selection: Choices.
        limits: When the search for the integers ends.
        slack_w: Price of a second by which lags and meetings may be violated; 0: they may not. [W]
        tolerance: Share of the energy at which the model counts as exact. [-]
    """
    problem = _Problem(numbers, parts, selection, slack_w)
    cycles: dict[tuple[int, int], int] = {}
    if problem.meetings:
        free = problem.build(None)
        found = free.solve(limits)
        if found.values is None:
            return None
        cycles = {pair: round(float(found.values[k])) for pair, k in problem.k.items()}
    return problem.polish(cycles, replace(limits, improved=None, bounded=None), tolerance)


class _Problem:
    """One timing problem."""

    def __init__(self, numbers: Numbering, parts: Parts, selection: Selection, slack_w: float) -> None:
        self.numbers, self.parts, self.selection, self.slack_w = numbers, parts, selection, slack_w
        n = numbers
        self.robots = sorted(selection.movements)
        self.t = np.concatenate([selection.movements[r] for r in self.robots])
        self.s = np.concatenate([selection.stays[r] for r in self.robots])
        ends = np.cumsum([selection.movements[r].size for r in self.robots])
        self.rows = {
            r: slice(int(end) - selection.movements[r].size, int(end)) for r, end in zip(self.robots, ends, strict=True)
        }
        self.move_of = {int(n.movement_dynamic[t]): i for i, t in enumerate(self.t)}  # by dynamic activity
        self.stay_of = {int(n.stay_static[s]): i for i, s in enumerate(self.s)}  # by static activity
        self.leave_of = {int(n.tail[n.movement_dynamic[t]]): i for i, t in enumerate(self.t)}
        self.meetings = []
        for meeting in parts.meetings:
            a, b = (self._place(one) for one in (meeting.first, meeting.second))
            if a is not None and b is not None and (self._choice(a), self._choice(b)) in meeting.choices:
                self.meetings.append(((meeting.first, meeting.second), a, b))
        self.k: dict[tuple[int, int], int] = {}
        self.added: list[tuple[Index, Array]] = []

    def _place(self, activity: int) -> tuple[bool, int] | None:
        """Whether an activity moves, and its number among the movements or stays; none if it is not done."""
        v = activity - self.numbers.statics
        if v < 0:
            return False, self.stay_of[activity]
        return (True, self.move_of[v]) if v in self.move_of else None

    def _choice(self, place: tuple[bool, int]) -> int:
        moving, i = place
        return int(self.t[i]) if moving else int(self.numbers.stay_location[self.s[i]])

    def build(self, cycles: dict[tuple[int, int], int] | None) -> LinearModel:
        """The program; with k of each meeting as an integer, or as given."""
        n, program, CT = self.numbers, LinearModel(), self.numbers.cycle_time_s
        m = self.t.size
        self.dt = program.columns(m, n.d_min_s[self.t], n.d_max_s[self.t])
        self.ds = program.columns(m, n.stay_least_s[self.s], n.stay_longest_s[self.s], n.stay_power_w[self.s])
        self.w = program.columns(m, 0.0, INF, 1.0)
        self.start = program.columns(m, -INF, INF)  # of movements; a stay starts when the movement before it ends
        for r in self.robots:
            rows = range(*self.rows[r].indices(m))
            for i, j in zip(rows, [*rows[1:], rows[0]], strict=True):
                value = CT if j == rows[0] else 0.0
                row = [(self.start[i], 1.0), (self.dt[i], 1.0), (self.ds[i], 1.0), (self.start[j], -1.0)]
                program.row([(int(c), x) for c, x in row], value, value)
        first = int(self.start[self.rows[self.robots[0]].start])
        program.lower[first] = program.upper[first] = 0.0
        self.slacks: list[int] = []
        for lag in self.parts.lags:
            begin = self._lag_end(lag.first, lag.first_move, lag.every)
            end = self._lag_end(lag.second, lag.second_move, lag.every)
            if begin is not None and end is not None:
                row = end + [(column, -x) for column, x in begin]
                program.row(row + self._slack(program), lower=lag.length_s - CT * lag.cycles)
        self.k = {}
        reach = max(int(np.ceil(reach_s(n, self.parts.lags) / CT)), 2 * n.robots) + 2
        for pair, a, b in self.meetings:
            apart = self._begin(b) + [(column, -x) for column, x in self._begin(a)]
            shift = 0.0
            if cycles is None:
                self.k[pair] = int(program.columns(1, -reach, reach, integer=True)[0])
                apart.append((self.k[pair], CT))
            else:
                shift = cycles[pair] * CT
            slack = self._slack(program)
            program.row([*apart, (self._duration(a), -1.0), *slack], lower=-shift)
            program.row([*((c, -x) for c, x in apart), (self._duration(b), -1.0), *slack], lower=shift - CT)
        numbers = np.arange(m)
        for at in spread_durations_s(n, self.t, _TANGENTS):
            self._add(program, numbers, at)
        for moves, at in self.added:
            self._add(program, moves, at)
        return program

    def _slack(self, program: LinearModel) -> list[tuple[int, float]]:
        if not self.slack_w:
            return []
        self.slacks.append(int(program.columns(1, 0.0, INF, self.slack_w)[0]))
        return [(self.slacks[-1], 1.0)]

    def _lag_end(self, v: int, e: int, every: bool) -> list[tuple[int, float]] | None:
        if e < 0:
            return self._begin((False, self.stay_of[v]))
        if not every and e not in self.move_of:
            return None
        return self._begin((True, self.leave_of[v]))

    def _begin(self, place: tuple[bool, int]) -> list[tuple[int, float]]:
        moving, i = place
        begin = [(int(self.start[i]), 1.0)]
        return begin if moving else [*begin, (int(self.dt[i]), 1.0)]

    def _duration(self, place: tuple[bool, int]) -> int:
        moving, i = place
        return int(self.dt[i]) if moving else int(self.ds[i])

    def _add(self, program: LinearModel, moves: Index, durations_s: Array) -> None:
        """Tangents of some movements."""
        n = self.numbers
        slopes = n.marginal_powers_w(self.t[moves], durations_s)
        offsets = n.energies_j(self.t[moves], durations_s) - slopes * durations_s
        for i, slope, offset in zip(moves.tolist(), slopes.tolist(), offsets.tolist(), strict=True):
            program.row([(int(self.w[i]), 1.0), (int(self.dt[i]), -slope)], lower=offset)

    def polish(self, cycles: dict[tuple[int, int], int], limits: Limits, tolerance: float) -> Timing | None:
        """Durations with the least true energy for given k."""
        n, program = self.numbers, self.build(cycles)
        best: Timing | None = None
        for _ in range(_ROUNDS):
            found = program.solve(replace(limits, until=INF), relaxed=True)
            if found.values is None:
                return best
            at, model = found.values[self.dt], found.values[self.w]
            timing = self._timing(found.values, cycles)
            if (
                best is None
                or timing.energy_j + self.slack_w * timing.late_s < best.energy_j + self.slack_w * best.late_s
            ):
                best = timing
            missing = n.energies_j(self.t, at) - model
            wanted = np.flatnonzero(missing > tolerance * max(best.energy_j, 1.0) / (2.0 * self.t.size))
            late = monotonic() > limits.until  # a plan is there: it may be a little less than polished
            if late or not wanted.size or missing.sum() <= tolerance * best.energy_j:
                break
            self._add(program, wanted, at[wanted])
            self.added.append((wanted, at[wanted]))
        return best

    def _timing(self, values: Array, cycles: dict[tuple[int, int], int]) -> Timing:
        phases = {r: float(values[self.start[self.rows[r].start]]) for r in self.robots}
        times = Times(
            phases,
            {r: values[self.dt[self.rows[r]]] for r in self.robots},
            {r: values[self.ds[self.rows[r]]] for r in self.robots},
        ).exact(self.numbers, self.selection)
        late = float(sum(values[column] for column in self.slacks))
        return Timing(times, energy_j(self.numbers, self.selection, times), late, cycles)
