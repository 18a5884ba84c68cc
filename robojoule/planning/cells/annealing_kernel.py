"""The compiled part of `robojoule.planning.cells.annealing`.

It takes few arrays, as the time of compiling grows with their number: `W` and `F` hold all whole and floating numbers
of a `Problem` one behind the other, `o` where each of its fields begins in them (`W[o[TAIL] + e]` is the tail of
dynamic activity e); rows of `C` and `X` hold the state (`C[POSE, v]`, `X[SHARE, v]`), beside `phase`, in the units of
`Problem`.
"""
# ruff: noqa: NPY002 - numba knows numpy's older random functions only

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

try:
    from numba import njit
except ImportError:  # the same functions in plain Python: a thousand times slower, for tests and small cells
    F = TypeVar("F", bound=Callable[..., Any])

    def njit(**_: bool) -> Callable[[F], F]:
        """Leave a function as it is."""
        return lambda function: function


TOO_LONG_W = 200.0  # for what exceeds the cycle or the window of a stay
LATE_W, LATE_MARGIN_S = 40.0, 0.3
UNFIT_J = 60.0
OVERLAP_W, OVERLAP_J = 20.0, 2.0
HOT_J, COLD_J = 300.0, 1.0
RECOUNT = 2000  # iterations after which sums are made anew
FIRM = 0.8  # share of the run from which penalties stay as they are and the best state is kept
FAR_S = 2.0  # of a small change of a phase; of a large one in cycles:
FAR_CYCLES = 0.35
PHASE, WAIT = 0.15, 0.32  # shares of moves: phases, waits (up to here), tours
LONGEST_SEGMENT = 6
AT_START, AT_END = -1, -2  # of a lag, instead of a dynamic activity
# Places in `o`, in the order of these names; then the counts.
(ROBOT, LAST, FIRST, LOCATION, STAY, TABLE, TABLE_ORIGIN, ARCS, ARC_ORIGIN, MOVE_DYNAMIC) = range(10)
(TAIL, LAGS, LAG_ROW, LAG_LIST, HANDS, FITS, FIT_ORIGIN, HAND_ROW, HAND_LIST) = range(10, 19)
(MEETINGS, MEET_ROW, MEET_LIST) = range(19, 22)
(_, PRICE_W, MOVE_COST_J, MOVE_TIME_S, PLACE_COST_J) = range(22, 27)
(STAY_POWER_W, STAY_LEAST_S, STAY_LONGEST_S, LAG_LENGTH_S) = range(27, 31)
(ROBOTS, STATICS, LOCATIONS, LAG_COUNT, HAND_COUNT, MEET_COUNT) = range(31, 37)
ORDER, POSE, LEAVING = range(3)
SHARE, BEGIN_S, STAY_S = range(3)


@njit(cache=True, nogil=True)
def _below(count):  # type: ignore[no-untyped-def]
    """A random whole number from 0 to count - 1."""
    return min(int(np.random.random() * count), count - 1)


@njit(cache=True, nogil=True)
def _forward(o, W, F, C, r, closing, biased, work, back):  # type: ignore[no-untyped-def]
    """Least cost from the closing location around to itself; `back` holds the location before each one."""
    start, count = W[o[FIRST] + r], W[o[FIRST] + r + 1] - W[o[FIRST] + r]
    base = W[o[LOCATION] + start]
    width = W[o[LOCATION] + W[o[FIRST] + r + 1]] - base
    for i in range(count):
        v = C[ORDER, start + i]
        low, high = W[o[LOCATION] + v], W[o[LOCATION] + v + 1]
        before_low, before_high = closing, closing + 1
        if i > 0:
            u = C[ORDER, start + i - 1]
            before_low, before_high = W[o[LOCATION] + u], W[o[LOCATION] + u + 1]
        if i == count - 1:
            low, high = closing, closing + 1
        for place in range(low, high):
            least, where = np.inf, -1
            for before in range(before_low, before_high):
                t = W[o[TABLE] + W[o[TABLE_ORIGIN] + r] + (before - base) * width + place - base]
                if t >= 0:
                    value = F[o[MOVE_COST_J] + t] + (work[i - 1, before - before_low] if i > 0 else 0.0)
                    if value < least:
                        least, where = value, before
            work[i, place - W[o[LOCATION] + v]] = least + biased[place]
            back[i, place - W[o[LOCATION] + v]] = where
    return work[count - 1, closing - W[o[LOCATION] + C[ORDER, start + count - 1]]]


