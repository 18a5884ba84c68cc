"""The direct model, the one in Pyomo and trying everything agree; energies are true and bounds hold."""

import numpy as np
import pytest
from pyomo.contrib.solver.common.factory import SolverFactory

from robojoule.planning.cells.exact import ExactSearch
from robojoule.planning.cells.linear import Limits
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.numbering import Numbering
from robojoule.planning.cells.reference import build_model
from robojoule.planning.cells.solve import solve_cell
from tests.planning.cells.brute_force import optimum_j
from tests.planning.cells.cases import generated, two_robots

TANGENTS = 4


@pytest.mark.parametrize("cycle_time_s", [7.0, 9.0])
def test_the_optimum_is_that_of_trying_everything(cycle_time_s):
    cell = two_robots(cycle_time_s)
    plan = solve_cell(cell, gap_percent=1e-4)
    best = optimum_j(cell)
    assert plan.status == "optimal"
    assert plan.energy_j == pytest.approx(best, rel=2e-6)
    assert plan.bound_j <= best * (1.0 + 1e-9)


def direct_j(cell):
    """Optimum of the direct model with the reference's tangents."""
    numbers = Numbering(cell)
    model = CellModel(numbers)
    for share in np.linspace(0.0, 1.0, TANGENTS):
        at = numbers.d_min_s + share * (numbers.d_max_s - numbers.d_min_s)
        model.add_tangents(model.movements, at[model.movements])
    return model.program.solve(Limits(gap=1e-7)).objective


@pytest.mark.parametrize(
    "cell",
    [two_robots(9.0), two_robots(7.0), generated(2, 1, (4, 6)), generated(2, 4, (3, 5)), generated(3, 6, (3, 4))],
    ids=lambda cell: f"{cell.name} {cell.cycle_time_s:g}",
)
def test_both_models_have_the_same_optimum(cell):
    solver = SolverFactory("highs")
    solver.config.rel_gap = 1e-7
    found = solver.solve(build_model(cell, TANGENTS))
    assert direct_j(cell) == pytest.approx(found.incumbent_objective, rel=1e-6)


def test_the_relaxation_is_tight():
    """The figure is this project's own: within 3 % of the optimum, as the published big constants never are."""
    cell = two_robots()
    search = ExactSearch(CellModel(Numbering(cell)), Limits(gap=1e-4))
    bounds = []
    search._report = lambda found: bounds.append(found.bound_j)
    best = search.run().energy_j
    assert 0.97 * best < bounds[0] < best
    assert bounds == sorted(bounds)
