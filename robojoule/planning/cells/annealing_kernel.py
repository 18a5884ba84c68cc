"""The compiled part of `robojoule.planning.cells.annealing`: moves, and the run.

Arguments are those of `robojoule.planning.cells.annealing_costs`.
"""
# ruff: noqa: NPY002 - numba knows numpy's older random functions only

from __future__ import annotations

import numpy as np

from robojoule.planning.cells.annealing_costs import (
    ARC_ORIGIN,
    ARCS,
    FIRST,
    HAND_COUNT,
    HAND_LIST,
    HAND_ROW,
    HANDS,
    LAG_COUNT,
    LAG_LIST,
    LAG_ROW,
    LEVELS,
    LOCATION,
    LOCATIONS,
    MEET_COUNT,
    MEET_LIST,
    MEET_ROW,
    MIDDLE_LEVEL,
    MOST_LEVELS,
    MOVE_COST_J,
    ORDER,
    PACE,
    PLACE_COST_J,
    POSE,
    ROBOT,
    ROBOTS,
    SHARE,
    STATICS,
    TABLE,
    TABLE_ORIGIN,
    UNFIT_J,
    fit,
    hand_cost,
    lag_cost,
    meet_cost,
    njit,
    time_robot,
)

COSTS = "b4cfdf0b5c0f"  # of the module of costs: what is kept of this compiled one would not see changes there
HOT_J, COLD_J = 300.0, 1.0
RECOUNT = 2000  # iterations after which sums are made anew
FIRM = 0.8  # share of the run from which penalties stay as they are and the best state is kept
FAR_S = 2.0  # of a small change of a phase; of a large one in cycles:
FAR_CYCLES = 0.35
PHASE, WAIT, HURRY = 0.15, 0.32, 0.47  # shares of moves: phases, waits (up to here), paces, tours
LONGEST_SEGMENT = 6


@njit(cache=True, nogil=True)
def _below(count):  # type: ignore[no-untyped-def]
    """A random whole number from 0 to count - 1."""
    return min(int(np.random.random() * count), count - 1)


@njit(cache=True, nogil=True)
def _forward(o, W, F, C, X, r, closing, biased, work, back):  # type: ignore[no-untyped-def]
    """Least cost from the closing location around to itself; `back` holds the location before each one."""
    start, count = W[o[FIRST] + r], W[o[FIRST] + r + 1] - W[o[FIRST] + r]
    base = W[o[LOCATION] + start]
    width = W[o[LOCATION] + W[o[FIRST] + r + 1]] - base
    for i in range(count):
        v = C[ORDER, start + i]
        low, high = W[o[LOCATION] + v], W[o[LOCATION] + v + 1]
        before_low, before_high = closing, closing + 1
        u = C[ORDER, start + i - 1] if i > 0 else C[ORDER, start + count - 1]
        level = MIDDLE_LEVEL + int(X[PACE, u])
        if i > 0:
            before_low, before_high = W[o[LOCATION] + u], W[o[LOCATION] + u + 1]
        if i == count - 1:
            low, high = closing, closing + 1
        for place in range(low, high):
            least, where = np.inf, -1
            for before in range(before_low, before_high):
                t = W[o[TABLE] + W[o[TABLE_ORIGIN] + r] + (before - base) * width + place - base]
                if t >= 0:
                    value = F[o[MOVE_COST_J] + t * LEVELS + level]
                    if i > 0:
                        value += work[i - 1, before - before_low]
                    if value < least:
                        least, where = value, before
            work[i, place - W[o[LOCATION] + v]] = least + biased[place]
            back[i, place - W[o[LOCATION] + v]] = where
    return work[count - 1, closing - W[o[LOCATION] + C[ORDER, start + count - 1]]]


