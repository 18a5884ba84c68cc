"""Plans of cells: the power of all robots over the cycle."""

import numpy as np
import pytest

from robojoule.planning.cells.plan import CellPlan, Step
from robojoule.planning.cells.solve import solve_cell
from tests.planning.cells.cases import two_robots


def step(robot, start_s, duration_s, power_w):
    return Step(robot, f"{robot}{start_s}", "m", None, start_s, duration_s, power_w * duration_s)


def test_the_power_integrates_to_the_energy():
    cell = two_robots()
    plan = solve_cell(cell)
    time, power = plan.powers_w()
    assert (time[0], time[-1]) == (0.0, cell.cycle_time_s)
    assert float(np.diff(time) @ power[:-1]) == pytest.approx(plan.energy_j, rel=1e-9)
    assert plan.largest_mean_power_w == power.max() == plan.to_dict()["largest_mean_power_w"]


def test_the_largest_power_is_that_of_robots_at_once():
    """By hand: r1 draws 1000 W from 9 s over the end of the cycle to 1 s, r2 500 W from 0.5 s to 4 s."""
    plan = CellPlan("c", 10.0, (step("r1", 9.0, 2.0, 1000.0), step("r2", 0.5, 3.5, 500.0)), "optimal", 0.0)
    time, power = plan.powers_w()
    assert time == pytest.approx([0.0, 0.5, 1.0, 4.0, 9.0, 10.0])
    assert power == pytest.approx([1000.0, 1500.0, 500.0, 0.0, 1000.0, 1000.0])
    assert plan.largest_mean_power_w == pytest.approx(1500.0)


def test_rounding_between_two_steps_is_no_overlap():
    """One step ends a hair after the next one begins, as searches leave it."""
    steps = (step("r1", 0.0, 2.0 + 1e-10, 1000.0), step("r1", 2.0, 8.0, 900.0))
    assert CellPlan("c", 10.0, steps, "optimal", 0.0).largest_mean_power_w == pytest.approx(1000.0)
