"""The linear program under HiGHS: numbers of threads one after another in one process."""

import numpy as np
import pytest

from robojoule.planning.cells.linear import Limits, LinearModel
from robojoule.planning.cells.solve import solve_cell
from tests.planning.cells.cases import two_robots


def knapsack() -> LinearModel:
    """Of values 5, 4, 3 at weights 4, 3, 2 within 6 the best is 8."""
    program = LinearModel()
    columns = program.columns(3, 0.0, 1.0, [-5.0, -4.0, -3.0], integer=True)
    program.row(zip(columns.tolist(), [4.0, 3.0, 2.0], strict=True), upper=6.0)
    return program


@pytest.mark.parametrize("numbers", [(1, 2, 1), (2, 1, 2)])
def test_programs_with_other_numbers_of_threads_follow_each_other(numbers):
    for threads in numbers:
        found = knapsack().solve(Limits(threads=threads))
        assert found.status == "optimal" and found.objective == pytest.approx(-8.0)
        np.testing.assert_allclose(found.values, [1.0, 0.0, 1.0], atol=1e-6)


def test_cells_with_other_numbers_of_threads_follow_each_other():
    first, second, third = (solve_cell(two_robots(), threads=threads) for threads in (1, 2, 1))
    assert second.energy_j == pytest.approx(first.energy_j, rel=1e-4)
    assert third.steps == first.steps
