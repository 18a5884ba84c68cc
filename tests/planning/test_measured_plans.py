"""Plans on measured runs, through the door: they hold on the machine whose runs were measured."""

from dataclasses import replace

import numpy as np
import pytest

import robojoule as rj
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.formats.program import WAIT_STEP_S
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots.robot_file import RobotFile
from tests.calibration.machines import by_a_stopwatch, closed_cycle, joint_controller, observed

ASKED = 1.4  # of the machine's least cycle time


@pytest.fixture(scope="module")
def case():
    paths, points = closed_cycle(seed=9, moves=8)
    program = rj.Program(tree_from_configurations("cell", points))
    machine = joint_controller(paths.robot, exponent=1.0)
    return paths, program, machine, ASKED * paths.with_controller(machine).durations([1.0]).sum()


def executed(paths, machine, plan):
    """Cycle time and energy of a plan on the machine, its waits as written."""
    runs = paths.with_controller(machine).simulate(plan.run.speed_limits[:, None])
    waits = plan.run.prior_waits_s + plan.run.post_waits_s
    return float(runs.duration_s.sum() + waits.sum()), float(runs.energy_j.sum())


def test_a_plan_on_runs_holds_where_the_nominal_one_is_late(case):
    paths, program, machine, asked = case
    nominal = rj.optimize(program, paths.robot, cycle_time=asked)
    assert executed(paths, machine, nominal)[0] > 1.05 * asked
    runs = observed(paths, machine, (1.0, 0.3), noise=0.02)
    plan = rj.optimize(program, paths.robot, cycle_time=asked, runs=runs)
    assert plan.profiles == "measured"
    assert plan.bound_j < plan.energy_j  # by the profiles: what the choice leaves open
    assert plan.gap_to_optimum_percent < 0.02
    assert asked - WAIT_STEP_S * len(plan.moves) <= plan.cycle_time_s <= asked + 1e-9
    assert executed(paths, machine, plan)[0] == pytest.approx(asked, rel=2e-3)
    assert plan.outlook.rule.startswith("joint_accelerations")
    assert plan.outlook.saving_low_percent < plan.saving_percent < plan.outlook.saving_high_percent
    whole = 100.0 * plan.run.speed_limits
    assert whole == pytest.approx(np.round(whole), abs=1e-9)


def test_a_reserve_is_a_wait_at_the_end_and_makes_lateness_unlikely(case):
    paths, program, machine, asked = case
    runs = observed(paths, machine, (1.0, 0.3), noise=0.02)
    plan = rj.optimize(program, paths.robot, cycle_time=asked, runs=runs, reserve="1%")
    assert plan.reserve_s == pytest.approx(0.01 * asked)
    assert plan.moves[-1].wait_after_s >= plan.reserve_s - WAIT_STEP_S
    assert plan.outlook.late_probability < 0.05
    assert asked - WAIT_STEP_S * len(plan.moves) <= plan.cycle_time_s <= asked + 1e-9


def test_one_speed_alone_is_refused_with_the_one_that_is_missing(case):
    paths, program, machine, asked = case
    with pytest.raises(InputError, match=r"all runs have one speed limit.*runs with all moves at \d+ % as well"):
        rj.optimize(program, paths.robot, cycle_time=asked, runs=observed(paths, machine, (1.0,)))


def test_measured_profiles_want_every_move_and_predicted_ones_do_not(case):
    paths, program, machine, asked = case
    runs = observed(paths, machine, (1.0, 0.3), noise=0.02)
    known = runs.motion != 5
    few = MeasuredRuns(
        "few.csv",
        runs.motion[known],
        runs.speed_limits[known],
        runs.duration_s[known],
        runs.energy_j[known],
        runs.resolution_s,
    )
    with pytest.raises(InputError, match="move 'move-6' has no run"):
        rj.optimize(program, paths.robot, cycle_time=asked, runs=few)
    plan = rj.optimize(program, paths.robot, cycle_time=asked, runs=few, profiles="predicted")
    assert executed(paths, machine, plan)[0] == pytest.approx(asked, rel=0.01)


