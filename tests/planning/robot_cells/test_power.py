"""Largest powers of cells of robots: what a limit leaves, and limits that only standby keeps."""

from dataclasses import replace
from time import monotonic

import pytest

from robojoule.errors import CycleTimeTooShort, PlanningError
from robojoule.planning.robot_cells.cell_model import CellWork
from robojoule.planning.robot_cells.power import keep_apart, least_standing_s
from robojoule.planning.robot_cells.solve import Search, plan_robot_cell
from robojoule.planning.robot_cells.speeds import whole_runs
from tests.planning.robot_cells.cases import LONG_S, three, work_of_three

WELDING_W = 1500.0
BRAKES_W, OFF_W = 70.0, 48.0  # of the welder, after 2 s and 25 s
OTHERS_W = 60.0 + 60.0  # the least at which the loader and the unloader stand


def welder(cycle_time_s=7.0, limit_w=None):
    one = replace(three().robots[1], alternatives={})
    return replace(three(), robots=(one,), handovers=(), zones=(), cycle_time_s=cycle_time_s, peak_power_w=limit_w)


def planned(cell):
    return plan_robot_cell(cell, time_limit_s=LONG_S, gap_percent=1.0)


def test_a_robot_stands_long_enough_for_the_mode_that_keeps_the_limit():
    """By hand: motors draw 263 W or more beside the weld, the brakes 70 W, and the controller off 48 W."""
    weld, work = "welder: to part (standing)", CellWork.of(welder(), 0.01)
    assert least_standing_s(work, WELDING_W + 280.0) == {}
    assert least_standing_s(work, WELDING_W + 250.0) == {weld: 2.0}
    assert least_standing_s(work, WELDING_W + BRAKES_W) == {weld: 2.0}
    assert least_standing_s(work, WELDING_W + BRAKES_W - 1.0) == {weld: 25.0}
    assert least_standing_s(work_of_three(), WELDING_W + BRAKES_W + OTHERS_W) == {weld: 2.0}
    assert least_standing_s(work_of_three(), WELDING_W + BRAKES_W + OTHERS_W - 1.0) == {weld: 25.0}


@pytest.mark.parametrize(("limit_w", "cycle_time_s"), [(1750.0, 7.0), (1571.0, 7.0), (1560.0, 35.0)])
def test_one_robot_keeps_a_limit_in_standby(limit_w, cycle_time_s):
    plan = planned(welder(cycle_time_s, limit_w))
    assert plan.run.violations == () and plan.run.peak_power_sum_w <= limit_w


def test_a_limit_that_is_named_as_the_least_is_planned_in_a_long_cycle_and_explained_in_a_short_one():
    limited = replace(three(), peak_power_w=1675.0)
    plan = planned(replace(limited, cycle_time_s=35.0))
    assert plan.run.violations == () and plan.run.peak_power_sum_w <= 1675.0
    assert plan.bound_j <= plan.energy_j
    with pytest.raises(CycleTimeTooShort, match="where peak_power_w lets robots stand in standby only") as raised:
        planned(limited)
    assert 25.0 < raised.value.minimum_s < 35.0
    with pytest.raises(CycleTimeTooShort, match="forced by robot welder, where peak_power_w lets"):
        planned(replace(three(), peak_power_w=1870.0, cycle_time_s=2.5))


def test_one_robot_that_exceeds_the_limit_has_nobody_to_be_kept_apart_from():
    work = CellWork.of(welder(), 0.01)
    search = Search(work, {}, LONG_S, 1.0)
    smooth = search._solve(work.cell_of(work.convex), LONG_S)
    with pytest.raises(PlanningError, match=r"keeps within 1000 W: activity .* draws .* W by itself"):
        keep_apart(work, whole_runs(work, smooth), smooth_in_whole_percents(search, smooth), 1000.0)


def smooth_in_whole_percents(search, smooth):
    return search._whole(smooth, monotonic() + LONG_S)[1]


@pytest.mark.parametrize("stop", [None, lambda: True], ids=["late", "stopped"])
def test_rounds_end_when_the_time_is_up(stop, monkeypatch):
    """A limit that takes several rounds: one more is begun only while there is time."""
    free = CellWork.of(three(), 0.01)
    search = Search(replace(free, cell=replace(three(), peak_power_w=1950.0)), {"stop": stop}, LONG_S, 1.0)
    smooth = search._solve(free.cell_of(free.convex), LONG_S)
    rounds = []
    solve = search._solve
    monkeypatch.setattr(search, "_solve", lambda *given, **also: rounds.append(given) or solve(*given, **also))
    runs = search._runs(smooth, wide=False)
    search.stopped_s = monotonic() - 100.0 if stop else search.stopped_s
    with pytest.raises(PlanningError, match="no plan was found that keeps within 1950 W"):
        search._within_power(runs, monotonic() - (0.0 if stop is None else -LONG_S))
    assert len(rounds) == 1