@njit(cache=True, nogil=True)
def best_poses(o, W, F, C, r, biased, work, back):  # type: ignore[no-untyped-def]
    """Poses of a robot's tour with the least cost, by a dynamic program for each pose of the activity that ends it.

    Writes the poses; returns the cost, infinity where no movements join.
    """
    start, end = W[o[FIRST] + r], W[o[FIRST] + r + 1]
    last = C[ORDER, end - 1]
    best, chosen = np.inf, -1
    for closing in range(W[o[LOCATION] + last], W[o[LOCATION] + last + 1]):
        value = _forward(o, W, F, C, r, closing, biased, work, back)
        if value < best:
            best, chosen = value, closing
    if chosen >= 0:
        _forward(o, W, F, C, r, chosen, biased, work, back)
        place = chosen
        for i in range(end - start - 1, -1, -1):
            v = C[ORDER, start + i]
            C[POSE, v] = place
            place = back[i, place - W[o[LOCATION] + v]]
    return best


@njit(cache=True, nogil=True)
def time_robot(o, W, F, C, X, r):  # type: ignore[no-untyped-def]
    """Times of a robot's tour since the start of its cycle, and its cost at its price of time."""
    start, end = W[o[FIRST] + r], W[o[FIRST] + r + 1]
    base = W[o[LOCATION] + start]
    width = W[o[LOCATION] + end] - base
    total, cost, shares = 0.0, 0.0, 0.0
    tail = C[ORDER, end - 1]
    for i in range(start, end):
        v = C[ORDER, i]
        t = W[o[TABLE] + W[o[TABLE_ORIGIN] + r] + (C[POSE, tail] - base) * width + C[POSE, v] - base]
        C[LEAVING, tail] = t
        total += F[o[MOVE_TIME_S] + t] + F[o[STAY_LEAST_S] + W[o[STAY] + C[POSE, v]]]
        cost += F[o[MOVE_COST_J] + t]
        shares += X[SHARE, v]
        tail = v
    spare, factor = F[0] - total, 1.0
    if spare < 0.0:
        cost -= spare * TOO_LONG_W
        factor = F[0] / total
        spare = 0.0
    clock = 0.0
    for i in range(start, end):
        v = C[ORDER, i]
        clock += F[o[MOVE_TIME_S] + C[LEAVING, tail]] * factor
        first, after = W[o[STAY] + C[POSE, v]], W[o[STAY] + C[POSE, v] + 1]
        time = F[o[STAY_LEAST_S] + first] * factor + spare * X[SHARE, v] / shares
        power = F[o[STAY_POWER_W] + first]
        for stay in range(first + 1, after):
            if F[o[STAY_LEAST_S] + stay] <= time and F[o[STAY_POWER_W] + stay] < power:
                power = F[o[STAY_POWER_W] + stay]
        cost += (power - F[o[PRICE_W] + r]) * time
        if time > F[o[STAY_LONGEST_S] + first]:
            cost += (time - F[o[STAY_LONGEST_S] + first]) * TOO_LONG_W
        X[BEGIN_S, v], X[STAY_S, v] = clock, time
        clock += time
        tail = v
    return cost


@njit(cache=True, nogil=True)
def _when(o, W, F, C, X, phase, v, end):  # type: ignore[no-untyped-def]
    """Start of a static activity, or of what leaves it."""
    if end == AT_START:
        return phase[W[o[ROBOT] + v]] + X[BEGIN_S, v]
    if W[o[LAST] + v]:
        return phase[W[o[ROBOT] + v]]
    return phase[W[o[ROBOT] + v]] + X[BEGIN_S, v] + X[STAY_S, v]