def test_simulated_profiles_take_the_timing_of_the_runs(case):
    paths, program, machine, asked = case
    runs = observed(paths, machine, (1.0, 0.3), energies=False)
    plan = rj.optimize(program, paths.robot, cycle_time=asked, runs=runs, profiles="simulated")
    assert executed(paths, machine, plan)[0] == pytest.approx(asked, rel=5e-3)
    assert 0.0 < plan.outlook.late_probability < 1.0
    assert plan.outlook.saving_low_percent is None


def test_a_cycle_that_the_machine_cannot_keep_is_refused_with_the_least_one(case):
    paths, program, machine, asked = case
    runs = observed(paths, machine, (1.0, 0.3))
    with pytest.raises(CycleTimeTooShort) as error:
        rj.optimize(program, paths.robot, cycle_time=asked / ASKED * 0.97, runs=runs)
    assert error.value.minimum_s == pytest.approx(asked / ASKED, rel=2e-3)


def test_the_trade_off_on_runs_is_that_of_the_plans_on_them(case):
    paths, program, machine, asked = case
    runs = observed(paths, machine, (1.0, 0.3), noise=0.02)
    found = rj.pareto(program, paths.robot, runs=runs)
    plan = rj.optimize(program, paths.robot, cycle_time=asked, runs=runs)
    fastest = paths.with_controller(machine).durations([1.0]).sum()
    assert found.curve.cycle_times_s[0] == pytest.approx(fastest, rel=2e-3)
    assert float(found.curve.energy_j(asked)) <= plan.energy_j * (1.0 + 1e-4)
    assert float(found.curve.energy_j(asked)) == pytest.approx(plan.energy_j, rel=2e-3)
    cautious = rj.pareto(program, paths.robot, runs=runs, cautious=True)
    assert float(cautious.curve.energy_j(asked)) > float(found.curve.energy_j(asked))


def test_the_trade_off_on_predicted_profiles_is_near_the_simulated_one(case):
    paths, program, _, _ = case
    simulated, predicted = (rj.pareto(program, paths.robot, profiles=kind) for kind in ("simulated", "predicted"))
    times = simulated.curve.cycle_times_s[0] * np.array([1.1, 1.5])
    assert predicted.curve.energy_j(times) == pytest.approx(simulated.curve.energy_j(times), rel=0.05)


def test_limits_of_the_program_are_kept(case):
    paths, program, machine, asked = case
    tree = program.tree.with_plan({"move-2": 40.0})
    runs = observed(paths, machine, (1.0, 0.3), noise=0.02)
    plan = rj.optimize(rj.Program(tree), paths.robot, cycle_time=1.2 * asked, runs=runs)
    assert plan.moves[1].speed_limit_percent <= 40.0


def test_plans_on_runs_use_standby_modes(case):
    """Against the same plans without them: waits are bought where they are cheap, and told at what they cost."""
    paths, program, machine, asked = case
    standby = {"brakes": {"power_w": 60.0, "least_idle_s": 0.5}}
    data = paths.robot.file.model_dump(mode="json")
    robot = rj.Robot(RobotFile.model_validate({**data, "standby": standby}), paths.robot.payload)
    runs = observed(paths, machine, (1.0, 0.3))
    held, plan = (rj.optimize(program, one, cycle_time=1.3 * asked, runs=runs) for one in (paths.robot, robot))
    assert plan.cycle_time_s == pytest.approx(held.cycle_time_s, abs=WAIT_STEP_S * len(plan.moves))
    waits = plan.run.prior_waits_s + plan.run.post_waits_s
    assert waits.max() > 0.5 > (held.run.prior_waits_s + held.run.post_waits_s).max() - 1e-9
    assert plan.energy_j < 0.99 * held.energy_j
    moved = executed(paths, machine, plan)[1]
    long = waits >= 0.5 - 1e-9
    drawn = moved + 60.0 * waits[long].sum() + (paths.idle_power_end_w * waits)[~long].sum()
    assert plan.energy_j == pytest.approx(drawn, rel=0.02)
    assert plan.energy_given_motors_on_j == pytest.approx(
        held.energy_given_j, rel=1e-4
    )  # cycles differ by a part of 1 ms
    assert plan.run.standby_saving_j > 0.5 * float(waits[long].sum()) * (400.0 - 60.0)
    assert plan.outlook.saving_low_percent < plan.saving_percent < plan.outlook.saving_high_percent


