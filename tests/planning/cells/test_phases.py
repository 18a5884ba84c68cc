"""Long time lags: a robot may start whole cycles later, so the optimum is that of the lag less whole cycles."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pyomo.contrib.solver.common.factory import SolverFactory

from robojoule.planning.cells.exact import ExactSearch
from robojoule.planning.cells.linear import Limits
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.phases import phase_bounds_s, reach_s
from robojoule.planning.cells.reference import build_model
from robojoule.planning.cells.solve import solve_cell
from robojoule.programs.cell import TimeLag
from tests.planning.cells.brute_force import optimum_j
from tests.planning.cells.cases import generated, two_robots

CT = 9.0
SHORT_S = 2.5


def with_lag(length_s, cycles=0, first="a1", second="b1"):
    """Two robots with collisions and one lag between them."""
    return replace(two_robots(CT), lags=(TimeLag(first, second, length_s, cycles),))


@pytest.fixture(scope="module")
def least_j():
    return optimum_j(with_lag(SHORT_S))


@pytest.mark.parametrize(
    ("length_s", "cycles"),
    [(SHORT_S + n * CT, m) for n, m in ((1, 0), (2, 0), (3, 0), (39, 0), (4, 2), (0, -3), (900, 900), (-5, 0))],
)
def test_a_long_lag_has_the_optimum_of_a_short_one(length_s, cycles, least_j):
    plan = solve_cell(with_lag(length_s, cycles), gap_percent=1e-4)
    assert plan.status == "optimal"
    assert plan.energy_j == pytest.approx(least_j, rel=2e-6)


@pytest.mark.parametrize("cycles", [2, 3, 39])
def test_so_have_the_models_alone(cycles, least_j):
    cell = with_lag(SHORT_S + cycles * CT)
    found = ExactSearch(CellModel(Numbering(cell)), Limits(gap=1e-6)).run()
    assert found.bound_j <= least_j * (1.0 + 1e-6)
    solver = SolverFactory("highs")
    solver.config.rel_gap = 1e-7
    short, long = (solver.solve(build_model(one, 4)).incumbent_objective for one in (with_lag(SHORT_S), cell))
    assert long == pytest.approx(short, rel=1e-6)


def test_a_lag_of_an_activity_that_may_be_left_out_likewise():
    """a0>a1 is done in one order only: where it is not, the lag holds nothing back, however long it is."""
    energies = [
        solve_cell(with_lag(length, 0, "a0>a1", "b1"), gap_percent=1e-4).energy_j for length in (2.5, 2.5 + 40 * CT)
    ]
    assert energies[1] == pytest.approx(energies[0], rel=2e-6)


def test_lags_from_robot_to_robot_add_up():
    """Three robots in a row, each some cycles after the one before."""
    cell = generated(3, 6, (3, 4))
    first = [robot.last for robot in cell.robots]
    least = cell.cycle_time_s

    def chain(cycles):
        lags = [TimeLag(a, b, 0.3 * least + cycles * least, 0) for a, b in pairwise(first)]
        return replace(cell, lags=tuple(lags))

    energies = [solve_cell(chain(cycles), gap_percent=1e-3).energy_j for cycles in (0, 7)]
    assert energies[1] == pytest.approx(energies[0], rel=2e-5)


def test_short_lags_leave_the_range_at_one_cycle_for_each_robot():
    numbers = Numbering(two_robots(CT))
    assert reach_s(numbers, []) == 2 * CT
    assert reach_s(numbers, numbers.lags) == 2 * CT
    low, high = phase_bounds_s(numbers, range(2), Numbering(with_lag(350.0)).lags)
    assert low[0] == high[0] == 0.0
    assert 350.0 - CT <= low[1] < high[1] <= 350.0 + 2 * CT
    assert np.isfinite([low, high]).all()
