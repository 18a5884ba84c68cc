"""Plans of one robot and of cells have the same figures by the same names."""

import json

import pytest

import robojoule as rj
from robojoule.planning.any_plan import AnyPlan
from robojoule.planning.cells.solve import solve_cell
from tests.planning.cells.cases import two_robots
from tests.planning.robot_cells.cases import EXAMPLES, plan_of_three


def single():
    program = rj.load_program(EXAMPLES / "cycle.yaml")
    return rj.optimize(program, rj.load_robot("kuka_kr16_r2010_2", payload_kg=10), cycle_time="+10%")


@pytest.mark.parametrize(
    "make", [single, lambda: solve_cell(two_robots()), plan_of_three], ids=["robot", "cell", "robots"]
)
def test_every_plan_is_a_plan(make):
    plan = make()
    assert isinstance(plan, AnyPlan)
    assert 0.0 < plan.bound_j <= plan.energy_j and plan.cycle_time_s > 0.0
    assert plan.gap_percent == pytest.approx(100.0 * (1.0 - plan.bound_j / plan.energy_j), abs=1e-9)
    told = json.loads(json.dumps(plan.to_dict(), allow_nan=False))
    assert told["energy_j"] == plan.energy_j and told["bound_j"] == plan.bound_j
