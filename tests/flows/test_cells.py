"""Seeds of a cell's search on Prefect's task runners."""

import pytest

from flows.cells import plan_cell
from robojoule.errors import InputError
from robojoule.planning.cells.annealing import compile_kernel
from robojoule.planning.cells.check import check_plan
from tests.planning.cells.cases import generated


def test_a_large_cell_is_planned_by_tasks(prefect_server: str):
    compile_kernel()  # takes longer than the search where it never ran before
    cell = generated(3, 0, (8, 10))  # larger than the model alone is used for
    plan = plan_cell(cell, time_limit_s=90.0, gap_percent=30.0, seeds=2, runner="processes")
    assert check_plan(cell, plan).feasible
    assert 0.0 < plan.bound_j <= plan.energy_j


def test_what_cannot_be_done_is_refused():
    with pytest.raises(InputError, match="task runner"):
        plan_cell(generated(3, 0, (8, 10)), runner="grid")
