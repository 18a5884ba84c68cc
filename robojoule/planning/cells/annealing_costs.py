"""Times, costs and penalties of `robojoule.planning.cells.annealing`, compiled; and what they are called with.

Functions take few arrays, as the time of compiling grows with their number: `W` and `F` hold all whole and floating
numbers of a `Problem` one behind the other, `o` where each of its fields begins in them (`W[o[TAIL] + e]` is the tail
of dynamic activity e); rows of `C` and `X` hold the state (`C[POSE, v]`, `X[SHARE, v]`), beside `phase`, in the units
of `Problem`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

try:
    from numba import njit as njit
except ImportError:  # the same functions in plain Python: a thousand times slower, for tests and small cells
    F = TypeVar("F", bound=Callable[..., Any])

    def njit(**_: bool) -> Callable[[F], F]:
        """Leave a function as it is."""
        return lambda function: function


TOO_LONG_W = 200.0  # for what exceeds the cycle or the window of a stay
LATE_W, LATE_MARGIN_S = 40.0, 0.3
UNFIT_J = 60.0
OVERLAP_W, OVERLAP_J = 20.0, 2.0
LEVELS = 25  # prices of time in steps, at which durations of movements are tabled; the middle one is the robot's
MIDDLE_LEVEL = 12
MOST_LEVELS = 8.0  # by which a movement's price may differ from that of its robot
CLOSE_S, CLOSING_TURNS = 2e-4, 12  # how well the cycle is met, and in how many turns at most
AT_START, AT_END = -1, -2  # of a lag, instead of a dynamic activity
# Places in `o`, in the order of these names; then the counts.
(ROBOT, LAST, FIRST, LOCATION, STAY, TABLE, TABLE_ORIGIN, ARCS, ARC_ORIGIN, MOVE_DYNAMIC) = range(10)
(TAIL, LAGS, LAG_ROW, LAG_LIST, HANDS, FITS, FIT_ORIGIN, HAND_ROW, HAND_LIST) = range(10, 19)
(MEETINGS, MEET_ROW, MEET_LIST) = range(19, 22)
(_, PRICE_W, MOVE_COST_J, MOVE_TIME_S, PLACE_COST_J) = range(22, 27)
(STAY_POWER_W, STAY_LEAST_S, STAY_LONGEST_S, LAG_LENGTH_S) = range(27, 31)
(HIGHEST_LEVEL,) = range(31, 32)
(ROBOTS, STATICS, LOCATIONS, LAG_COUNT, HAND_COUNT, MEET_COUNT) = range(32, 38)
ORDER, POSE, LEAVING = range(3)
SHARE, BEGIN_S, STAY_S, MOVE_S, PACE = range(5)


@njit(cache=True, nogil=True)
def at_level(o, F, table, t, level):  # type: ignore[no-untyped-def]
    """Duration or cost of a movement at a price of time, between the tabled ones."""
    place = min(max(level + MIDDLE_LEVEL, 0.0), LEVELS - 1.0)
    low = min(int(place), LEVELS - 2)
    begin = o[table] + t * LEVELS + low
    return F[begin] + (place - low) * (F[begin + 1] - F[begin])


@njit(cache=True, nogil=True)
def _moving_s(o, W, F, C, X, r, level):  # type: ignore[no-untyped-def]
    """Time that a robot moves at a price of time, and how much longer at the next level."""
    total, slope = 0.0, 0.0
    for v in range(W[o[FIRST] + r], W[o[FIRST] + r + 1]):
        place = min(max(level + X[PACE, v] + MIDDLE_LEVEL, 0.0), LEVELS - 1.0)
        low = min(int(place), LEVELS - 2)
        begin = o[MOVE_TIME_S] + C[LEAVING, v] * LEVELS + low
        longer = F[begin + 1] - F[begin]
        total += F[begin] + (place - low) * longer
        if place > 0.0:
            slope += longer
    return total, slope


@njit(cache=True, nogil=True)
def _level(o, W, F, C, X, r, left):  # type: ignore[no-untyped-def]
    """Highest price of time at which a robot moves no longer than what is left, by Newton's method; the time."""
    highest, lowest = F[o[HIGHEST_LEVEL] + r], -MIDDLE_LEVEL - MOST_LEVELS
    level = highest
    moving, slope = _moving_s(o, W, F, C, X, r, level)
    for _ in range(CLOSING_TURNS):
        over = moving - left
        if abs(over) < CLOSE_S or slope <= 0.0 or (over < 0.0 and level >= highest) or (over > 0.0 and level <= lowest):
            break
        level = min(max(level - over / slope, lowest), highest)
        moving, slope = _moving_s(o, W, F, C, X, r, level)
    return level, moving