@njit(cache=True, nogil=True)
def _lag_cost(o, W, F, C, X, phase, g, rate):  # type: ignore[no-untyped-def]
    for side in (0, 2):
        e = W[o[LAGS] + 4 * g + side + 1]
        if e >= 0 and W[o[MOVE_DYNAMIC] + C[LEAVING, W[o[LAGS] + 4 * g + side]]] != e:
            return 0.0
    between = _when(o, W, F, C, X, phase, W[o[LAGS] + 4 * g + 2], W[o[LAGS] + 4 * g + 3]) - _when(
        o, W, F, C, X, phase, W[o[LAGS] + 4 * g + 0], W[o[LAGS] + 4 * g + 1]
    )
    late = F[o[LAG_LENGTH_S] + g] - between + LATE_MARGIN_S
    return LATE_W * late * (0.2 + 0.6 * rate) if late > 0.0 else 0.0


@njit(cache=True, nogil=True)
def _fit(o, W, h, a, b):  # type: ignore[no-untyped-def]
    """Whether two locations of a hand-over fit."""
    v, w = W[o[HANDS] + 2 * h + 0], W[o[HANDS] + 2 * h + 1]
    return W[
        o[FITS]
        + W[o[FIT_ORIGIN] + h]
        + (a - W[o[LOCATION] + v]) * (W[o[LOCATION] + w + 1] - W[o[LOCATION] + w])
        + b
        - W[o[LOCATION] + w]
    ]


@njit(cache=True, nogil=True)
def _hand_cost(o, W, C, h, unfit):  # type: ignore[no-untyped-def]
    fit = _fit(o, W, h, C[POSE, W[o[HANDS] + 2 * h]], C[POSE, W[o[HANDS] + 2 * h + 1]])
    return 0.0 if fit else unfit


@njit(cache=True, nogil=True)
def _meet_cost(o, W, F, C, X, phase, c, rate):  # type: ignore[no-untyped-def]
    starts, times = np.empty(2), np.empty(2)
    for side in range(2):
        activity, choice = W[o[MEETINGS] + 4 * c + 2 * side], W[o[MEETINGS] + 4 * c + 2 * side + 1]
        if activity < o[STATICS]:
            if C[POSE, activity] != choice:
                return 0.0
            starts[side], times[side] = _when(o, W, F, C, X, phase, activity, AT_START), X[STAY_S, activity]
        else:
            v = W[o[TAIL] + activity - o[STATICS]]
            if C[LEAVING, v] != choice:
                return 0.0
            starts[side], times[side] = _when(o, W, F, C, X, phase, v, AT_END), F[o[MOVE_TIME_S] + choice]
    apart = (starts[1] - starts[0]) % F[0]
    overlap = 0.0
    if apart < times[0]:
        overlap += min(times[0] - apart, times[1])
    if apart + times[1] > F[0]:
        overlap += min(apart + times[1] - F[0], times[0])
    return OVERLAP_W * overlap * rate + OVERLAP_J if overlap > 0.0 else 0.0


@njit(cache=True, nogil=True)
def _joined(o, W, r, a, b):  # type: ignore[no-untyped-def]
    """Whether a dynamic activity joins two static ones of a robot."""
    start, end = W[o[FIRST] + r], W[o[FIRST] + r + 1]
    return W[o[ARCS] + W[o[ARC_ORIGIN] + r] + (a - start) * (end - start) + b - start] == 1


@njit(cache=True, nogil=True)
def _swap(o, W, C, held, r):  # type: ignore[no-untyped-def]
    """Exchange two neighbouring segments of a tour, each in its own direction; whether arcs allow it."""
    start, end = W[o[FIRST] + r], W[o[FIRST] + r + 1]
    most = LONGEST_SEGMENT if np.random.random() < 0.5 else end - start
    i = _below(end - start - 2)
    j = i + 1 + _below(min(most, end - start - 2 - i))
    k = j + 1 + _below(min(most, end - start - 1 - j))
    i, j, k = i + start, j + start, k + start
    before = C[ORDER, i - 1] if i > start else C[ORDER, end - 1]
    if not _joined(o, W, r, before, C[ORDER, j]):
        return False
    if not _joined(o, W, r, C[ORDER, k - 1], C[ORDER, i]) or not _joined(o, W, r, C[ORDER, j - 1], C[ORDER, k]):
        return False
    for place in range(i, k):
        held[place] = C[ORDER, place]
    for place in range(i, k):
        C[ORDER, place] = held[place + j - i] if place < i + k - j else held[place - k + j]
    return True


