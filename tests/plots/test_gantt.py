"""The drawing of a cell's plan: power over time integrates to the energy, nothing runs over the end of the cycle."""

import numpy as np
import pytest

from robojoule.planning.cells.solve import solve_cell
from robojoule.plots.gantt import drawing_of, power_w
from tests.planning.cells.cases import two_robots


def test_the_power_integrates_to_the_energy():
    cell = two_robots()
    plan = solve_cell(cell)
    time, power = power_w(cell, plan)
    assert (time[0], time[-1]) == (0.0, cell.cycle_time_s)
    assert float(np.diff(time) @ power[:-1]) == pytest.approx(plan.energy_j, rel=1e-9)


def test_equal_plans_give_equal_drawings():
    cell = two_robots()
    plan = solve_cell(cell)
    assert drawing_of(cell, plan) == drawing_of(cell, plan)
