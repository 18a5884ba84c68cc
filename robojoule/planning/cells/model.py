"""The planning model of a cell, tight and without big constants in the order (after Bukata et al. 2017).

Sets
    R              robots
    V, E           static and dynamic activities; h_r in V is the last one of robot r's cycle
    L_v, S_l       locations of v; stays (location in a power mode) at location l
    T_e            movements of e, each from a location to a location
    in(v), out(v)  dynamic activities that enter and leave v
    lags, handovers, meetings (pairs of activities with choices that collide)

Data
    CT                     cycle time [s]
    [lo_s, up_s], P_s      window of stay s (minimal idle time included) [s], its power [W]
    [lo_t, up_t]           window of movement t [s]
    slope_tb, offset_tb    tangent b of the energy of t [W], [J]
    [ES_e, LS_e]           earliest and latest start of e since the start of its robot's cycle [s]

Variables
    u_s, delta_s   1 if stay s is chosen; time spent in it, 0 if it is not [s]
    y_t, d_t       1 if movement t is chosen; its duration, 0 if it is not [s]
    W_t            energy of movement t [J]
    f_e            start of e since the start of its robot's cycle, 0 if e is not done [s]
    t_r            start of robot r's cycle (t_0 = 0) [s]
    k_ab           cycles between activities a and b of a meeting (integer)

Objective
    min  sum_s P_s delta_s + sum_t W_t

Constraints
    (1) choice      sum_s u_s = 1                                         over the stays of v, for v in V
    (2) path        sum_t y_t = sum_s u_s                                 t leaving l, and t entering l, s in S_l
    (3) stays       lo_s u_s <= delta_s <= up_s u_s
    (4) movements   lo_t y_t <= d_t <= up_t y_t
    (5) energy      W_t >= slope_tb d_t + offset_tb y_t
    (6) clock       ES_e w_e <= f_e <= LS_e w_e,                          w_e = sum of y_t over T_e
                    sum_in (f_e + d_e) + delta_v = sum_out f_e            v in V except h_r
                    sum_in (f_e + d_e) + delta_v = CT                     v = h_r; f_e = 0 for e leaving h_r
    (7) lags        start(b) - start(a) >= length - CT cycles
    (8) handovers   x_l <= sum of x_l' over the locations that fit        x_l = sum of u_s over S_l; both ways
    (9) meetings    start(b) + k CT - start(a) >= d_i - up_i (1 - [partners of i])
                    CT - (start(b) + k CT - start(a)) >= d_j - up_j (1 - [partners of j])
                    for every choice i of a and j of b that collides

The start of a static activity v is t_r + sum_in (f_e + d_e), that of a dynamic one the end of the static one before it.
Energies are in perspective form and durations are split by choice, so the relaxation without integers is the convex
hull of each choice. The clock flows along the tour: no constant is larger than the window of a start, the cycle time
of each robot is implied, and tours that do not pass h_r cannot close, as time is used up on the way. A meeting needs
one integer, whatever the number of its choices; d_i and [..] are zero unless chosen, so its rows hold in every case.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.planning.cells.linear import INF, LinearModel, terms
from robojoule.planning.cells.numbering import Lag, Meeting, Numbering
from robojoule.planning.cells.phases import phase_bounds_s, reach_s

if TYPE_CHECKING:
    from robojoule.planning.cells.selection import Selection
    from robojoule.planning.cells.timing import Timing

Terms = list[tuple[int, float]]


@dataclass(frozen=True, eq=False)
class Parts:
    """What of a cell a model holds.

    Attributes:
        robots: Robots that are planned.
        lags: Time lags between them.
        handovers: Hand-overs between them.
        meetings: Meetings between them.
    """

    robots: frozenset[int]
    lags: Sequence[Lag]
    handovers: Sequence[tuple[int, int, list[tuple[int, int]]]]
    meetings: Sequence[Meeting]

    @staticmethod
    def of(numbers: Numbering, robots: Sequence[int] | None = None) -> Parts:
        """Some robots with all that is between them; all robots unless given."""
        chosen = frozenset(range(numbers.robots) if robots is None else robots)
        owner = numbers.static_robot
        return Parts(
            chosen,
            [one for one in numbers.lags if {int(owner[one.first]), int(owner[one.second])} <= chosen],
            [one for one in numbers.handovers if {int(owner[one[0]]), int(owner[one[1]])} <= chosen],
            [one for one in numbers.meetings if {numbers.robot_of(one.first), numbers.robot_of(one.second)} <= chosen],
        )


class CellModel:
    """The model of a cell or of some of its robots, with tangents that can be added.

    Args:
        numbers: The cell.
        robots: Robots that are planned; all unless given.
        free_cycle_time: Whether the cycle time is a variable and the objective, for the least cycle time.
        without: What of `Parts` is left out.
    """

    def __init__(
        self,
        numbers: Numbering,
        robots: Sequence[int] | None = None,
        *,
        free_cycle_time: bool = False,
        without: Collection[str] = (),
    ) -> None:
        self.numbers = numbers
        self.parts = Parts.of(numbers, robots)
        if "handovers" in without:
            self.parts = replace(self.parts, handovers=())
        if "lags" in without:
            self.parts = replace(self.parts, lags=())
        if "meetings" in without:
            self.parts = replace(self.parts, meetings=())
        self.free_cycle_time = free_cycle_time
        self.program = LinearModel()
        in_parts = np.isin(np.arange(numbers.robots), list(self.parts.robots))
        self._static_used = in_parts[numbers.static_robot]
        self._dynamic_used = in_parts[numbers.dynamic_robot]
        self.movements: Index = np.flatnonzero(self._dynamic_used[numbers.movement_dynamic])
        self.stays: Index = np.flatnonzero(self._static_used[numbers.stay_static])
        self._add_variables()
        self._add_choices()
        self._add_stays()
        self._add_movements()
        self._add_clock()
        self._add_lags()
        self._add_handovers()
        self._add_meetings()

    def _add_variables(self) -> None:
        n, program = self.numbers, self.program
        energy = 0.0 if self.free_cycle_time else 1.0

        def spread(chosen: Index, count: int, columns: Index) -> Index:
            found = np.full(count, -1, dtype=np.intp)
            found[chosen] = columns
            return found

        s, t = self.stays, self.movements
        self.u = spread(s, n.stays, program.columns(s.size, 0.0, 1.0, integer=True))
        self.delta = spread(s, n.stays, program.columns(s.size, 0.0, n.stay_longest_s[s], energy * n.stay_power_w[s]))
        self.y = spread(t, n.movements, program.columns(t.size, 0.0, 1.0, integer=True))
        self.d = spread(t, n.movements, program.columns(t.size, 0.0, n.d_max_s[t]))
        self.W = spread(t, n.movements, program.columns(t.size, 0.0, INF, energy))
        e = np.flatnonzero(self._dynamic_used & ~np.isin(n.tail, n.last))
        latest = np.full(e.size, INF) if self.free_cycle_time else np.maximum(n.latest_s[e], 0.0)
        self.f = spread(e, n.dynamics, program.columns(e.size, 0.0, latest))
        low, high = phase_bounds_s(n, self.parts.robots, self.parts.lags, free_cycle_time=self.free_cycle_time)
        r = np.array(sorted(self.parts.robots))
        self.t = spread(r, n.robots, program.columns(r.size, low[r], high[r]))
        self.k: dict[tuple[int, int], int] = {}
        self.lag_rows: list[int] = []
        self.handover_rows: list[int] = []
        self.CT = int(program.columns(1, 0.0, INF, 1.0)[0]) if self.free_cycle_time else -1

    def _add_choices(self) -> None:
        """(1) one stay for each static activity and (2) a path through the locations."""
        n = self.numbers
        for v in np.flatnonzero(self._static_used):
            self.program.row([term for place in n.locations_of[v] for term in self._chosen(place)], 1.0, 1.0)
            for place in n.locations_of[v]:
                here = self._chosen(place, -1.0)
                for around in (n.movements_from[place], n.movements_to[place]):
                    self.program.row(terms(self.y[around]) + here, 0.0, 0.0)

    def _add_stays(self) -> None:
        """(3) windows of stays."""
        n = self.numbers
        for s in self.stays:
            self.program.row([(self.delta[s], 1.0), (self.u[s], -float(n.stay_least_s[s]))], lower=0.0)
            self.program.row([(self.delta[s], 1.0), (self.u[s], -float(n.stay_longest_s[s]))], upper=0.0)

    def _add_movements(self) -> None:
        """(4) windows of movements."""
        n = self.numbers
        for t in self.movements:
            self.program.row([(self.d[t], 1.0), (self.y[t], -float(n.d_min_s[t]))], lower=0.0)
            self.program.row([(self.d[t], 1.0), (self.y[t], -float(n.d_max_s[t]))], upper=0.0)

    def add_tangents(self, movements: Index, durations_s: Array) -> None:
        """(5) energies: a tangent of each movement at a duration; movements may be named more than once."""
        n = self.numbers
        slopes = n.marginal_powers_w(movements, durations_s)
        offsets = n.energies_j(movements, durations_s) - slopes * durations_s
        for t, slope, offset in zip(movements.tolist(), slopes.tolist(), offsets.tolist(), strict=True):
            self.program.row([(self.W[t], 1.0), (self.d[t], -slope), (self.y[t], -offset)], lower=0.0)

    def _add_clock(self) -> None:
        """(6) the time since the start of the cycle flows along the tour."""
        n = self.numbers
        for e in np.flatnonzero(self.f >= 0):
            moves = self.y[n.movements_of[e]]
            self.program.row([(self.f[e], 1.0), *terms(moves, -float(n.earliest_s[e]))], lower=0.0)
            if not self.free_cycle_time:
                self.program.row([(self.f[e], 1.0), *terms(moves, -float(n.latest_s[e]))], upper=0.0)
            else:  # an optional activity that is not done must not carry time: a day is more than any cycle
                self.program.row([(self.f[e], 1.0), *terms(moves, -86_400.0)], upper=0.0)
        for v in np.flatnonzero(self._static_used).tolist():
            through = self._arrival(v) + [
                (self.delta[s], 1.0) for place in n.locations_of[v] for s in n.stays_of[place]
            ]
            if v in n.last:
                self._timed_row(through, 1.0)
            else:
                self.program.row(through + self._departure(v, -1.0), 0.0, 0.0)

    def _add_lags(self) -> None:
        """(7) starts of activities of different robots."""
        n = self.numbers
        far = max(reach_s(n, self.parts.lags), (2 * n.robots + 1) * n.cycle_time_s) + n.cycle_time_s
        for lag in self.parts.lags:
            row = self._start(lag.second, lag.second_move) + _minus(self._start(lag.first, lag.first_move))
            slack = 0.0
            if not lag.every:  # where one of them is not done, the lag does not hold
                slack = far + abs(lag.length_s) + n.cycle_time_s * abs(lag.cycles)
                for e in {lag.first_move, lag.second_move} - {-1}:
                    if len(n.leaving[int(n.tail[e])]) > 1:
                        row += [(column, -slack) for column, _ in terms(self.y[n.movements_of[e]])]
                ends = [e for e in {lag.first_move, lag.second_move} - {-1} if len(n.leaving[int(n.tail[e])]) > 1]
                slack *= len(ends)
            self.lag_rows.append(self._timed_row(row, -float(lag.cycles), lag.length_s - slack, INF))

    def _add_handovers(self) -> None:
        """(8) locations that fit."""
        n = self.numbers
        for v, w, pairs in self.parts.handovers:
            for side, activity in enumerate((v, w)):
                for place in n.locations_of[activity]:
                    partners = sorted({pair[1 - side] for pair in pairs if pair[side] == place})
                    others = [term for other in partners for term in self._chosen(other, -1.0)]
                    self.handover_rows.append(self.program.row(self._chosen(place) + others, upper=0.0))

    def _add_meetings(self) -> None:
        """(9) choices that collide are apart in every cycle."""
        CT = self.numbers.cycle_time_s
        if self.free_cycle_time:
            return  # the least cycle time without them is a bound
        for meeting in self.parts.meetings:
            a, b = meeting.first, meeting.second
            apart = self._activity_start(b) + _minus(self._activity_start(a))
            low, high = self._between_s(a, b)
            least, most = int(np.ceil(-high / CT - 1e-9)), int(np.floor((CT - low) / CT + 1e-9))
            k = int(self.program.columns(1, least, max(most, least), integer=True)[0])
            self.k[a, b] = k
            apart.append((k, CT))
            sides: tuple[dict[int, set[int]], dict[int, set[int]]] = ({}, {})
            for i, j in meeting.choices:
                sides[0].setdefault(i, set()).add(j)
                sides[1].setdefault(j, set()).add(i)
            for side, (own, other) in enumerate(((a, b), (b, a))):
                for choice, partners in sides[side].items():
                    lasting, longest = self._lasting(own, choice)
                    there = [term for one in sorted(partners) for term in self._taken(other, one)]
                    needed = _minus(lasting) + [(column, -longest * value) for column, value in there]
                    if side == 0:
                        self.program.row(apart + needed, lower=-longest)
                    else:
                        self.program.row(_minus(apart) + needed, lower=-longest - CT)

    def values_of(self, selection: Selection, timing: Timing) -> Array:
        """Values of the columns for a plan, to start a search from."""
        n, values = self.numbers, np.zeros(len(self.program.lower))
        starts: dict[int, float] = {}
        for r in self.parts.robots:
            t, s, times = selection.movements[r], selection.stays[r], timing.times
            moving, standing = times.moves_s[r], times.stays_s[r]
            values[self.y[t]], values[self.d[t]], values[self.W[t]] = 1.0, moving, n.energies_j(t, moving)
            values[self.u[s]], values[self.delta[s]] = 1.0, standing
            since = np.concatenate([[0.0], np.cumsum(moving + standing)[:-1]])
            e = n.movement_dynamic[t]
            values[self.f[e[1:]]] = since[1:]
            values[self.t[r]] = times.phases_s[r]
            begin = times.phases_s[r] + since
            starts.update(zip((n.statics + e).tolist(), begin.tolist(), strict=True))
            starts.update(zip(n.stay_static[s].tolist(), (begin + moving).tolist(), strict=True))
        for (a, b), k in self.k.items():
            if (a, b) in timing.cycles:
                values[k] = timing.cycles[a, b]
            else:
                begin_a, begin_b = (self._begin_s(one, starts) for one in (a, b))
                values[k] = np.ceil((begin_a - begin_b) / n.cycle_time_s - 1e-9)
        return values

    def _begin_s(self, activity: int, starts: dict[int, float]) -> float:
        """Start of an activity as the model has it: one that is not done starts when what stands before it ends."""
        if activity in starts:
            return starts[activity]
        v = int(self.numbers.tail[activity - self.numbers.statics])
        return next(starts[one] for e in self.numbers.leaving[v] if (one := self.numbers.statics + int(e)) in starts)

    def _timed_row(self, row: Terms, cycles: float, length_s: float = 0.0, upper: float | None = None) -> int:
        """Length + cycles CT <= row, or = where no upper bound is given."""
        if self.free_cycle_time:
            return self.program.row([*row, (self.CT, -cycles)], length_s, length_s if upper is None else upper)
        value = length_s + cycles * self.numbers.cycle_time_s
        return self.program.row(row, value, value if upper is None else upper)

    def _chosen(self, place: int, coefficient: float = 1.0) -> Terms:
        """x_l: whether a location is chosen."""
        return terms(self.u[self.numbers.stays_of[place]], coefficient)

    def _arrival(self, v: int) -> Terms:
        """Start of a static activity since the start of the cycle."""
        n = self.numbers
        found = [(self.f[e], 1.0) for e in n.entering[v] if self.f[e] >= 0]
        return found + [term for e in n.entering[v] for term in terms(self.d[n.movements_of[e]])]

    def _departure(self, v: int, coefficient: float = 1.0) -> Terms:
        """End of a static activity since the start of the cycle; that of h_r is the start."""
        return [(self.f[e], coefficient) for e in self.numbers.leaving[v] if self.f[e] >= 0]

    def _start(self, v: int, e: int) -> Terms:
        """Start of a static activity, or of a dynamic one that leaves it."""
        phase = (int(self.t[self.numbers.static_robot[v]]), 1.0)
        return [phase, *(self._arrival(v) if e < 0 else self._departure(v))]

    def _activity_start(self, activity: int) -> Terms:
        v = activity - self.numbers.statics
        return self._start(activity, -1) if v < 0 else self._start(int(self.numbers.tail[v]), v)

    def _between_s(self, a: int, b: int) -> tuple[float, float]:
        """Bounds of start(b) - start(a). [s]"""
        n, program = self.numbers, self.program
        windows = []
        for activity in (a, b):
            phase = int(self.t[n.robot_of(activity)])
            windows.append((program.lower[phase], program.upper[phase] + n.cycle_time_s))
        return windows[1][0] - windows[0][1], windows[1][1] - windows[0][0]

    def _taken(self, activity: int, choice: int) -> Terms:
        """Whether a location or a movement is chosen."""
        return self._chosen(choice) if activity < self.numbers.statics else [(int(self.y[choice]), 1.0)]

    def _lasting(self, activity: int, choice: int) -> tuple[Terms, float]:
        """Duration of a choice, 0 unless chosen, and its largest. [s]"""
        n = self.numbers
        if activity >= n.statics:
            return [(int(self.d[choice]), 1.0)], float(min(n.d_max_s[choice], n.cycle_time_s))
        stays = n.stays_of[choice]
        return terms(self.delta[stays]), float(min(n.stay_longest_s[stays].max(initial=0.0), n.cycle_time_s))


def _minus(row: Terms) -> Terms:
    return [(column, -value) for column, value in row]
