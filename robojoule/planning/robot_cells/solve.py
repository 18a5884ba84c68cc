"""Plans of cells of robots: the cell that they make up is solved, written into programs and simulated again."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from time import monotonic
from typing import Any, Literal, get_args

from robojoule.errors import CycleTimeTooShort, InputError, PlanningError, RobojouleError
from robojoule.formats.program import Program
from robojoule.formats.robot_cell import RobotCell
from robojoule.inputs import as_number, shown
from robojoule.planning.batch import SLOWEST_SPEED_LIMIT
from robojoule.planning.cells.plan import CellPlan
from robojoule.planning.cells.solve import solve_cell
from robojoule.planning.guard import Guard
from robojoule.planning.plan import waiting_until
from robojoule.planning.robot_cells.cell_model import CellWork
from robojoule.planning.robot_cells.cell_run import CellRun, simulate_cell
from robojoule.planning.robot_cells.plan import RobotCellPlan
from robojoule.planning.robot_cells.power import check_standing, keep_apart, least_standing_s, within_power
from robojoule.planning.robot_cells.shared_space import Pairs
from robojoule.planning.robot_cells.speeds import Runs, exact_runs, whole_runs
from robojoule.planning.robot_cells.timeline import Timeline
from robojoule.planning.robot_cells.written import written_programs
from robojoule.programs.cell import Cell
from robojoule.progress import Listener, telling

Source = Literal["simulated", "predicted"]
TIME_LIMIT_S = 60.0
GAP_PERCENT = 0.1
_SHARE_OF_SPEEDS = 0.6  # of the time, for the plan on continuous speeds
_SEARCH_SHARE = 0.2  # of the gap asked for that is left to each of the two searches
_LEAST_S, _AFTER_STOP_S = 2.0, 10.0  # for the plan in whole percents, whatever is left, and after a stop
NOT_WHOLE = "no plan in whole percents of speed was found in time: speed limits are exact, round none of them down"
_ROUNDING = 1e-6  # of the energy, by which a bound may be above it
_MOST_CUTS = 60  # rounds in which activities are kept apart for their power


def plan_robot_cell(
    cell: RobotCell,
    *,
    time_limit_s: float = TIME_LIMIT_S,
    gap_percent: float = GAP_PERCENT,
    threads: int = 1,
    seed: int = 0,
    profiles: Source = "simulated",
    progress: Listener | None = None,
    stop: Callable[[], bool] | None = None,
    executor: Executor | None = None,
    allow_overload_percent: float = 0.0,
) -> RobotCellPlan:
    """The plan of a cell of robots with the least energy that was found, simulated as it stands in the programs.

    Args:
        cell: The cell.
        time_limit_s: When the search ends with the best plan so far; profiles and geometry come before. [s]
        gap_percent: Proven gap at which it ends. [%]
        threads: Threads of the solver.
        seed: Of random choices; equal seeds give equal plans where no time limit cuts.
        profiles: Where energies of the search come from: simulated or predicted. The plan is simulated either way.
        progress: Hears how far the work is, see `robojoule.progress`, and whenever the best plan or the bound changes.
        stop: Is asked now and then whether the search shall end with the best plan so far.
        executor: See `robojoule.planning.cells.solve.solve_cell`.
        allow_overload_percent: By how much torques may exceed the peak limits. [%]

    Raises:
        InputError: An argument is out of range, a program cannot be planned, or the cell has no plan; says why.
        CycleTimeTooShort: The cycle time is too short; says for which robot or hand-overs, and the least feasible one.
        PlanningError: No plan was found in time.
    """
    if profiles not in get_args(Source):
        raise InputError(
            f"unknown source of profiles {shown(profiles)}", key="profiles", allowed="simulated, predicted"
        )
    guard = Guard.of(cell.peak_power_w, allow_overload_percent)
    robots = tuple(replace(one, robot=guard.bearing(one.robot)) for one in cell.robots)
    work = CellWork.of(replace(cell, robots=robots), SLOWEST_SPEED_LIMIT, profiles)
    if cell.peak_power_w is not None:
        check_standing(work, cell.peak_power_w)
    search = Search(
        work,
        {"threads": threads, "seed": seed, "stop": stop, "executor": executor},
        as_number(time_limit_s, "time_limit", least=0.01, most=1e7, unit="s"),
        as_number(gap_percent, "gap", least=0.0, most=100.0, unit="%"),
    )
    with telling(progress):
        found = search.run()
    if found.run.violations:
        raise PlanningError(f"the simulated plan of cell '{cell.name}' does not hold: {found.run.violations[0]}")
    return _told(found, cell, guard)


class Search:
    """The search for a plan of a cell.

    Args:
        work: The cell.
        settings: Of `solve_cell`.
        time_limit_s: When it ends. [s]
        gap_percent: Gap at which it ends. [%]
    """

    def __init__(
        self,
        work: CellWork,
        settings: dict[str, Any],
        time_limit_s: float = TIME_LIMIT_S,
        gap_percent: float = GAP_PERCENT,
    ) -> None:
        self.work, self.settings = work, settings
        self.time_limit_s, self.gap_percent = time_limit_s, gap_percent
        self.stopped_s = math.inf
        limit_w = work.cell.peak_power_w
        self.least_standing_s = least_standing_s(work, limit_w) if limit_w is not None else {}

    def run(self) -> RobotCellPlan:
        """Plan, write and simulate; the simulation says in `violations` what does not hold."""
        began = monotonic()
        smooth_cell = self.work.cell_of(self.work.convex, least_standing_s=self.least_standing_s)
        searching = monotonic()
        try:
            smooth = self._solve(smooth_cell, _SHARE_OF_SPEEDS * self.time_limit_s)
        except CycleTimeTooShort as error:
            if not self.least_standing_s:
                raise
            forced = f"{error.forced or 'by the cell'}, where peak_power_w lets robots stand in standby only"
            raise CycleTimeTooShort(error.requested_s, error.minimum_s, forced=forced) from None
        warnings: tuple[str, ...] = ()
        try:
            runs, plan = self._whole(smooth, searching + self.time_limit_s)
        except PlanningError:
            if self.work.cell.peak_power_w is not None:
                raise
            runs, plan, warnings = exact_runs(self.work, smooth), smooth, (NOT_WHOLE,)
        programs, starts = written_programs(self.work, runs, plan)
        run = simulate_cell(self.work.cell, programs, starts, self.work.arms)
        bound = self._bound_j(smooth, run)
        near = run.energy_j - bound <= 0.01 * self.gap_percent * run.energy_j
        given = [Timeline(one, _bare(one.program), 0.0, self.work.cell.cycle_time_s) for one in self.work.cell.robots]
        return RobotCellPlan(
            programs,
            run,
            "optimal" if near else "feasible",
            bound,
            sum(_waiting_j(line, self.work.cell.cycle_time_s) for line in given),
            self.work.profiles,
            monotonic() - began,
            warnings,
        )

    def _bound_j(self, smooth: CellPlan, run: CellRun) -> float:
        """Bound of every plan; one by predicted profiles may be above what the simulation gives."""
        bound = smooth.bound_j + self.work.process_j
        above = bound > run.energy_j * (1.0 + _ROUNDING)
        if above and self.work.profiles == "simulated" and not run.violations:
            problem = f"the simulated plan of cell '{self.work.cell.name}' takes {run.energy_j:.7g} J"
            raise PlanningError(f"{problem}, less than its bound of {bound:.7g} J")
        return min(bound, run.energy_j)

    def _solve(self, cell: Cell, seconds: float, *, explained: bool = True) -> CellPlan:
        settings = self.settings
        if self._stopped():  # the best plan so far still has to be written
            settings = {**settings, "stop": None}
            seconds = min(seconds, self.stopped_s + _AFTER_STOP_S - monotonic())
        gap = _SEARCH_SHARE * self.gap_percent
        seconds = max(seconds, _LEAST_S)
        return solve_cell(cell, time_limit_s=seconds, gap_percent=gap, explained=explained, **settings)

    def _stopped(self) -> bool:
        """Whether a stop was asked for; notes when."""
        stop = self.settings.get("stop")
        if stop is None or not stop():
            return False
        self.stopped_s = min(self.stopped_s, monotonic())
        return True

    def _late(self, until: float) -> bool:
        """Whether the time is up, also that after a stop."""
        return monotonic() > (min(until, self.stopped_s + _AFTER_STOP_S) if self._stopped() else until)

    def _whole(self, smooth: CellPlan, until: float) -> tuple[Runs, CellPlan]:
        """The plan in whole percents: near the one on continuous speeds, further away from it where that has none."""
        reason: RobojouleError | None = None
        for wide in (False, True):
            try:
                runs = self._runs(smooth, wide=wide)
            except InputError:
                if wide:
                    raise
                continue
            try:
                return runs, self._within_power(runs, until, explained=wide)
            except RobojouleError as error:
                reason = error
        raise PlanningError(f"no plan in whole percents of speed was found near the best one ({reason})") from reason

    def _runs(self, smooth: CellPlan, *, wide: bool) -> Runs:
        limit_w = self.work.cell.peak_power_w
        runs = whole_runs(self.work, smooth, wide=wide, slower=limit_w is not None)
        return runs if limit_w is None else within_power(self.work, runs, limit_w)

    def _within_power(self, runs: Runs, until: float, *, explained: bool = True) -> CellPlan:
        limit_w = self.work.cell.peak_power_w
        apart: Pairs = ()
        for _ in range(_MOST_CUTS):
            cell = self.work.cell_of(runs.variants, apart=apart, least_standing_s=self.least_standing_s)
            plan = self._solve(cell, until - monotonic(), explained=explained)
            more = () if limit_w is None else keep_apart(self.work, runs, plan, limit_w)
            if not more:
                return plan
            if self._late(until):
                break
            apart = (*apart, *more)
        raise PlanningError(f"no plan was found that keeps within {limit_w:g} W")


def _bare(program: Program) -> Program:
    return replace(program, tree=program.tree.without_plan())


def _waiting_j(line: Timeline, cycle_time_s: float) -> float:
    """Energy of a program as given that waits at its end. [J]"""
    return waiting_until(line.run, cycle_time_s, line.holding_w)


def _told(found: RobotCellPlan, cell: RobotCell, guard: Guard) -> RobotCellPlan:
    """The plan with its torques checked and everything to know about it."""
    programs, runs, warnings = [], [], [*found.warnings]
    for placed, program, run in zip(cell.robots, found.programs, found.run.runs, strict=True):
        judged, known = guard.judged(run, program, placed.program, placed.robot)
        programs.append(program)
        runs.append(judged)
        warnings += [f"{placed.name}: {warning}" for warning in (*placed.assumed, *known)]
    told: CellRun = replace(found.run, runs=tuple(runs))
    return replace(found, programs=tuple(programs), run=told, warnings=tuple(warnings))
