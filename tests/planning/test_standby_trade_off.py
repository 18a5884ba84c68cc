"""Energy over cycle time with waits in standby: against plans for single cycle times, and what it is made of."""

import numpy as np
import pytest

import robojoule as rj
from robojoule.formats.program import Program
from robojoule.planning.standby_trade_off import StandbyTradeOff
from tests.core_cases import kr16
from tests.planning.test_standby import SKODA, SOON, with_standby
from tests.planning.trees import POINTS_DEG, busy_tree, tree


@pytest.mark.parametrize("standby", [SKODA, SOON], ids=["Skoda", "soon"])
@pytest.mark.parametrize("cycle", [3.9, 4.5, 6.0, 9.0, 26.0, 40.0])
def test_plans_lie_on_the_curve(standby, cycle):
    """Plans keep to whole percents, so they may take a little more; none takes less than the bound."""
    robot = with_standby(standby)
    found = rj.pareto(Program(busy_tree()), robot).standby
    plan = rj.optimize(Program(busy_tree()), robot, cycle_time=cycle)
    place = int(np.searchsorted(found.cycle_times_s, cycle))
    if place == found.cycle_times_s.size:  # beyond the last bend all further time is waited in the deepest mode
        slope = min(mode.power_w for mode in robot.standby)
        low = high = found.energies_j[-1] + slope * (cycle - found.cycle_times_s[-1])
    else:
        low, high = np.sort(found.energies_j[place - 1 : place + 1])
    assert plan.energy_j >= min(low, found.bounds_j[max(place - 1, 0) :].min()) * (1.0 - 1e-3)
    assert plan.energy_j <= high * (1.0 + 2e-3)


def test_without_modes_there_is_none_and_motors_on_is_never_less():
    assert rj.pareto(Program(tree()), kr16()).standby is None
    found = rj.pareto(Program(tree()), with_standby(SOON))
    held = found.curve.energy_j(found.standby.cycle_times_s)
    assert (found.standby.energies_j <= held * (1.0 + 1e-9)).all()
    assert found.standby.energies_j[0] == pytest.approx(held[0], rel=1e-9)
    assert found.standby.energies_j[-1] < 0.9 * held[-1]
    assert found.standby.largest_gap < 2e-3
    data = found.to_dict()["standby"]
    assert data["best_energy_j"] == found.standby.energies_j.min()
    assert len(data["points"]) == found.standby.cycle_times_s.size


def test_several_waits_that_lack_a_little_are_made_long_enough():
    """Each of four waits lacks 0.1 s until the brakes close: as in the plan for such a cycle time."""
    robot = with_standby({"brakes": {"power_w": 100.0, "least_idle_s": 2.0}})
    program = Program(tree().with_settings({m.name: {"wait_after_s": 1.9} for m in tree(points=POINTS_DEG).moves()}))
    cycle = rj.simulate(program, robot).cycle_time_s + 0.45
    plan, found = rj.optimize(program, robot, cycle_time=cycle), rj.pareto(program, robot).standby
    place = int(np.searchsorted(found.cycle_times_s, cycle))
    assert plan.energy_j <= found.energies_j[place - 1] * (1.0 + 5e-3)
    assert found.energies_j[place - 1 : place + 1].min() <= plan.energy_j * (1.0 + 5e-3)


def test_a_curve_of_no_energy_has_no_gap():
    """By hand: where nothing draws energy, nothing is lost; elsewhere 2 J above 8 J are 20 %."""
    times = np.array([1.0, 2.0, 3.0])
    with np.errstate(all="raise"):
        assert StandbyTradeOff(times, np.zeros(3), np.zeros(3)).largest_gap == 0.0
        assert StandbyTradeOff(times, np.array([0.0, 10.0, 10.0]), np.array([0.0, 8.0, 9.0])).largest_gap == 0.2
