"""Bounds of the start of each robot's cycle, by the time lags between the robots."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from robojoule.arrays import Array
from robojoule.planning.cells.numbering import Lag, Numbering


def phase_bounds_s(
    numbers: Numbering, robots: Collection[int], lags: Sequence[Lag], *, free_cycle_time: bool = False
) -> tuple[Array, Array]:
    """Earliest and latest start of each robot's cycle, shape (R,) each; the first of the robots starts at 0. [s]

    A lag bounds the difference of two phases as the starts that it joins lie in known windows of their cycles; sums of
    such bounds around all robots bound each phase against the first. What lags leave open, whole cycles do: `reach_s`.

    Args:
        numbers: The cell.
        robots: Robots that are planned.
        lags: Time lags between them.
        free_cycle_time: Whether the cycle time is not fixed, so that nothing is known.
    """
    count, first = numbers.robots, min(robots)
    if free_cycle_time:
        return np.where(np.arange(count) == first, 0.0, -np.inf), np.where(np.arange(count) == first, 0.0, np.inf)
    apart = np.full((count, count), -np.inf)  # t_b - t_a at least
    np.fill_diagonal(apart, 0.0)
    for lag in lags:
        if lag.every:
            a, b = int(numbers.static_robot[lag.first]), int(numbers.static_robot[lag.second])
            least = start_window_s(numbers, lag.first, lag.first_move)[0]
            most = start_window_s(numbers, lag.second, lag.second_move)[1]
            apart[a, b] = max(apart[a, b], lag.length_s - numbers.cycle_time_s * lag.cycles + least - most)
    for middle in range(count):
        apart = np.maximum(apart, apart[:, [middle]] + apart[[middle], :])
    reach = reach_s(numbers, lags)
    low = np.maximum(apart[first], -reach)
    high = np.minimum(-apart[:, first], reach)
    low[first] = high[first] = 0.0
    # Lags that contradict each other leave no phase: the model then says so, not its bounds.
    return np.minimum(low, high), np.maximum(low, high)


def reach_s(numbers: Numbering, lags: Sequence[Lag]) -> float:
    """By how much the starts of two robots' cycles need to differ at most; R cycles or more. [s]

    Robots may start whole cycles earlier or later as far as lags allow. Let the phases be sorted. All robots above a
    gap may start a cycle earlier if it is a cycle wide at least and each lag, from a below to b above, still holds:
    t_b - t_a >= CT + length - CT cycles + latest start in a's cycle - earliest one in b's. Once no such step is left,
    each gap is below CT or within such a pair. Of the pairs that are needed to cover all gaps no two have the same
    upper robot, nor the same lower one, so the R - 1 largest of what robots add bound the sum.
    """
    count, CT = numbers.robots, numbers.cycle_time_s
    added = np.full((2, count), CT)  # by the robots as lower and as upper ones
    for lag in lags:
        ends = int(numbers.static_robot[lag.first]), int(numbers.static_robot[lag.second])
        latest = np.clip(start_window_s(numbers, lag.first, lag.first_move)[1], 0.0, CT)
        earliest = np.clip(start_window_s(numbers, lag.second, lag.second_move)[0], 0.0, CT)
        between = CT + lag.length_s - CT * lag.cycles + latest - earliest
        for side, r in enumerate(ends):
            added[side, r] = max(added[side, r], between)
    return max(float((added.sum(axis=1) - added.min(axis=1)).min()), count * CT)


def start_window_s(numbers: Numbering, v: int, e: int) -> tuple[float, float]:
    """Earliest and latest start of v, or of what leaves it where e is not -1, since the start of its cycle. [s]"""
    if e >= 0:
        if v in numbers.last:
            return 0.0, 0.0
        leaving = numbers.leaving[v]
        return float(numbers.earliest_s[leaving].min()), float(numbers.latest_s[leaving].max())
    entering = numbers.entering[v]
    least = numbers.least_move_s[entering]
    return float((numbers.earliest_s[entering] + least).min()), float((numbers.latest_s[entering] + least).max())
