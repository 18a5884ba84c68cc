"""Why a cell has no plan: lags or hand-overs that contradict each other, or a cycle time that is not enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import monotonic
from typing import TypeVar

from robojoule.planning.cells.linear import Limits
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.numbering import Numbering
from robojoule.programs.cell import Cell, Handover, TimeLag

SECONDS = 10.0  # for each question, at most
_LONGER = (1.5, 2.5, 5.0, 1.1)  # shares of the cycle time that are tried: long ones are the easiest
_SLICE = 0.25  # of the time that is left, for one cycle time
_CLOSE = 1e-3  # of the least cycle time that is named
_SAME_S = 1e-6  # by which shortest cycles may differ by rounding
_ANY_PLAN = 1e6  # gap at which the first plan is enough

T = TypeVar("T")


def brief(limits: Limits) -> Limits:
    """For one question: not as long as it takes to answer all, and not after a stop."""
    until = min(monotonic() + SECONDS, limits.until)
    return Limits(until=until, gap=1e-6, threads=limits.threads, seed=limits.seed, stop=limits.stop)


def contradicting_lags(cell: Cell, limits: Limits) -> tuple[TimeLag, ...]:
    """Time lags for which no cycle time is long enough, none of them needless as far as the time lasts."""

    def contradict(lags: Sequence[TimeLag]) -> bool:
        found = CellModel(Numbering(replace(cell, lags=tuple(lags), handovers=())), free_cycle_time=True)
        return found.program.solve(brief(limits)).status == "infeasible"

    return _irreducible(cell.lags, contradict, brief(limits).until)


def contradicting_handovers(cell: Cell, limits: Limits) -> tuple[Handover, ...]:
    """Hand-overs whose locations cannot be chosen together, likewise."""

    def contradict(handovers: Sequence[Handover]) -> bool:
        found = CellModel(Numbering(replace(cell, handovers=tuple(handovers))), free_cycle_time=True)
        return found.program.solve(brief(limits)).status == "infeasible"

    return _irreducible(cell.handovers, contradict, brief(limits).until)


def binding_handovers(model: CellModel, best: float, limits: Limits) -> tuple[Handover, ...]:
    """Hand-overs without which a shortest or longest cycle would not be what it is, likewise; none if it were.

    Args:
        model: Of all robots with a free cycle time.
        best: The least value of its objective. [s]
        limits: When to end at the latest, threads and seed of the solver.
    """
    numbers = model.numbers

    def bind(handovers: Sequence[Handover]) -> bool:
        fewer = CellModel(Numbering(replace(numbers.cell, handovers=tuple(handovers))), free_cycle_time=True)
        fewer.program.cost[fewer.CT] = model.program.cost[model.CT]
        return fewer.program.solve(brief(limits)).bound > best - _SAME_S

    return () if bind(()) else _irreducible(numbers.cell.handovers, bind, brief(limits).until)


def _irreducible(all_of: Sequence[T], contradict: Callable[[Sequence[T]], bool], until: float) -> tuple[T, ...]:
    """What is left of some conditions that contradict each other when all that are not needed for it are taken out."""
    kept, size = list(all_of), max(len(all_of) // 2, 1)
    while True:
        first = 0
        while first < len(kept) and monotonic() < until:
            fewer = kept[:first] + kept[first + size :]
            if contradict(fewer):
                kept = fewer
            else:
                first += size
        if size == 1 or monotonic() > until:
            return tuple(kept)
        size = max(size // 2, 1)


def enough_s(cell: Cell, least_s: float, limits: Limits) -> float | None:
    """A cycle time at which there is a plan, close to the least one if the time lasts; none if none was found. [s]

    Args:
        cell: A cell that has no plan at its cycle time.
        least_s: Cycle time below which there is none. [s]
        limits: When to end at the latest, threads and seed of the solver.
    """
    until = brief(limits).until

    def has_plan(cycle_time_s: float) -> bool:
        now = monotonic()
        model = CellModel(Numbering(replace(cell, cycle_time_s=cycle_time_s)))
        within = replace(brief(limits), until=now + _SLICE * max(until - now, 0.0), gap=_ANY_PLAN)
        return model.program.solve(within).values is not None

    low = max(cell.cycle_time_s, least_s)
    high = next((low * share for share in _LONGER if has_plan(low * share)), None)
    while high is not None and high - low > _CLOSE * low and monotonic() < until - _SLICE:
        middle = 0.5 * (low + high)
        if has_plan(middle):
            high = middle
        else:
            low = middle
    return high
