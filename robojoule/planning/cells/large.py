"""Search for cells that the model alone is too large for: anytime, from a first plan to better ones with a bound.

1. Every robot alone: prices of time, tours to start from, and a bound, the sum of their bounds.
2. Annealing from several seeds, longer and longer up to a first plan, each followed by the timing problem; the best few
   plans are kept.
3. Annealing from those plans and neighbourhoods of the best one, until all are exhausted or the time is up; in between,
   the bound is sharpened by prices of time lags and hand-overs, robot by robot (`robojoule.planning.cells.bounds`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from threading import Thread
from time import monotonic

import numpy as np

from robojoule.errors import PlanningError, require_package
from robojoule.planning.cells.annealing import compile_kernel
from robojoule.planning.cells.bounds import PricedRobots
from robojoule.planning.cells.constructive import LATE_S, Annealer, Single, plan_alone, timed
from robojoule.planning.cells.exact import Found
from robojoule.planning.cells.linear import INF, Limits
from robojoule.planning.cells.neighbourhoods import FEW_ROBOTS, SECONDS, Neighbourhood, Neighbourhoods
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.selection import Selection
from robojoule.planning.cells.timing import Timing
from robojoule.programs.cell import Cell

LEAST_ITERATIONS = 2000  # fewer are not worth a run
FEWEST_ITERATIONS, STATICS_OF_FEWEST = 20_000, 40  # of the first run: so many for each so many static activities
MOST_ITERATIONS = 8_000  # of the longest runs, for each static activity
ALONE_GAP, ALONE_S = 0.01, 6.0  # of the first plans of single robots
BOUND_GAP = 1e-4  # of their last ones
BOUND_S, RELAXATION_S = 60.0, 120.0
SHARE_OF_ANNEALING = 0.35  # of the time, at most
REHEAT_J = (60.0, 100.0, 30.0)
OFTEN, SELDOM = 4, 12  # turns with one neighbourhood: in cells of many robots they find less than annealing
KEPT = 4  # plans of different seeds that annealing goes on from
LEAST_GAIN_J = 0.01
_PATIENCE_S = 0.1
MOST_TURNS = 200  # after which nothing more is expected where all neighbourhoods are exhausted


@dataclass
class LargeSearch:
    """A search; `run` may be called once.

    Attributes:
        numbers: The cell.
        limits: When to end; `gap` is that in true energy.
        report: Is told the best energy and the bound whenever one of them changes.
        executor: Runs seeds of the annealing beside each other; none: one after another.
        workers: How many of them at once.
    """

    numbers: Numbering
    limits: Limits
    report: Callable[[Found], None] | None = None
    executor: Executor | None = None
    workers: int = 1
    best: Found = field(init=False, default_factory=lambda: Found("unknown", None, None, 0.0))
    kept: list[tuple[Selection, Timing]] = field(init=False, default_factory=list)  # the best of each seed, best first
    pace_s: float = field(init=False, default=0.0)  # what an iteration of annealing took last

    def run(self) -> Found:
        """Search until the gap is reached, nothing more is known to be tried, or the time is up."""
        require_package("numba", "cells", "a cell of this size")
        began = monotonic()
        compiling = Thread(target=compile_kernel, daemon=True)
        compiling.start()
        singles = []
        for r in range(self.numbers.robots):
            single = plan_alone(self.numbers, r, replace(self.limits, gap=ALONE_GAP), ALONE_S)
            if single.found.status == "infeasible":
                return replace(self.best, status="infeasible", bound_j=INF)
            singles.append(single)
        self._bounded(sum(single.found.bound_j for single in singles))
        while compiling.is_alive() and not self._done():  # a search without time does not wait for the compiler
            compiling.join(_PATIENCE_S)
        if not compiling.is_alive() and all(single.found.selection is not None for single in singles):
            annealer = Annealer(self.numbers, singles)
            self._anneal(annealer, began)
        if self.best.selection is not None:
            self._improve(singles, annealer)
        return replace(self.best, status=self._status())

    def _anneal(self, annealer: Annealer, began: float) -> None:
        """Runs from different seeds, doubled in length while none gave a plan, then long ones while time lasts."""
        until = began + SHARE_OF_ANNEALING * (self.limits.until - began)
        iterations = FEWEST_ITERATIONS * max(self.numbers.statics // STATICS_OF_FEWEST, 1)
        seed = self.limits.seed * 1000
        while not self._done() and (self.best.selection is None or monotonic() < until):
            iterations = self._affordable(iterations)
            if iterations < LEAST_ITERATIONS:
                break
            for selection in self._runs(annealer, iterations, seed):
                timing = timed(self.numbers, selection, self._within(10.0, 1e-3))
                if timing is not None and timing.late_s <= LATE_S:
                    self._better(selection, timing)
                    self._keep(selection, timing)
                if self._done():
                    break
            seed += self.workers
            longer = 2 * iterations if self.best.selection is None else self._most_iterations
            iterations = min(longer, self._most_iterations)

    def _runs(self, annealer: Annealer, iterations: int, seed: int) -> Iterable[Selection]:
        seeds = range(seed, seed + self.workers)
        if self.executor is None:
            for one in seeds:
                with self._paced(iterations):
                    selection = annealer.run(iterations, one, self._done)
                yield selection
            return
        run: Callable[[int], Selection]
        if isinstance(self.executor, ThreadPoolExecutor):  # nothing has to be made anew, and a stop is heard
            run = partial(annealer.run, iterations, stop=self._done)
        else:
            run = _Run(self.numbers.cell, annealer.singles, iterations)
        with self._paced(iterations):
            found = list(self.executor.map(run, seeds))
        yield from found

    @property
    def _most_iterations(self) -> int:
        return max(MOST_ITERATIONS * self.numbers.statics, FEWEST_ITERATIONS)

    def _affordable(self, iterations: int) -> int:
        """As many iterations as the time lasts for, so that a run of them cools to its end."""
        left_s = max(self.limits.until - monotonic(), 0.0)
        return iterations if self.pace_s * iterations <= left_s else int(left_s / self.pace_s)

    @contextmanager
    def _paced(self, iterations: int) -> Iterator[None]:
        began = monotonic()
        yield
        self.pace_s = (monotonic() - began) / iterations

    def _improve(self, singles: list[Single], annealer: Annealer) -> None:
        """Neighbourhoods, with runs of annealing from the plan and bounds of single robots in between."""
        near = Neighbourhoods(self.numbers)
        rng, exhausted = np.random.default_rng(self.limits.seed), set[Neighbourhood]()
        tasks = self._bounds(singles)
        every = OFTEN if self.numbers.robots <= FEW_ROBOTS else SELDOM
        turn = 0
        while not self._done():
            turn += 1
            around = near.draw(rng, exhausted)
            selection, timing = self._plan()
            if turn % 3 == 1 and next(tasks, None) is not None:
                continue
            if turn % every != every - 1 or around is None:
                if self._affordable(self._most_iterations) < LEAST_ITERATIONS:
                    break
                if self._reheat(annealer, turn):
                    exhausted.clear()
                elif around is None and turn > MOST_TURNS:
                    break
                continue
            found = near.search(around, selection, timing, self._within(SECONDS, 0.0))
            if found is None:
                exhausted.add(around)
            else:
                self._better(*found)
                self._keep(*found, 0)
                exhausted.clear()

    def _reheat(self, annealer: Annealer, turn: int) -> bool:
        """A run of annealing from the best plan or, every other time, another one; whether there is a better plan."""
        parent = 0 if turn % 2 else (turn // 2) % len(self.kept)
        selection, timing = self.kept[parent]
        iterations = self._affordable(self._most_iterations)
        with self._paced(iterations):
            hot = REHEAT_J[turn % len(REHEAT_J)]
            found = annealer.rerun(selection, timing, iterations, self.limits.seed * 1000 + turn, hot, self._done)
        times = timed(self.numbers, found, self._within(10.0, 1e-3))
        if times is None or times.late_s > LATE_S or times.energy_j >= timing.energy_j - LEAST_GAIN_J:
            return False
        before_j = self.best.energy_j
        self._better(found, times)
        self._keep(found, times, parent)
        return self.best.energy_j < before_j

    def _keep(self, selection: Selection, timing: Timing, parent: int | None = None) -> None:
        """Keep a plan among the best ones, in place of the one that it was made from."""
        if parent is not None:
            del self.kept[parent]
        if all(selection.key != other.key for other, _ in self.kept):
            self.kept.append((selection, timing))
        self.kept.sort(key=lambda plan: plan[1].energy_j)
        del self.kept[KEPT:]

    def _bounds(self, singles: list[Single]) -> Iterator[int]:
        """Sharpen the bound: the joint relaxation, then robot by robot at its prices, the loosest first."""
        priced = PricedRobots(self.numbers)
        relaxed_j, prices = priced.relax(self._within(RELAXATION_S, 0.0))
        self._bounded(relaxed_j)
        priced.price(prices, self._within(RELAXATION_S, 0.0))
        self._bounded(priced.bound_j)
        yield -1
        gaps = {r: single.found.energy_j - single.found.bound_j for r, single in enumerate(singles)}
        for r in sorted(gaps, key=lambda r: -gaps[r]):
            priced.solve(r, self._within(BOUND_S, 0.0), BOUND_GAP * singles[r].found.energy_j)
            self._bounded(priced.bound_j)
            yield r

    def _plan(self) -> tuple[Selection, Timing]:
        if self.best.selection is None or self.best.timing is None:
            raise PlanningError("there is no plan to start from")
        return self.best.selection, self.best.timing

    def _within(self, seconds: float, gap: float) -> Limits:
        return replace(self.limits, until=min(monotonic() + seconds, self.limits.until), gap=gap)

    def _done(self) -> bool:
        stopped = self.limits.stop is not None and self.limits.stop()
        return stopped or monotonic() > self.limits.until or self._status() == "optimal"

    def _status(self) -> str:
        if self.best.timing is None:
            return "unknown"
        close = self.best.energy_j - self.best.bound_j <= self.limits.gap * self.best.energy_j
        return "optimal" if close else "feasible"

    def _better(self, selection: Selection, timing: Timing) -> None:
        if timing.energy_j < self.best.energy_j:
            self.best = replace(self.best, selection=selection, timing=timing)
            self._tell()

    def _bounded(self, bound: float) -> None:
        if self.best.bound_j < bound < INF:
            self.best = replace(self.best, bound_j=bound)
            self._tell()

    def _tell(self) -> None:
        if self.report is not None:
            self.report(self.best)


@dataclass(frozen=True)
class _Run:
    """One annealing run as a task for another process."""

    cell: Cell
    singles: tuple[Single, ...]
    iterations: int

    def __call__(self, seed: int) -> Selection:
        return Annealer(Numbering(self.cell), self.singles).run(self.iterations, seed)
