"""The drawing of a cell's plan: equal plans give equal bytes, nothing runs over the end of the cycle."""

from robojoule.planning.cells.solve import solve_cell
from robojoule.plots.gantt import drawing_of
from tests.planning.cells.cases import two_robots


def test_equal_plans_give_equal_drawings():
    cell = two_robots()
    plan = solve_cell(cell)
    assert drawing_of(cell, plan) == drawing_of(cell, plan)