@njit(cache=True, nogil=True)
def _bias(o, W, F, C, r, biased, unfit, noise):  # type: ignore[no-untyped-def]
    """Costs of a robot's locations with what their partners' poses demand, and some noise."""
    low, high = W[o[LOCATION] + W[o[FIRST] + r]], W[o[LOCATION] + W[o[FIRST] + r + 1]]
    for place in range(low, high):
        biased[place] = F[o[PLACE_COST_J] + place] + (noise * np.random.random() if noise > 0.0 else 0.0)
    for x in range(W[o[HAND_ROW] + r], W[o[HAND_ROW] + r + 1]):
        h = W[o[HAND_LIST] + x]
        v, w = W[o[HANDS] + 2 * h + 0], W[o[HANDS] + 2 * h + 1]
        own = v if W[o[ROBOT] + v] == r else w
        for place in range(W[o[LOCATION] + own], W[o[LOCATION] + own + 1]):
            if not (_fit(o, W, h, place, C[POSE, w]) if own == v else _fit(o, W, h, C[POSE, v], place)):
                biased[place] += unfit


@njit(cache=True, nogil=True)
def _share_out(C, X, start, end):  # type: ignore[no-untyped-def]
    """Move some of one stay's share of the spare time to another one."""
    v, w = C[ORDER, start + _below(end - start)], C[ORDER, start + _below(end - start)]
    kind = np.random.random()
    moved = X[SHARE, v] * (1.0 if kind < 0.4 else 0.1 if kind < 0.6 else np.random.random())
    X[SHARE, v] -= moved
    X[SHARE, w] += moved
    return v != w


@njit(cache=True, nogil=True)
def _copy(C, X, to_C, to_X, start, end):  # type: ignore[no-untyped-def]
    """Copy the state of some static activities; loops compile faster than slices."""
    for row in range(3):
        for v in range(start, end):
            to_C[row, v] = C[row, v]
            to_X[row, v] = X[row, v]


@njit(cache=True, nogil=True)
def _recount(o, W, F, C, X, phase, lag, hand, meet, unfit, rate):  # type: ignore[no-untyped-def]
    """All penalties anew; returns their sum."""
    total = 0.0
    for g in range(o[LAG_COUNT]):
        lag[g] = _lag_cost(o, W, F, C, X, phase, g, rate)
        total += lag[g]
    for h in range(o[HAND_COUNT]):
        hand[h] = _hand_cost(o, W, C, h, unfit)
        total += hand[h]
    for c in range(o[MEET_COUNT]):
        meet[c] = _meet_cost(o, W, F, C, X, phase, c, rate)
        total += meet[c]
    return total


@njit(cache=True, nogil=True)
def _change(o, W, F, C, X, phase, r, lag, hand, meet, old_lag, old_hand, old_meet, unfit, rate):  # type: ignore[no-untyped-def]
    """Penalties of a robot anew, the old ones put aside; returns by how much they grew."""
    change = 0.0
    for x in range(W[o[LAG_ROW] + r], W[o[LAG_ROW] + r + 1]):
        g = W[o[LAG_LIST] + x]
        old_lag[g] = lag[g]
        lag[g] = _lag_cost(o, W, F, C, X, phase, g, rate)
        change += lag[g] - old_lag[g]
    for x in range(W[o[HAND_ROW] + r], W[o[HAND_ROW] + r + 1]):
        h = W[o[HAND_LIST] + x]
        old_hand[h] = hand[h]
        hand[h] = _hand_cost(o, W, C, h, unfit)
        change += hand[h] - old_hand[h]
    for x in range(W[o[MEET_ROW] + r], W[o[MEET_ROW] + r + 1]):
        c = W[o[MEET_LIST] + x]
        old_meet[c] = meet[c]
        meet[c] = _meet_cost(o, W, F, C, X, phase, c, rate)
        change += meet[c] - old_meet[c]
    return change


