"""Exact plans: the model with tangents where plans are, until the proven gap in true energy is small enough.

Tangents never exceed the energy, so the bound of every model is one of the true problem. A round solves the model,
takes the best times of its choices (`robojoule.planning.cells.timing`), which gives a plan with its true energy, and
adds tangents at the durations of that plan. The first tangents come from the relaxation without integers, where all
movements of a robot have nearly the same slope, its price of time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import monotonic

import numpy as np

from robojoule.arrays import Array
from robojoule.planning.cells.linear import INF, Limits
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.selection import Selection, selection_of
from robojoule.planning.cells.tangents import spread_durations_s
from robojoule.planning.cells.timing import Timing, best_times

_FIRST_TANGENTS = 3
_CUT_ROUNDS = 12
_ROUNDS = 30
_SHARE_OF_GAP = 0.4  # of the gap asked for that is left to the search over the integers


@dataclass(frozen=True, eq=False)
class Found:
    """Result of a search.

    Attributes:
        status: "optimal" (within the gap), "feasible", "infeasible" or "unknown".
        selection: Best choices, if any.
        timing: Their times.
        bound_j: Proven bound of the true energy. [J]
    """

    status: str
    selection: Selection | None
    timing: Timing | None
    bound_j: float

    @property
    def energy_j(self) -> float:
        """True energy; infinity without a plan. [J]"""
        return self.timing.energy_j if self.timing is not None else INF


@dataclass(frozen=True, eq=False)
class Relaxation:
    """What a model gives without integers.

    Attributes:
        bound_j: Its objective, a bound [J]; infinity if it is infeasible, minus infinity if there was no time for it.
        prices_w: Price of time of each robot. [W]
        duals: Of the rows, but for the last tangents; none if there was no time.
    """

    bound_j: float
    prices_w: dict[int, float]
    duals: Array | None = None


def cut_relaxation(model: CellModel, limits: Limits, share: float = 1e-5) -> Relaxation:
    """Add tangents where the relaxation without integers is, until it stays.

    Args:
        model: Model of a cell; gets tangents.
        limits: When to end.
        share: Share of the objective that the tangents may miss.
    """
    n, t = model.numbers, model.movements
    bound = -INF
    best = Relaxation(bound, dict.fromkeys(model.parts.robots, 0.0))
    for at in spread_durations_s(n, t, _FIRST_TANGENTS):
        model.add_tangents(t, at)
    for _ in range(_CUT_ROUNDS):
        found = model.program.solve(limits, relaxed=True)
        if found.status == "infeasible":
            return replace(best, bound_j=INF)
        if found.values is None or found.status != "optimal":
            break
        bound = found.objective
        used = found.values[model.y[t]]
        at = np.where(used > 1e-6, found.values[model.d[t]] / np.maximum(used, 1e-6), 0.0)
        at = np.clip(at, n.d_min_s[t], n.d_max_s[t])
        missing = np.where(used > 1e-6, used * n.energies_j(t, at) - found.values[model.W[t]], 0.0)
        best = Relaxation(bound, _prices_w(model, used, at), found.duals)
        wanted = missing > share * abs(bound) / max(int(np.count_nonzero(used > 1e-6)), 1)
        if missing.sum() <= share * abs(bound) or not wanted.any() or monotonic() > limits.until:
            break
        model.add_tangents(t[wanted], at[wanted])
    return best


def add_price_tangents(model: CellModel, prices_w: dict[int, float], offsets_w: tuple[float, ...] = (0.0,)) -> None:
    """Tangents of all movements where their slope is the price of time of their robot, and so far from it."""
    n = model.numbers
    for r, price in prices_w.items():
        own = model.movements[n.dynamic_robot[n.movement_dynamic[model.movements]] == r]
        for offset in offsets_w:
            model.add_tangents(own, n.durations_at(own, price + offset))


def _prices_w(model: CellModel, used: Array, at: Array) -> dict[int, float]:
    n, t = model.numbers, model.movements
    inside = (used > 1e-6) & (at > n.d_min_s[t] * (1 + 1e-6)) & (at < n.d_max_s[t] * (1 - 1e-6))
    slopes = n.marginal_powers_w(t, at)
    robot = n.dynamic_robot[n.movement_dynamic[t]]
    return {
        r: float(np.median(slopes[mine])) if (mine := inside & (robot == r)).any() else 0.0
        for r in sorted(model.parts.robots)
    }


class ExactSearch:
    """Search for the optimum of a model with a proven gap.

    Args:
        model: Model of a cell or of some of its robots, as it was built.
        limits: When to end; `gap` is that in true energy.
        report: Is told the best energy and the bound whenever one of them changes.
    """

    def __init__(
        self,
        model: CellModel,
        limits: Limits,
        report: Callable[[Found], None] | None = None,
    ) -> None:
        self.model = model
        self.limits = limits
        self._report = report
        self.best = Found("unknown", None, None, 0.0)
        self.prices_w: dict[int, float] = {}

    def run(self, start: tuple[Selection, Timing] | None = None) -> Found:
        """Search until the gap is reached or the time is up.

        Args:
            start: Plan to start from.
        """
        if start is not None:
            self._better(*start)
        relaxed = cut_relaxation(self.model, self.limits)
        if relaxed.bound_j == INF:
            return replace(self.best, status="infeasible", bound_j=INF)
        self.prices_w = relaxed.prices_w
        self._bounded(relaxed.bound_j)
        add_price_tangents(self.model, self.prices_w)
        seen: set[object] = set()
        for _ in range(_ROUNDS):
            if self._done():
                break
            found = self.model.program.solve(
                replace(
                    self.limits, gap=_SHARE_OF_GAP * self.limits.gap, bounded=self._bounded, improved=self._improved
                ),
                start=self._start_values(),
            )
            if found.status == "infeasible":
                return replace(self.best, status="infeasible", bound_j=INF)
            self._bounded(found.bound)
            if found.values is None:
                break
            selection = selection_of(self.model, found.values)
            timing = self._times(selection)
            if timing is not None:
                self._better(selection, timing)
                self._add_tangents(selection, timing)
            if found.status != "optimal" or (selection.key in seen and self._missing(selection, found.values) <= 0.0):
                break
            seen.add(selection.key)
            self._add_solution_tangents(found.values)
        return replace(self.best, status=self._status())

    def _done(self) -> bool:
        stopped = self.limits.stop is not None and self.limits.stop()
        return stopped or monotonic() > self.limits.until or self._status() == "optimal"

    def _status(self) -> str:
        if self.best.timing is None:
            return "unknown"
        return (
            "optimal" if self.best.energy_j - self.best.bound_j <= self.limits.gap * self.best.energy_j else "feasible"
        )

    def _times(self, selection: Selection) -> Timing | None:
        limits = replace(self.limits, gap=1e-7, until=max(self.limits.until, monotonic() + 2.0), stop=None)
        return best_times(self.model.numbers, self.model.parts, selection, limits)

    def _better(self, selection: Selection, timing: Timing) -> None:
        if timing.energy_j < self.best.energy_j:
            self.best = replace(self.best, selection=selection, timing=timing)
            self._tell()

    def _bounded(self, bound_j: float) -> None:
        if self.best.bound_j < bound_j < INF:
            self.best = replace(self.best, bound_j=bound_j)
            self._tell()

    def _improved(self, values: Array, objective: float, bound: float) -> None:
        """A solution within the search: its choices make a plan at once, so that a stop loses nothing."""
        if self._report is None and self.limits.until == INF and self.limits.stop is None:
            return
        selection = selection_of(self.model, values)
        timing = self._times(selection)
        if timing is not None:
            self._better(selection, timing)

    def _tell(self) -> None:
        if self._report is not None:
            self._report(self.best)

    def _start_values(self) -> Array | None:
        if self.best.selection is None or self.best.timing is None:
            return None
        return self.model.values_of(self.best.selection, self.best.timing)

    def _add_tangents(self, selection: Selection, timing: Timing) -> None:
        for r, t in selection.movements.items():
            self.model.add_tangents(t, timing.times.moves_s[r])

    def _add_solution_tangents(self, values: Array) -> None:
        t = self.model.movements[values[self.model.y[self.model.movements]] > 0.5]
        self.model.add_tangents(
            t, np.clip(values[self.model.d[t]], self.model.numbers.d_min_s[t], self.model.numbers.d_max_s[t])
        )

    def _missing(self, selection: Selection, values: Array) -> float:
        """By how much the model's energy is below the true one at its solution, beyond what the gap allows. [J]"""
        n, t = self.model.numbers, np.concatenate(list(selection.movements.values()))
        at = np.clip(values[self.model.d[t]], n.d_min_s[t], n.d_max_s[t])
        missing = float((n.energies_j(t, at) - values[self.model.W[t]]).sum())
        return missing - 0.25 * self.limits.gap * self.best.energy_j
