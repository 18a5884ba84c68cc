"""Waits in standby: what they draw, and plans against brute force over speed limits and shares of the time left."""

import itertools

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.planning.batch import TreeBatch
from robojoule.planning.whole_speeds import speed_choices
from robojoule.robots import load_robot_file
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.robot_file import RobotFile
from robojoule.robots.standby import StandbyMode, standing_energy_j
from tests.core_cases import kr16
from tests.planning.trees import POINTS_DEG, busy_tree, tree

# Median of six KUKA arms of a Skoda cell: power over that of motors on, least idle times (CTU-IIG).
SKODA = {"brakes": {"power_w": 160.0, "least_idle_s": 2.0}, "bus_off": {"power_w": 110.0, "least_idle_s": 25.0}}
SOON = {"brakes": {"power_w": 200.0, "least_idle_s": 0.3}, "bus_off": {"power_w": 90.0, "least_idle_s": 0.9}}


def with_standby(standby):
    data = load_robot_file("kuka_kr16_r2010_2").model_dump(mode="json")
    return Robot(RobotFile.model_validate({**data, "standby": standby}), Payload(10.0))


def drawn_j(modes, power_w, time_s):
    """Energy of one wait, written apart from the library."""
    allowed = [power_w] + [mode["power_w"] for mode in modes.values() if time_s >= mode["least_idle_s"] - 1e-9]
    return min(allowed) * time_s


def test_a_wait_draws_the_least_that_its_length_allows():
    modes = (StandbyMode("brakes", 200.0, 0.3), StandbyMode("bus off", 90.0, 0.9))
    found = standing_energy_j(modes, np.full(6, 400.0), [0.0, 0.2, 0.3, 0.8, 0.9, 2.0])
    np.testing.assert_allclose(found, [0.0, 80.0, 60.0, 160.0, 81.0, 180.0])
    assert standing_energy_j(modes, 150.0, 0.5) == 75.0  # brakes would take more
    assert standing_energy_j((), 400.0, 10.0) == 4000.0


def test_a_simulated_cycle_joins_the_waits_of_a_standstill():
    """At the end and the start of a cycle that closes, and after one move and before the next."""
    robot = with_standby(SOON)
    waits = {"m0": {"wait_before_s": 0.2, "wait_after_s": 0.15}, "m1": {"wait_before_s": 0.2, "wait_after_s": 0.1}}
    last = tree().moves()[-1].name
    program = Program(tree().with_settings({**waits, last: {"wait_after_s": 0.8}}))
    run, held = rj.simulate(program, robot), rj.simulate(program, kr16())
    idle = TreeBatch(robot, [program.tree])
    p = [idle.idle_prior_w[0], idle.idle_post_w[0], idle.idle_post_w[1]]
    lengths = [1.0, 0.35, 0.1]
    saved = sum(power * t - drawn_j(SOON, power, t) for power, t in zip(p, lengths, strict=True))
    assert run.standby_saving_j == pytest.approx(saved, rel=1e-9)
    assert held.energy_j - run.energy_j == pytest.approx(saved, rel=1e-9)
    assert held.standby_saving_j == 0.0


def brute_force_j(robot, program, standby, cycle_s, step, share_s):
    """Least energy over speed limits and over shares of what is left among the standstills, in steps of time."""
    batch = TreeBatch(robot, [program.tree])
    limits = speed_choices(batch, step)
    tables = [batch.paths.simulate(np.tile(row, (batch.paths.motions, 1))) for row in limits]
    waits = [(m.wait_before_s, m.wait_after_s) for m in program.moves]
    need = [waits[0][0] + waits[-1][1], *(waits[v][1] + waits[v + 1][0] for v in range(len(waits) - 1))]
    powers = [batch.idle_prior_w[0], *batch.idle_post_w[:-1]]
    best = np.inf
    for options in itertools.product(*[range(len(row)) for row in limits]):
        took = sum(tables[i].duration_s[i, k] for i, k in enumerate(options))
        left = cycle_s - took - sum(need)
        if left < -1e-9:
            continue
        moved = sum(tables[i].energy_j[i, k] for i, k in enumerate(options))
        count = int(left / share_s)
        for parts in itertools.product(range(count + 1), repeat=len(need) - 1):
            if sum(parts) > count:
                continue
            for rest in range(len(need)):  # the place that gets what does not make a whole step, too
                shares = [share_s * part for part in (*parts[:rest], 0, *parts[rest:])]
                shares[rest] = left - sum(shares)
                times = [a + b for a, b in zip(need, shares, strict=True)]
                best = min(best, moved + sum(drawn_j(standby, p, t) for p, t in zip(powers, times, strict=True)))
    return best


