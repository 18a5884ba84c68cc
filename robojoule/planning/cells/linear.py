"""A mixed-integer linear program that is built by columns and rows, and its solution by HiGHS."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from time import monotonic
from typing import Any

import highspy
import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index
from robojoule.errors import PlanningError

INF = float("inf")


@dataclass(frozen=True, eq=False)
class Solution:
    """What the solver found.

    Attributes:
        status: "optimal", "infeasible" or "stopped" (by time or by request).
        values: Values of the columns; none without a solution.
        objective: Objective of `values`; infinity without.
        bound: Proven lower bound of the objective.
        duals: Of the rows of a linear program.
    """

    status: str
    values: Array | None
    objective: float
    bound: float
    duals: Array | None = None


@dataclass
class Limits:
    """When the solver ends.

    Attributes:
        until: Value of `time.monotonic` at which it stops. [s]
        gap: Relative gap at which it stops. [-]
        threads: Threads of the solver.
        seed: Of its random choices.
        stop: Says that it shall stop.
        improved: Is told each better solution: values, objective and bound.
        bounded: Is told the bound as the search goes on.
    """

    until: float = INF
    gap: float = 0.0
    threads: int = 1
    seed: int = 0
    stop: Callable[[], bool] | None = None
    improved: Callable[[Array, float, float], None] | None = None
    bounded: Callable[[float], None] | None = None


class LinearModel:
    """Columns and rows, collected and then handed to HiGHS as a whole."""

    def __init__(self) -> None:
        self.lower: list[float] = []
        self.upper: list[float] = []
        self.cost: list[float] = []
        self.integer: list[bool] = []
        self._starts: list[int] = [0]
        self._columns: list[int] = []
        self._values: list[float] = []
        self._row_lower: list[float] = []
        self._row_upper: list[float] = []
        self._highs: Any = None
        self._loaded_rows = 0

    def columns(
        self, count: int, lower: ArrayLike = 0.0, upper: ArrayLike = INF, cost: ArrayLike = 0.0, integer: bool = False
    ) -> Index:
        """Add columns; bounds and costs are one for all or one for each.

        Returns:
            Their numbers.
        """
        first = len(self.lower)
        for target, values in ((self.lower, lower), (self.upper, upper), (self.cost, cost)):
            target.extend(np.broadcast_to(np.asarray(values, dtype=float), (count,)).tolist())
        self.integer.extend([integer] * count)
        return np.arange(first, first + count)

    def row(self, terms: Iterable[tuple[int, float]], lower: float = -INF, upper: float = INF) -> int:
        """Add lower <= sum of coefficient * column <= upper; columns may be named more than once.

        Returns:
            Its number.
        """
        merged: dict[int, float] = {}
        for column, value in terms:
            merged[column] = merged.get(column, 0.0) + value
        self._columns.extend(merged)
        self._values.extend(merged.values())
        self._starts.append(len(self._columns))
        self._row_lower.append(lower)
        self._row_upper.append(upper)
        return len(self._row_lower) - 1

    def priced(self, rows: Sequence[int], prices: ArrayLike) -> tuple[Array, float]:
        """Costs of all columns if some rows are paid for instead of kept.

        Args:
            rows: Rows with one bound, or two equal ones.
            prices: Of each row, as its dual; 0 in place of those that have the wrong sign for the bound.

        Returns:
            Costs, shape (columns,), and what is to be added to the objective: for values that keep the rows the sum of
            both is not above the objective.
        """
        cost, constant = np.array(self.cost), 0.0
        for row, price in zip(rows, np.asarray(prices, dtype=float).tolist(), strict=True):
            lower, upper = self._row_lower[row], self._row_upper[row]
            paid = price if lower == upper else max(price, 0.0) if upper == INF else min(price, 0.0)
            own = slice(self._starts[row], self._starts[row + 1])
            cost[self._columns[own]] -= paid * np.array(self._values[own])  # a row names a column once
            constant += paid * (lower if upper == INF else upper)
        return cost, constant

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self._row_lower)

    def solve(
        self,
        limits: Limits,
        *,
        relaxed: bool = False,
        start: Array | None = None,
        fixed: tuple[Index, Array] | None = None,
    ) -> Solution:
        """Solve the program, or its relaxation without integers.

        Args:
            limits: When to end.
            relaxed: Whether integers are left out; rows that were added since the last time start from its basis.
            start: Values to start the search from.
            fixed: Columns that are held at values.

        Raises:
            PlanningError: The solver failed.
        """
        highs = self._load(relaxed)
        if fixed is not None:
            numbers, values = fixed
            highs.changeColsBounds(
                len(numbers), np.asarray(numbers, dtype=np.int32), np.asarray(values), np.asarray(values)
            )
        for option, value in (
            ("mip_rel_gap", max(limits.gap, 0.0)),
            ("mip_abs_gap", 1e-6),
            ("threads", limits.threads),
            ("random_seed", limits.seed),
            ("time_limit", max(limits.until - monotonic(), 0.01) + highs.getRunTime() if limits.until < INF else INF),
            ("mip_feasibility_tolerance", 1e-7),
            ("mip_allow_restart", False),  # on these models restarts cost more than they save
        ):
            highs.setOptionValue(option, value)
        if start is not None and not relaxed:
            found = highspy.HighsSolution()
            found.col_value = start.tolist()
            highs.setSolution(found)
        _listen(highs, limits)
        try:
            highs.run()
            if highs.getModelStatus() == highspy.HighsModelStatus.kNotset:
                # Threads are shared by all that HiGHS does in a process, and their number was another one before.
                release_threads()
                highs.run()
            return self._solution(highs, relaxed)
        finally:
            highs.clearCallbacks()
            if fixed is not None:
                highs.changeColsBounds(
                    len(numbers),
                    np.asarray(numbers, dtype=np.int32),
                    np.asarray(self.lower)[numbers],
                    np.asarray(self.upper)[numbers],
                )

    def _load(self, relaxed: bool) -> Any:
        """The solver with all rows; a relaxation is kept for the next time."""
        if relaxed and self._highs is not None:
            added = self.rows - self._loaded_rows
            if added:
                first = self._starts[self._loaded_rows]
                self._highs.addRows(
                    added,
                    np.array(self._row_lower[self._loaded_rows :]),
                    np.array(self._row_upper[self._loaded_rows :]),
                    len(self._columns) - first,
                    np.array(self._starts[self._loaded_rows : -1], dtype=np.int32) - first,
                    np.array(self._columns[first:], dtype=np.int32),
                    np.array(self._values[first:]),
                )
                self._loaded_rows = self.rows
            return self._highs
        highs = highspy.Highs()
        highs.setOptionValue("output_flag", False)
        highs.passModel(self._program(relaxed))
        if relaxed:
            self._highs, self._loaded_rows = highs, self.rows
        return highs

    def _program(self, relaxed: bool) -> Any:
        program = highspy.HighsLp()
        program.num_col_, program.num_row_ = len(self.lower), self.rows
        program.col_cost_ = np.array(self.cost)
        program.col_lower_, program.col_upper_ = np.array(self.lower), np.array(self.upper)
        program.row_lower_, program.row_upper_ = np.array(self._row_lower), np.array(self._row_upper)
        program.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        program.a_matrix_.start_ = np.array(self._starts, dtype=np.int32)
        program.a_matrix_.index_ = np.array(self._columns, dtype=np.int32)
        program.a_matrix_.value_ = np.array(self._values)
        if not relaxed:
            kinds = highspy.HighsVarType
            program.integrality_ = [kinds.kInteger if one else kinds.kContinuous for one in self.integer]
        return program

    def _solution(self, highs: Any, relaxed: bool) -> Solution:
        status, info = highs.getModelStatus(), highs.getInfo()
        kinds = highspy.HighsModelStatus
        if status in (kinds.kInfeasible, kinds.kUnboundedOrInfeasible):
            return Solution("infeasible", None, INF, INF)
        if status not in (
            kinds.kOptimal,
            kinds.kTimeLimit,
            kinds.kInterrupt,
            kinds.kObjectiveTarget,
            kinds.kObjectiveBound,
            kinds.kSolutionLimit,
        ):
            raise PlanningError(f"HiGHS failed on a model of a cell ({highs.modelStatusToString(status)})")
        found = info.primal_solution_status == 2
        solution = highs.getSolution() if found else None
        values = np.array(solution.col_value) if solution is not None else None
        bound = info.mip_dual_bound if not relaxed and any(self.integer) else info.objective_function_value
        if status != kinds.kOptimal and (relaxed or not any(self.integer)):
            bound = -INF
        duals = np.array(solution.row_dual) if solution is not None and relaxed else None
        objective = float(info.objective_function_value) if found else INF
        return Solution("optimal" if status == kinds.kOptimal else "stopped", values, objective, float(bound), duals)


def release_threads() -> None:
    """Give up the threads that HiGHS keeps for the next run, which may want another number of them."""
    highspy.Highs.resetGlobalScheduler(True)


def _listen(highs: Any, limits: Limits) -> None:
    """Tell what the search finds, and stop it when asked to."""

    def check(event: Any) -> None:
        if limits.bounded is not None:
            limits.bounded(float(event.data_out.mip_dual_bound))
        check_stop(event)

    def check_stop(event: Any) -> None:
        if limits.stop is not None and limits.stop():
            event.interrupt()

    def better(event: Any) -> None:
        out = event.data_out
        if limits.improved is not None:
            limits.improved(np.array(out.mip_solution), float(out.objective_function_value), float(out.mip_dual_bound))

    if limits.stop is not None or limits.bounded is not None:
        highs.cbMipInterrupt.subscribe(check)
    if limits.stop is not None:
        highs.cbSimplexInterrupt.subscribe(check_stop)
    if limits.improved is not None:
        highs.cbMipImprovingSolution.subscribe(better)


def terms(columns: Index | Sequence[int], coefficient: float = 1.0) -> list[tuple[int, float]]:
    """The same coefficient for some columns."""
    return [(int(column), coefficient) for column in columns]
