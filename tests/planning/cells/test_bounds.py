"""Bounds of robots that pay for time lags and hand-overs: below proven optima at whatever prices, and close to them."""

from dataclasses import replace
from functools import cache
from time import monotonic

import numpy as np
import pytest

from robojoule.planning.cells.bounds import PricedRobots
from robojoule.planning.cells.constructive import plan_alone
from robojoule.planning.cells.linear import INF, Limits, LinearModel
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.solve import solve_cell
from robojoule.programs.cell import TimeLag
from tests.planning.cells.brute_force import optimum_j
from tests.planning.cells.cases import free_of_charge, generated, two_robots
from tests.planning.cells.test_phases import with_lag

CELLS = [(2, 0, (4, 6)), (2, 1, (4, 6)), (3, 6, (3, 4))]


@cache
def best(robots, seed, activities):
    return solve_cell(generated(robots, seed, activities), gap_percent=1e-3)


def priced(cell, prices=None, *, integers=True):
    robots = PricedRobots(Numbering(cell))
    _, duals = robots.relax(Limits())
    robots.price(duals if prices is None else prices(robots, duals), Limits())
    if integers:
        for r in robots.bounds_j:
            robots.solve(r, Limits(until=monotonic() + 3.0), 1e-4 * abs(robots.bound_j))
    return robots


@pytest.mark.parametrize("given", CELLS, ids=str)
def test_the_bound_is_below_the_proven_optimum_and_above_that_of_robots_alone(given):
    numbers = Numbering(generated(*given))
    assert numbers.handovers and numbers.lags
    alone = sum(plan_alone(numbers, r, Limits(gap=1e-6), 60.0).found.bound_j for r in range(numbers.robots))
    robots = PricedRobots(numbers)
    relaxed, prices = robots.relax(Limits())
    assert np.abs(prices).max() > 0.0
    robots.price(prices, Limits())
    before = robots.bound_j
    assert before == pytest.approx(relaxed, rel=6e-4)  # the duals of a linear program lose nothing but for tangents
    for r in robots.bounds_j:
        robots.solve(r, Limits(), 1e-6 * relaxed)
        assert robots.bound_j >= before - 1e-9
        before = robots.bound_j
    plan = best(*given)
    assert max(relaxed, robots.bound_j) <= plan.energy_j * (1.0 + 1e-7)
    # Half of what robots alone miss, or, where they miss nothing, what tangents may lose: this project's own figures.
    assert robots.bound_j >= alone + 0.5 * (plan.energy_j - alone) - 2e-5 * plan.energy_j


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("given", CELLS, ids=str)
def test_it_is_one_at_any_prices(given, seed):
    """Prices at random, of both signs, small and large: those of the wrong sign count as none."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.integers(-1, 4)
    robots = priced(generated(*given), lambda _, duals: rng.normal(0.0, size, duals.size), integers=seed == 0)
    assert -INF < robots.bound_j <= best(*given).energy_j * (1.0 + 1e-7)


@pytest.mark.parametrize("cell", [two_robots(9.0), with_lag(353.5)], ids=["9 s", "long lag"])
def test_it_is_below_the_optimum_by_trying_everything(cell):
    assert priced(cell).bound_j <= optimum_j(cell if cell.lags[0].length_s < 300.0 else with_lag(2.5)) * (1.0 + 1e-9)


def test_without_prices_it_is_that_of_robots_alone():
    numbers = Numbering(generated(*CELLS[0]))
    alone = sum(plan_alone(numbers, r, Limits(gap=1e-6), 60.0).found.bound_j for r in range(numbers.robots))
    robots = priced(numbers.cell, lambda _, duals: 0.0 * duals)
    assert robots.bound_j == pytest.approx(alone, rel=1e-4)


def test_a_stopped_relaxation_gives_no_prices_and_no_false_bound():
    robots = PricedRobots(Numbering(generated(*CELLS[0])))
    relaxed, prices = robots.relax(Limits(stop=lambda: True))
    robots.price(prices, Limits(stop=lambda: True))
    assert relaxed == robots.bound_j == -INF and not np.any(prices)


def test_robots_that_cost_nothing_have_a_bound():
    """The tolerance of such a robot, a share of its energy, is zero, too."""
    robots = PricedRobots(Numbering(free_of_charge()))
    robots.price(robots.relax(Limits())[1], Limits())
    for r in robots.bounds_j:
        robots.solve(r, Limits(), 0.0)
    assert robots.bound_j == pytest.approx(0.0, abs=1e-9)


def test_rows_are_paid_for_by_their_prices():
    """By hand: min x + y with x + y >= 2 and x - y <= 1, at prices 0.5 and -0.25."""
    program = LinearModel()
    columns = program.columns(2, 0.0, INF, 1.0).tolist()
    rows = [program.row(zip(columns, (1.0, 1.0), strict=True), lower=2.0)]
    rows.append(program.row(zip(columns, (1.0, -1.0), strict=True), upper=1.0))
    cost, constant = program.priced(rows, [0.5, -0.25])
    assert cost.tolist() == [1.0 - 0.5 + 0.25, 1.0 - 0.5 - 0.25] and constant == 0.5 * 2.0 - 0.25
    cost, constant = program.priced(rows, [-0.5, 0.25])  # of the wrong sign
    assert cost.tolist() == [1.0, 1.0] and constant == 0.0


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_random_lags_over_several_cycles_keep_it_below_and_whole_cycles_change_nothing(seed):
    """Robots that start whole cycles earlier or later, with their lags, have the same optimum; some cost nothing."""
    rng = np.random.default_rng(seed)
    cell = generated(2, 40 + seed, (2, 4))
    ends = [[one.name for one in (*robot.static, *robot.dynamic)] for robot in cell.robots]
    lags = list(cell.lags)
    for _ in range(3):
        first, second = rng.permutation(2).tolist()
        length = float(rng.uniform(-2.0, 4.0)) * cell.cycle_time_s
        cycles = int(np.ceil(length / cell.cycle_time_s)) + int(rng.integers(0, 2))
        lags.append(TimeLag(str(rng.choice(ends[first])), str(rng.choice(ends[second])), length, cycles))
    cell = replace(cell, lags=tuple(lags), cycle_time_s=1.3 * cell.cycle_time_s)
    optimum = solve_cell(cell, gap_percent=1e-4)
    assert optimum.status == "optimal"
    assert priced(cell).bound_j <= optimum.energy_j * (1.0 + 1e-7)
    owner = cell.robot_of
    by = {robot.name: int(cycles) for robot, cycles in zip(cell.robots, rng.integers(-3, 9, 2), strict=True)}
    moved = tuple(replace(lag, cycles=lag.cycles + by[owner[lag.first]] - by[owner[lag.second]]) for lag in cell.lags)
    assert solve_cell(replace(cell, lags=moved), gap_percent=1e-4).energy_j == pytest.approx(optimum.energy_j, rel=3e-6)