@pytest.mark.parametrize("share", [1.0, 1.15, 1.5, 2.2])
@pytest.mark.parametrize("waits", [(0.0, 0.0), (0.25, 0.85), (0.28, 0.25)], ids=["none", "nearly off", "nearly braked"])
def test_no_other_speeds_and_waits_take_less(share, waits):
    """Thresholds and waits are multiples of the step of the brute force, so that it meets them exactly."""
    robot = with_standby(SOON)
    program = Program(
        tree(points=POINTS_DEG[:1]).with_settings({"m0": {"wait_after_s": waits[0]}, "m1": {"wait_after_s": waits[1]}})
    )
    cycle = share * float(TreeBatch(robot, [program.tree]).least_cycles_s[0])
    plan = rj.optimize(program, robot, cycle_time=cycle, speed_step=12.5)
    best = brute_force_j(robot, program, SOON, plan.cycle_time_s, 12.5, 0.01)
    assert plan.energy_j <= best * (1.0 + 3e-6)
    assert plan.bound_j <= best * (1.0 + 1e-9)
    assert plan.energy_j >= best * (1.0 - 2e-3)  # finer shares may be a little better


def test_several_waits_are_lengthened_until_the_brakes_close():
    """Each of four waits lacks 0.1 s: a plan that puts all time left into one place would miss three of them."""
    robot = with_standby({"brakes": {"power_w": 100.0, "least_idle_s": 2.0}})
    moves = tree(points=POINTS_DEG).moves()
    program = Program(tree().with_settings({move.name: {"wait_after_s": 1.9} for move in moves}))
    plan = rj.optimize(program, robot, cycle_time=rj.simulate(program, robot).cycle_time_s + 0.45)
    added = [move.added_wait_before_s + move.added_wait_after_s for move in plan.program.moves]
    assert sum(added) == pytest.approx(0.4, abs=1e-6)
    assert plan.run.standby_saving_j > 4 * 2.0 * 250.0


@pytest.mark.parametrize("standby", [SKODA, SOON], ids=["Skoda", "soon"])
@pytest.mark.parametrize("cycle", [4.5, 9.0, 40.0])
def test_savings_are_stated_against_such_a_controller_and_against_motors_on(standby, cycle):
    robot = with_standby(standby)
    plan, held = (rj.optimize(Program(busy_tree()), one, cycle_time=cycle) for one in (robot, kr16()))
    assert plan.energy_j <= held.energy_j * (1.0 + 1e-9)
    assert plan.energy_j <= plan.energy_given_j * (1.0 + 1e-9)
    assert plan.energy_given_motors_on_j == pytest.approx(held.energy_given_j, rel=1e-3)
    assert plan.saving_over_motors_on_percent >= plan.saving_percent - 1e-9
    assert plan.gap_to_optimum_percent <= 0.02
    assert held.saving_over_motors_on_percent == held.saving_percent
    again = rj.optimize(plan.program, robot, cycle_time=plan.cycle_time_s)
    assert again.program.tree == plan.program.tree
    data = plan.to_dict()
    assert data["saving_over_motors_on_percent"] == plan.saving_over_motors_on_percent


def test_with_standby_moves_are_faster_and_wait_longer():
    """A second of waiting is cheaper, so less of the cycle is worth moving slowly."""
    robot = with_standby({"brakes": {"power_w": 20.0, "least_idle_s": 0.5}})
    plan, held = (rj.optimize(Program(tree()), one, cycle_time="+150%") for one in (robot, kr16()))
    assert plan.run.durations_s.sum() < held.run.durations_s.sum() - 0.2
    assert plan.cycle_time_s == pytest.approx(held.cycle_time_s, abs=1e-3)


BAD = {
    "empty": ({}, "at least one of brakes and bus_off must be given"),
    "order of power": ({**SKODA, "bus_off": {"power_w": 170.0, "least_idle_s": 25.0}}, "bus_off.power_w is more than"),
    "order of times": ({**SKODA, "bus_off": {"power_w": 90.0, "least_idle_s": 1.0}}, "least_idle_s is less than"),
    "negative": ({"brakes": {"power_w": -1.0, "least_idle_s": 1.0}}, "greater than or equal to 0"),
}


@pytest.mark.parametrize("standby, message", BAD.values(), ids=BAD.keys())
def test_bad_sections_are_refused(tmp_path, standby, message):
    from robojoule.documents import load, write_document

    data = load_robot_file("kuka_kr16_r2010_2").model_dump(mode="json")
    write_document(tmp_path / "arm.json", {**data, "standby": standby})
    with pytest.raises(InputError, match=message):
        load(RobotFile, tmp_path / "arm.json")