@pytest.mark.parametrize("standby", [{}, {"standby": {"brakes": {"power_w": 60.0, "least_idle_s": 0.5}}}])
def test_the_bound_of_a_cautious_plan_holds_for_plans_without_caution(standby):
    """Both state their energies by the same profiles; the waits of both are written in steps."""
    paths, points = closed_cycle(seed=4, moves=3)
    machine = joint_controller(paths.robot, exponent=1.0)
    asked = 1.9 * paths.with_controller(machine).durations([1.0]).sum()
    data = paths.robot.file.model_dump(mode="json")
    robot = rj.Robot(RobotFile.model_validate({**data, **standby}), paths.robot.payload)
    program = rj.Program(tree_from_configurations("cell", points))
    runs = observed(paths, machine, (1.0, 0.3), noise=0.05)
    wish = {"cycle_time": asked, "runs": runs, "speed_step": 5}
    free, cautious = (rj.optimize(program, robot, **wish, cautious=one) for one in (False, True))
    steps_j = 500.0 * (asked - free.cycle_time_s)
    assert cautious.energy_j > free.energy_j + 1.5
    assert cautious.bound_j <= free.energy_j + steps_j
    assert 0.0 <= free.gap_to_optimum_percent <= cautious.gap_to_optimum_percent


def test_runs_that_no_rule_explains_are_told(case):
    paths, program, machine, asked = case
    runs = observed(paths, machine, (1.0, 0.3))
    rng = np.random.default_rng(4)
    odd = replace(runs, duration_s=runs.duration_s * np.tile(rng.uniform(0.8, 1.4, paths.motions), 2))
    overload = {"allow_overload_percent": 100.0}
    for profiles, said in (
        ("measured", "no rule of a controller explains the runs"),
        ("simulated", "no rule explains the durations to 3 % of motions left out, so none is taken"),
    ):
        plan = rj.optimize(program, paths.robot, cycle_time=2.0 * asked, runs=odd, profiles=profiles, **overload)
        assert any(said in warning for warning in plan.warnings)
    trade = rj.pareto(program, paths.robot, runs=odd)
    profile = rj.energy_profile(paths.robot, program=program, move=program.moves[0].name, runs=odd)
    for told in (trade.warnings, profile.warnings):
        assert any("no rule of a controller explains the runs" in warning for warning in told)
    plan = rj.optimize(program, paths.robot, cycle_time=asked, runs=runs)
    assert not any("no rule" in warning for warning in plan.warnings)


def test_what_a_stopwatch_rounds_is_not_taken_for_runs_that_no_rule_explains():
    """Short moves by a clock of 0.1 s: motions left out are missed by more than 3 %, as the clock explains."""
    paths, points = closed_cycle(moves=8)
    program = rj.Program(tree_from_configurations("cell", points))
    runs = by_a_stopwatch(paths, joint_controller(paths.robot), (1.0, 0.5, 0.25))
    found = rj.identify_timing(runs, program, paths.robot)
    assert found.held_out_error_percent > 3.0
    assert found.is_good and found.warnings == ()
    move = program.moves[1].name
    results = (
        rj.optimize(program, paths.robot, cycle_time="+30%", runs=runs),
        rj.pareto(program, paths.robot, runs=runs),
        rj.energy_profile(paths.robot, program=program, move=move, runs=runs),
    )
    for result in results:
        assert not any("no rule" in warning for warning in result.warnings)
    # A robot file has no runs to be explained: it says how well it knows durations.
    learnt = rj.Robot(found.robot_file(), paths.robot.payload)
    plan = rj.optimize(program, learnt, cycle_time="+30%")
    assert not any("no rule" in warning for warning in plan.warnings)
    assert any("the controller's timing is known to 4 % of a motion's duration only" in said for said in plan.warnings)
