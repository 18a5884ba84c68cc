"""One choice for each of some classes, with the least total cost within a budget of time (multiple-choice knapsack).

Sets and data: classes i with options k, each with a duration d_ik [s] and a cost c_ik [J]; a budget b [s].

    min sum_i c_i,k(i)    subject to    sum_i d_i,k(i) <= b

1. Options that another one of their class beats in both are left out.
2. The lower hulls of the classes, joined in the order of their slopes, give the linear bound and its price of time
   l [W]; going through the hulls greedily and filling what is left gives a first choice.
3. An option whose reduced cost c + l d, above the least one of its class, exceeds the gap between the two is in no
   better choice and is left out (Pisinger, European Journal of Operational Research 83, 1995, does the same).
4. What remains is solved class by class: of partial choices those are kept that no other one beats in time and cost.
   Costs within the tolerance, shared out over the classes, count as equal: that bounds their number and the error. A
   coarse tolerance goes first, as the choice that it finds lets step 3 leave out more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array
from robojoule.errors import PlanningError
from robojoule.progress import told

_TIME_TOLERANCE_S = 1e-9  # what sums of durations may exceed a budget by: rounding
_COARSENESS = (256.0, 64.0, 16.0, 4.0, 1.0)  # tolerances of a search: a coarse one leaves less to the next one
_MOST_PARTIAL = 2_000_000  # partial choices of one class that are kept at most: bounds memory

Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Choice:
    """A choice and its proof.

    Attributes:
        options: Chosen option of each class.
        cost_j: Its total cost. [J]
        bound_j: No choice costs less. [J]
        price_w: What a little more time would save; 0 where there is time to spare. [W]
    """

    options: tuple[int, ...]
    cost_j: float
    bound_j: float
    price_w: float


@dataclass(frozen=True)
class _Class:
    """Options of a class that no other one of it beats, durations rising and costs falling."""

    kept: Indices
    durations_s: Array
    costs_j: Array

    @classmethod
    def of(cls, durations_s: Array, costs_j: Array) -> _Class:
        order = np.lexsort((costs_j, durations_s))
        before = np.append(np.inf, np.minimum.accumulate(costs_j[order])[:-1])
        kept = order[costs_j[order] < before]
        return cls(kept, durations_s[kept], costs_j[kept])

    def hull(self) -> Indices:
        """Options on the lower hull."""
        found: list[int] = []
        d, c = self.durations_s, self.costs_j
        for point in range(d.size):
            while len(found) >= 2:
                a, b = found[-2], found[-1]
                if (c[b] - c[a]) * (d[point] - d[a]) < (c[point] - c[a]) * (d[b] - d[a]):
                    break
                found.pop()
            found.append(point)
        return np.array(found, dtype=np.intp)

    def only(self, which: NDArray[np.bool_]) -> _Class:
        return _Class(self.kept[which], self.durations_s[which], self.costs_j[which])


def least_cost_choice(
    durations_s: Sequence[Array], costs_j: Sequence[Array], budget_s: float, *, tolerance_j: float
) -> Choice | None:
    """Choose one option of each class.

    Args:
        durations_s: Durations of each class's options. [s]
        costs_j: Their costs, of any sign. [J]
        budget_s: What the chosen durations may sum up to. [s]
        tolerance_j: By how much a better choice may be missed. [J]

    Returns:
        The choice; None where the fastest one does not fit.
    """
    classes = [_Class.of(d, c) for d, c in zip(durations_s, costs_j, strict=True)]
    budget = budget_s + _TIME_TOLERANCE_S
    if sum(float(one.durations_s[0]) for one in classes) > budget:
        return None
    chosen, price_w = _greedy(classes, budget)
    cost = _cost(classes, chosen)
    options = [int(one.kept[k]) for one, k in zip(classes, chosen, strict=True)]
    bound, reduced = _reduced(classes, price_w, budget)
    for coarseness in _COARSENESS:
        if cost - bound <= tolerance_j:
            break
        left = [one.only(r <= cost - bound) for one, r in zip(classes, reduced, strict=True)]
        better = _by_class(left, budget, price_w, cost - bound, coarseness * tolerance_j)
        if better is not None and _cost(left, better) < cost:
            cost = _cost(left, better)
            options = [int(one.kept[k]) for one, k in zip(left, better, strict=True)]
    else:
        bound = max(bound, cost - tolerance_j)
    return Choice(tuple(options), cost, min(bound, cost), price_w)


def _cost(classes: Sequence[_Class], chosen: Sequence[int]) -> float:
    return sum(float(one.costs_j[k]) for one, k in zip(classes, chosen, strict=True))


def _greedy(classes: Sequence[_Class], budget_s: float) -> tuple[list[int], float]:
    """A choice along the hulls, filled up, and the price of time at which the budget ends. [W]"""
    hulls = [one.hull() for one in classes]
    owner = np.repeat(np.arange(len(hulls)), [hull.size - 1 for hull in hulls])
    steps = [np.diff(one.durations_s[hull]) for one, hull in zip(classes, hulls, strict=True)]
    falls = [np.diff(one.costs_j[hull]) for one, hull in zip(classes, hulls, strict=True)]
    length, slopes = np.concatenate(steps), np.concatenate(falls) / np.concatenate(steps)
    ends = np.concatenate([hull[1:] for hull in hulls])
    left = budget_s - sum(float(one.durations_s[0]) for one in classes)
    chosen = [0] * len(classes)
    price_w, stopped = 0.0, set[int]()
    for step in np.argsort(slopes, kind="stable").tolist():
        i = int(owner[step])
        if i in stopped:
            continue
        if length[step] <= left:
            chosen[i], left = int(ends[step]), left - float(length[step])
        else:
            price_w = price_w or -float(slopes[step])
            stopped.add(i)
    for i, one in enumerate(classes):  # what is left of the budget: options beside the hull
        fits = np.flatnonzero(one.durations_s <= one.durations_s[chosen[i]] + left)
        left -= float(one.durations_s[fits[-1]] - one.durations_s[chosen[i]])
        chosen[i] = int(fits[-1])
    return chosen, price_w


def _reduced(classes: Sequence[_Class], price_w: float, budget_s: float) -> tuple[float, list[Array]]:
    """The bound that a price of time proves, and by how much each option is above the best of its class at it. [J]"""
    priced = [one.costs_j + price_w * one.durations_s for one in classes]
    least = [float(costs.min()) for costs in priced]
    return sum(least) - price_w * budget_s, [costs - low for costs, low in zip(priced, least, strict=True)]


def _by_class(
    classes: Sequence[_Class], budget_s: float, price_w: float, gap_j: float, tolerance_j: float
) -> list[int] | None:
    """The best choice within the tolerance, class by class; None if all are above the bound by more than the gap."""
    _, reduced = _reduced(classes, price_w, budget_s)
    fastest = np.array([float(one.durations_s[0]) for one in classes])
    slowest = np.array([float(one.durations_s[-1]) for one in classes])
    rest_low = np.append(np.cumsum(fastest[::-1])[::-1], 0.0)[1:]
    rest_high = np.append(np.cumsum(slowest[::-1])[::-1], 0.0)[1:]
    # What is not used of the budget is paid at its price, so it cannot be more than the gap allows.
    unused_s = gap_j / price_w if price_w > 0.0 else np.inf
    step_j = tolerance_j / len(classes)
    times, costs, above = np.zeros(1), np.zeros(1), np.zeros(1)
    trail: list[tuple[Indices, Indices]] = []
    for i, one in enumerate(told("whole speed limits", classes)):
        t = (times[:, None] + one.durations_s).ravel()
        c = (costs[:, None] + one.costs_j).ravel()
        r = (above[:, None] + reduced[i]).ravel()
        open_ = (t + rest_low[i] <= budget_s) & (t + rest_high[i] >= budget_s - unused_s) & (r <= gap_j)
        order = np.flatnonzero(open_)
        if order.size == 0:
            return None
        order = order[np.lexsort((c[order], t[order]))]
        order = order[_unbeaten(c[order], step_j)]
        if order.size > _MOST_PARTIAL:
            raise PlanningError(f"rounding the speed limits of {len(classes)} moves has too many choices")
        times, costs, above = t[order], c[order], r[order]
        trail.append((order // one.kept.size, order % one.kept.size))
    state, chosen = int(costs.argmin()), [0] * len(classes)
    for i in range(len(classes) - 1, -1, -1):
        parents, options = trail[i]
        chosen[i], state = int(options[state]), int(parents[state])
    return chosen


def _unbeaten(costs_j: Array, step_j: float) -> Indices:
    """Which of some partial choices, sorted by time, cost less by a step than all faster ones that are kept."""
    before = np.append(np.inf, np.minimum.accumulate(costs_j)[:-1])
    candidates = np.flatnonzero(costs_j < before)
    if step_j <= 0.0 or candidates.size == 0:
        return candidates
    # Costs fall along the candidates: the first of each step of cost stands for the others of that step, which are
    # slower and cheaper by less than a step.
    steps = np.floor((costs_j[candidates[0]] - costs_j[candidates]) / step_j)
    kept: Indices = candidates[np.append(True, np.diff(steps) > 0.0)]
    return kept


def within_gap(
    durations_s: Sequence[Array], costs_j: Sequence[Array], budget_s: float, *, cost_j: float
) -> list[Indices]:
    """Options that may be part of a choice which costs no more than a known one.

    Args:
        durations_s: Durations of each class's options. [s]
        costs_j: Costs that no option undercuts. [J]
        budget_s: What the chosen durations may sum up to. [s]
        cost_j: Cost of a choice that is known to fit. [J]

    Returns:
        Those options of each class.
    """
    budget = budget_s + _TIME_TOLERANCE_S
    _, price_w = _greedy([_Class.of(d, c) for d, c in zip(durations_s, costs_j, strict=True)], budget)
    priced = [c + price_w * d for d, c in zip(durations_s, costs_j, strict=True)]
    gap = cost_j - sum(float(costs.min()) for costs in priced) + price_w * budget
    return [np.flatnonzero(costs - costs.min() <= gap) for costs in priced]