@njit(cache=True, nogil=True)
def best_poses(o, W, F, C, X, r, biased, work, back):  # type: ignore[no-untyped-def]
    """Poses of a robot's tour with the least cost, by a dynamic program for each pose of the activity that ends it.

    Writes the poses; returns the cost, infinity where no movements join.
    """
    start, end = W[o[FIRST] + r], W[o[FIRST] + r + 1]
    last = C[ORDER, end - 1]
    best, chosen = np.inf, -1
    for closing in range(W[o[LOCATION] + last], W[o[LOCATION] + last + 1]):
        value = _forward(o, W, F, C, X, r, closing, biased, work, back)
        if value < best:
            best, chosen = value, closing
    if chosen >= 0:
        _forward(o, W, F, C, X, r, chosen, biased, work, back)
        place = chosen
        for i in range(end - start - 1, -1, -1):
            v = C[ORDER, start + i]
            C[POSE, v] = place
            place = back[i, place - W[o[LOCATION] + v]]
    return best


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
            if not (fit(o, W, h, place, C[POSE, w]) if own == v else fit(o, W, h, C[POSE, v], place)):
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
def _hurry(C, X, start, end):  # type: ignore[no-untyped-def]
    """Change the pace of some movements in a row; whether any changed."""
    count = end - start
    step = (1.0 if np.random.random() < 0.5 else -1.0) * (1.0 if np.random.random() < 0.6 else 3.0)
    first, length, changed = _below(count), 1 + _below(count), False
    for x in range(first, first + length):
        v = C[ORDER, start + x % count]
        pace = min(max(X[PACE, v] + step, -MOST_LEVELS), MOST_LEVELS)
        changed = changed or pace != X[PACE, v]
        X[PACE, v] = pace
    return changed


@njit(cache=True, nogil=True)
def _copy(C, X, to_C, to_X, start, end):  # type: ignore[no-untyped-def]
    """Copy the state of some static activities; loops compile faster than slices."""
    for row in range(3):
        for v in range(start, end):
            to_C[row, v] = C[row, v]
    for row in range(5):
        for v in range(start, end):
            to_X[row, v] = X[row, v]


@njit(cache=True, nogil=True)
def _recount(o, W, F, C, X, phase, lag, hand, meet, unfit, rate):  # type: ignore[no-untyped-def]
    """All penalties anew; returns their sum."""
    total = 0.0
    for g in range(o[LAG_COUNT]):
        lag[g] = lag_cost(o, W, F, C, X, phase, g, rate)
        total += lag[g]
    for h in range(o[HAND_COUNT]):
        hand[h] = hand_cost(o, W, C, h, unfit)
        total += hand[h]
    for c in range(o[MEET_COUNT]):
        meet[c] = meet_cost(o, W, F, C, X, phase, c, rate)
        total += meet[c]
    return total


@njit(cache=True, nogil=True)
def _change(o, W, F, C, X, phase, r, lag, hand, meet, old_lag, old_hand, old_meet, unfit, rate):  # type: ignore[no-untyped-def]
    """Penalties of a robot anew, the old ones put aside; returns by how much they grew."""
    change = 0.0
    for x in range(W[o[LAG_ROW] + r], W[o[LAG_ROW] + r + 1]):
        g = W[o[LAG_LIST] + x]
        old_lag[g] = lag[g]
        lag[g] = lag_cost(o, W, F, C, X, phase, g, rate)
        change += lag[g] - old_lag[g]
    for x in range(W[o[HAND_ROW] + r], W[o[HAND_ROW] + r + 1]):
        h = W[o[HAND_LIST] + x]
        old_hand[h] = hand[h]
        hand[h] = hand_cost(o, W, C, h, unfit)
        change += hand[h] - old_hand[h]
    for x in range(W[o[MEET_ROW] + r], W[o[MEET_ROW] + r + 1]):
        c = W[o[MEET_LIST] + x]
        old_meet[c] = meet[c]
        meet[c] = meet_cost(o, W, F, C, X, phase, c, rate)
        change += meet[c] - old_meet[c]
    return change


@njit(cache=True, nogil=True)
def _restore(o, W, r, row, listed, values, old):  # type: ignore[no-untyped-def]
    """Penalties of one kind of a robot as they were."""
    for x in range(W[o[row] + r], W[o[row] + r + 1]):
        values[W[o[listed] + x]] = old[W[o[listed] + x]]


@njit(cache=True, nogil=True)
def anneal(o, W, F, C, X, phase, iterations, seed, hot, halt):  # type: ignore[no-untyped-def]
    """Anneal a state in place to the best one that was met in the last part of the run; returns its cost.

    Ends early when `halt` is set.
    """
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
        np.empty((5, count)),
        np.empty((3, count), np.int64),
        np.empty((5, count)),
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
            if halt[0] != 0:
                break
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
            elif kind < HURRY:
                done = _hurry(C, X, start, end)
                if np.random.random() < 0.5:
                    done = _hurry(C, X, start, end) or done
            else:
                done = end - start < 3 or np.random.random() < 0.1 or _swap(o, W, C, held, r)
                if done:
                    _bias(o, W, F, C, r, biased, unfit, heat if np.random.random() < 0.1 else 0.0)
                    done = best_poses(o, W, F, C, X, r, biased, work, back) < np.inf
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