@njit(cache=True, nogil=True)
def time_robot(o, W, F, C, X, r):  # type: ignore[no-untyped-def]
    """Times of a robot's tour since the start of its cycle, and its cost at its price of time.

    Movements are as slow as the cycle allows, up to the price at which it is better to wait.
    """
    start, end = W[o[FIRST] + r], W[o[FIRST] + r + 1]
    base = W[o[LOCATION] + start]
    width = W[o[LOCATION] + end] - base
    standing, cost, shares = 0.0, 0.0, 0.0
    tail = C[ORDER, end - 1]
    for i in range(start, end):
        v = C[ORDER, i]
        C[LEAVING, tail] = W[o[TABLE] + W[o[TABLE_ORIGIN] + r] + (C[POSE, tail] - base) * width + C[POSE, v] - base]
        standing += F[o[STAY_LEAST_S] + W[o[STAY] + C[POSE, v]]]
        shares += X[SHARE, v]
        tail = v
    level, moving = _level(o, W, F, C, X, r, F[0] - standing)
    spare, factor = F[0] - standing - moving, 1.0
    if spare < CLOSE_S:
        cost += max(-spare - CLOSE_S, 0.0) * TOO_LONG_W
        factor = F[0] / (standing + moving)
        spare = 0.0
    clock = 0.0
    for i in range(start, end):
        v = C[ORDER, i]
        t = C[LEAVING, tail]
        cost += at_level(o, F, MOVE_COST_J, t, level + X[PACE, tail])
        X[MOVE_S, tail] = at_level(o, F, MOVE_TIME_S, t, level + X[PACE, tail]) * factor
        clock += X[MOVE_S, tail]
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
def lag_cost(o, W, F, C, X, phase, g, rate):  # type: ignore[no-untyped-def]
    """Penalty of a time lag."""
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
def fit(o, W, h, a, b):  # type: ignore[no-untyped-def]
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
def hand_cost(o, W, C, h, unfit):  # type: ignore[no-untyped-def]
    """Penalty of the poses of a hand-over."""
    return 0.0 if fit(o, W, h, C[POSE, W[o[HANDS] + 2 * h]], C[POSE, W[o[HANDS] + 2 * h + 1]]) else unfit


@njit(cache=True, nogil=True)
def _taken(o, W, C, activity, choice):  # type: ignore[no-untyped-def]
    """Whether a location or a movement is chosen."""
    if activity < o[STATICS]:
        return C[POSE, activity] == choice
    return C[LEAVING, W[o[TAIL] + activity - o[STATICS]]] == choice


@njit(cache=True, nogil=True)
def _span(o, W, F, C, X, phase, activity):  # type: ignore[no-untyped-def]
    """Start and duration of an activity that is done."""
    if activity < o[STATICS]:
        return _when(o, W, F, C, X, phase, activity, AT_START), X[STAY_S, activity]
    v = W[o[TAIL] + activity - o[STATICS]]
    return _when(o, W, F, C, X, phase, v, AT_END), X[MOVE_S, v]


@njit(cache=True, nogil=True)
def meet_cost(o, W, F, C, X, phase, c, rate):  # type: ignore[no-untyped-def]
    """Penalty of two choices that collide, by how long they overlap."""
    row = o[MEETINGS] + 4 * c
    if not _taken(o, W, C, W[row], W[row + 1]) or not _taken(o, W, C, W[row + 2], W[row + 3]):
        return 0.0
    start, time = _span(o, W, F, C, X, phase, W[row])
    other_start, other_time = _span(o, W, F, C, X, phase, W[row + 2])
    apart = (other_start - start) % F[0]
    overlap = 0.0
    if apart < time:
        overlap += min(time - apart, other_time)
    if apart + other_time > F[0]:
        overlap += min(apart + other_time - F[0], time)
    return OVERLAP_W * overlap * rate + OVERLAP_J if overlap > 0.0 else 0.0
