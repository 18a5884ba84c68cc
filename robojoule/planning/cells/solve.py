"""Plans of cells: which search is used, when it ends, and what is told on the way."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, replace
from importlib.util import find_spec
from time import monotonic

from robojoule.errors import InputError, PlanningError
from robojoule.inputs import as_number, as_whole, shown
from robojoule.planning.any_plan import gap_percent
from robojoule.planning.cells.check import checked
from robojoule.planning.cells.exact import ExactSearch, Found
from robojoule.planning.cells.feasibility import NO_PLAN, explain
from robojoule.planning.cells.large import LargeSearch
from robojoule.planning.cells.linear import Limits, release_threads
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.plan import CellPlan
from robojoule.planning.cells.selection import plan_of
from robojoule.programs.cell import Cell
from robojoule.progress import Progress, heard_by

TIME_LIMIT_S = 60.0
GAP_PERCENT = 0.01
SMALL, MIDDLE = 350, 1000  # movements up to which the model alone is best, and up to which it can prove something
EXPLANATION_S = 10.0  # since the start: so long at least it may be sought why there is no plan
SHARE_OF_SEARCH = 0.4  # of the time, for the search before the model in cells of middle size


@dataclass(frozen=True)
class SearchProgress(Progress):
    """How far a search is: `done` is the time since its start [s], `total` its time limit [s].

    Attributes:
        energy_j: Energy of the best plan so far; infinity before the first. [J]
        bound_j: Proven bound so far. [J]
    """

    energy_j: float
    bound_j: float

    @property
    def gap_percent(self) -> float:
        """By how much the energy may lie above the optimum; infinity before the first plan. [%]"""
        return gap_percent(self.energy_j, self.bound_j) if self.energy_j < math.inf else math.inf

    @property
    def text(self) -> str:
        """The best plan so far, for people."""
        if math.isinf(self.energy_j):
            return f"{self.work}: no plan yet"
        return f"{self.work}: {self.energy_j:.1f} J, bound {self.bound_j:.1f} J, gap {self.gap_percent:.3f} %"

    def left_s(self, elapsed_s: float, done_before: float = 0.0) -> float:
        """Time until the search ends at the latest. [s]"""
        return max(self.total - self.done, 0.0)


def solve_cell(
    cell: Cell,
    *,
    time_limit_s: float = TIME_LIMIT_S,
    gap_percent: float = GAP_PERCENT,
    threads: int = 1,
    seed: int = 0,
    progress: Callable[[SearchProgress], None] | None = None,
    stop: Callable[[], bool] | None = None,
    executor: Executor | None = None,
    explained: bool = True,
) -> CellPlan:
    """The plan of a cell with the least energy that was found, checked, with a proven bound.

    Args:
        cell: The cell.
        time_limit_s: When the search ends with the best plan so far. [s]
        gap_percent: Proven gap at which it ends. [%]
        threads: Threads of the solver.
        seed: Of random choices; equal seeds give equal plans where no time limit cuts. The search of cells of more than
            `SMALL` movements has limits of its own inside.
        progress: Hears whenever the best plan or the bound changes, and once before (`SearchProgress`).
        stop: Is asked now and then whether the search shall end with the best plan so far.
        executor: Runs the annealing of large cells from as many seeds as there are threads beside each other: any
            executor of `concurrent.futures`, so also one of other machines; threads of this process if not given.
        explained: Whether it is found out why a cell has no plan.

    Raises:
        InputError: An argument is out of range, or the cell has no plan; says why.
        CycleTimeTooShort: The cycle time is too short; says for which robot or lags, and the least feasible one.
        PlanningError: No plan was found in time.
    """
    began = monotonic()
    if stop is not None and not callable(stop):
        raise InputError(f"{shown(stop)} cannot be called", key="stop", allowed="a function")
    if executor is not None and not isinstance(executor, Executor):
        raise InputError(f"{shown(executor)} is not an executor", key="executor", allowed="one of concurrent.futures")
    listener = heard_by(progress)
    limits = Limits(
        until=began + as_number(time_limit_s, "time_limit", least=0.01, most=1e7, unit="s"),
        gap=as_number(gap_percent, "gap", least=0.0, most=100.0, unit="%") / 100.0,
        threads=as_whole(threads, "threads", least=1, most=1024, unit="threads"),
        seed=as_whole(seed, "seed", least=0, most=2**31 - 1),
        stop=stop,
    )

    def tell(energy_j: float, bound_j: float) -> None:
        if listener is not None:
            listener(SearchProgress(cell.name, monotonic() - began, limits.until - began, energy_j, bound_j))

    tell(math.inf, 0.0)
    numbers = Numbering(cell)
    try:
        found = _search(numbers, limits, lambda best: tell(best.energy_j, best.bound_j), executor)
        if found.status == "infeasible":
            if not explained:
                raise InputError(NO_PLAN)
            raise explain(numbers, replace(limits, until=max(limits.until, began + EXPLANATION_S)))
    finally:
        if limits.threads > 1:
            release_threads()
    runtime = monotonic() - began
    if found.selection is None or found.timing is None:
        raise PlanningError(f"no plan of cell '{cell.name}' was found in {runtime:.1f} s")
    plan = plan_of(numbers, found.selection, found.timing.times, found.status, found.bound_j, runtime)
    plan = checked(cell, plan)  # refuses a bound that is above the energy by more than rounding
    return replace(plan, bound_j=min(plan.bound_j, plan.energy_j))


def _search(numbers: Numbering, limits: Limits, tell: Callable[[Found], None], executor: Executor | None) -> Found:
    """The search that suits the size of a cell."""
    start = None
    bound = 0.0
    if numbers.movements > SMALL and (numbers.movements > MIDDLE or find_spec("numba") is not None):
        share = 1.0 if numbers.movements > MIDDLE else SHARE_OF_SEARCH
        until = monotonic() + share * (limits.until - monotonic())
        own = ThreadPoolExecutor(limits.threads) if executor is None and limits.threads > 1 else nullcontext(executor)
        with own as used:
            found = LargeSearch(numbers, replace(limits, until=until), tell, used, limits.threads).run()
        if found.status in ("optimal", "infeasible") or numbers.movements > MIDDLE:
            return found
        bound = found.bound_j
        if found.selection is not None and found.timing is not None:
            start = (found.selection, found.timing)
    search = ExactSearch(CellModel(numbers), limits, tell)
    search.best = replace(search.best, bound_j=bound)
    return search.run(start)