@njit(cache=True, nogil=True)
def _restore(o, W, r, row, listed, values, old):  # type: ignore[no-untyped-def]
    """Penalties of one kind of a robot as they were."""
    for x in range(W[o[row] + r], W[o[row] + r + 1]):
        values[W[o[listed] + x]] = old[W[o[listed] + x]]


@njit(cache=True, nogil=True)
def anneal(o, W, F, C, X, phase, iterations, seed, hot):  # type: ignore[no-untyped-def]
    """Anneal a state in place to the best one that was met in the last part of the run; returns its cost."""
    np.random.seed(seed)
    robots, count = o[ROBOTS], o[STATICS]
    most = 1
    for v in range(count):
        most = max(most, W[o[LOCATION] + v + 1] - W[o[LOCATION] + v])
    work, back, held = np.empty((count, most)), np.empty((count, most), np.int64), np.empty(count, np.int64)
    biased = np.empty(o[LOCATIONS])
    cost = np.zeros(robots)
    lag, hand, meet = np.zeros(o[LAG_COUNT]), np.zeros(o[HAND_COUNT]), np.zeros(o[MEET_COUNT])
    old_lag, old_hand, old_meet = np.zeros(o[LAG_COUNT]), np.zeros(o[HAND_COUNT]), np.zeros(o[MEET_COUNT])
    old_C, old_X, best_C, best_X = (
        np.empty((3, count), np.int64),
        np.empty((3, count)),
        np.empty((3, count), np.int64),
        np.empty((3, count)),
    )
    best_phase = np.empty(robots)
    for r in range(robots):
        cost[r] = time_robot(o, W, F, C, X, r)
    best, total = np.inf, np.inf
    for iteration in range(iterations):
        heat = hot * (COLD_J / hot) ** (iteration / iterations)
        firm = min(iteration / (FIRM * iterations), 1.0) ** 2 if hot == HOT_J else 1.0
        unfit, rate = UNFIT_J * (0.3 + 4.0 * firm), 0.2 + 2.0 * firm
        if iteration % RECOUNT == 0:
            total = _recount(o, W, F, C, X, phase, lag, hand, meet, unfit, rate)
            for r in range(robots):
                total += cost[r]
        r = _below(robots)
        start, end = W[o[FIRST] + r], W[o[FIRST] + r + 1]
        kind, old_cost, old_phase = np.random.random(), cost[r], phase[r]
        if kind < PHASE:
            far = FAR_S if np.random.random() < 0.5 else FAR_CYCLES * F[0]
            phase[r] += (2.0 * np.random.random() - 1.0) * far
        else:
            _copy(C, X, old_C, old_X, start, end)
            if kind < WAIT:
                done = _share_out(C, X, start, end)
            else:
                done = end - start < 3 or np.random.random() < 0.1 or _swap(o, W, C, held, r)
                if done:
                    _bias(o, W, F, C, r, biased, unfit, heat if np.random.random() < 0.1 else 0.0)
                    done = best_poses(o, W, F, C, r, biased, work, back) < np.inf
            if not done:
                _copy(old_C, old_X, C, X, start, end)
                continue
            cost[r] = time_robot(o, W, F, C, X, r)
        change = cost[r] - old_cost
        change += _change(o, W, F, C, X, phase, r, lag, hand, meet, old_lag, old_hand, old_meet, unfit, rate)
        if change <= 0.0 or np.random.random() < np.exp(-change / heat):
            total += change
            if firm == 1.0 and total < best - 1e-9:
                best = total
                _copy(C, X, best_C, best_X, 0, count)
                for k in range(robots):
                    best_phase[k] = phase[k]
            continue
        cost[r], phase[r] = old_cost, old_phase
        if kind >= PHASE:
            _copy(old_C, old_X, C, X, start, end)
        _restore(o, W, r, LAG_ROW, LAG_LIST, lag, old_lag)
        _restore(o, W, r, HAND_ROW, HAND_LIST, hand, old_hand)
        _restore(o, W, r, MEET_ROW, MEET_LIST, meet, old_meet)
    if best < np.inf:
        _copy(best_C, best_X, C, X, 0, count)
        for k in range(robots):
            phase[k] = best_phase[k]
    for r in range(robots):
        time_robot(o, W, F, C, X, r)
    return best
