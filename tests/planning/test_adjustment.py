"""Plans made again after a trial on the machine."""

from dataclasses import replace

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots import load_robot_file
from robojoule.robots.controller_file import ControllerTiming
from robojoule.robots.robot import Robot
from robojoule.robots.robot_file import RobotFile
from tests.calibration.machines import closed_cycle, joint_controller, observed
from tests.planning.test_measured_plans import executed


@pytest.fixture(scope="module")
def case():
    paths, points = closed_cycle(seed=12, moves=8)
    robot = paths.robot
    program = rj.Program(tree_from_configurations("cell", points))
    slower = ControllerTiming(
        rule="torque_limited",
        velocity_rad_s=0.95 * robot.velocity_rad_s,
        acceleration_rad_s2=None,
        acceleration_factor=0.92,
        filter_time_s=robot.drives.filter_time_s,
        least_cruise_share=robot.drives.least_cruise_share,
    )
    return paths, program, slower, rj.optimize(program, robot, cycle_time="+40%")


def test_a_measured_cycle_brings_the_plan_back_into_its_time(case):
    paths, _, machine, plan = case
    measured, _ = executed(paths, machine, plan)
    assert measured > 1.03 * plan.cycle_time_s
    again = rj.adjust(plan.program, paths.robot, measured_cycle=measured)
    assert again.cycle_time_s == pytest.approx(plan.cycle_time_s, abs=2e-3)  # waits are written in 1 ms
    late = executed(paths, machine, again)[0] / plan.cycle_time_s - 1.0
    assert abs(late) < 0.2 * (measured / plan.cycle_time_s - 1.0)
    assert "times their simulated durations" in again.warnings[-1]
    assert again.bound_j < again.energy_j  # what is proven, not the plan's own energy
    assert again.gap_to_optimum_percent < 0.01


def test_a_machine_as_simulated_keeps_its_plan(case):
    paths, _, _, plan = case
    again = rj.adjust(plan.program, paths.robot, measured_cycle=plan.cycle_time_s)
    assert again.energy_j == pytest.approx(plan.energy_j, rel=1e-4)


def test_runs_tell_move_by_move(case):
    paths, _, _, plan = case
    machine = joint_controller(paths.robot)
    asked = 1.5 * paths.with_controller(machine).durations([1.0]).sum()
    runs = observed(paths, machine, (1.0, 0.3, plan.run.speed_limits), noise=0.02)
    again = rj.adjust(plan.program, paths.robot, runs=runs, cycle_time=asked)
    assert executed(paths, machine, again)[0] == pytest.approx(asked, rel=1e-3)
    assert again.outlook.cycle_deviation_s < 0.01


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "neither a measured cycle nor runs are given"),
        ({"measured_cycle": -1.0}, "measured_cycle: -1 is out of range"),
        ({"measured_cycle": 0.01}, "times as long as simulated"),
        ({"measured_cycle": 1e4}, "times as long as simulated"),
        ({"measured_cycle": np.nan}, "is not a finite number"),
    ],
)
def test_what_cannot_be_is_refused(case, given, message):
    paths, _, _, plan = case
    with pytest.raises(InputError, match=message):
        rj.adjust(plan.program, paths.robot, **given)


def test_a_program_without_a_plan_wants_a_cycle_time(case):
    paths, program, machine, plan = case
    runs = observed(paths, machine, (1.0, 0.3))
    for trial in ({"runs": runs}, {"measured_cycle": 7.0}):
        with pytest.raises(InputError, match="the program does not say for which cycle time it was planned"):
            rj.adjust(program, paths.robot, **trial)
    assert plan.program.tree.planned_cycle_s == pytest.approx(plan.cycle_time_s, abs=1e-6)
    again = rj.adjust(plan.program, paths.robot, runs=runs)
    assert again.cycle_time_s == pytest.approx(plan.cycle_time_s, abs=2e-3)


def test_a_share_is_one_of_the_cycle_as_it_ran(case):
    paths, _, machine, plan = case
    measured, _ = executed(paths, machine, plan)
    again = rj.adjust(plan.program, paths.robot, measured_cycle=measured, cycle_time="+10%")
    assert again.cycle_time_s == pytest.approx(1.1 * measured, abs=2e-3)


def test_a_cycle_that_is_too_short_names_what_the_machine_can(case):
    paths, _, machine, plan = case
    measured, _ = executed(paths, machine, plan)
    fastest = paths.durations([1.0]).sum()
    with pytest.raises(CycleTimeTooShort) as error:
        rj.adjust(plan.program, paths.robot, measured_cycle=measured, cycle_time=float(fastest))
    assert error.value.minimum_s > 1.02 * fastest


def slow_program(case):
    """The program with speed limits of its own, one of them fixed."""
    _, program, _, _ = case
    first, second, third = (move.name for move in program.moves[:3])
    tree = program.tree.with_settings(
        {first: {"speed_limit_percent": 40.0}, second: {"speed_limit_percent": 55.0}, third: {"fixed": True}}
    )
    return rj.Program(tree), {first: 40.0, second: 55.0}


@pytest.mark.parametrize("suffix", [".yaml", ".json"])
def test_the_programs_own_speed_limits_bound_what_comes_after_a_trial(case, tmp_path, suffix):
    paths, _, machine, _ = case
    program, bounds = slow_program(case)
    program.save(tmp_path / f"cell{suffix}")
    plan = rj.optimize(rj.load_program(tmp_path / f"cell{suffix}"), paths.robot, cycle_time="+25%")
    plan.save(tmp_path / f"plan{suffix}")
    ran = rj.load_program(tmp_path / f"plan{suffix}")
    assert {move.name: move.most_speed_percent for move in ran.moves if move.most_speed_percent is not None} == bounds
    planned_again = rj.optimize(ran, paths.robot, cycle_time="+5%")
    for one in (ran, planned_again.program):
        runs = observed(paths, machine, (1.0, 0.3), noise=0.02)
        by_runs = rj.adjust(one, paths.robot, runs=runs, cycle_time=1.15 * plan.cycle_time_s)
        measured = 1.15 * one.tree.planned_cycle_s
        by_cycle = rj.adjust(one, paths.robot, measured_cycle=measured, cycle_time=1.15 * plan.cycle_time_s)
        for again in (by_runs, by_cycle):
            speeds = {move.name: move.speed_limit_percent for move in again.program.moves}
            assert all(speeds[name] <= most for name, most in bounds.items())
    tight = {"measured_cycle": 1.35 * plan.cycle_time_s, "cycle_time": plan.cycle_time_s}
    with pytest.raises(CycleTimeTooShort, match=r"within the program's speed limits.* if moves may be faster"):
        rj.adjust(ran, paths.robot, **tight)
    faster = rj.adjust(ran, paths.robot, allow_faster=True, **tight)
    assert any(move.speed_limit_percent > bounds.get(move.name, 100.0) for move in faster.program.moves)


def test_a_format_without_memory_takes_the_bounds_from_the_program_before(case, tmp_path):
    paths, _, _, _ = case
    program, bounds = slow_program(case)
    program.save(tmp_path / "cell.csv")
    read = rj.load_program(tmp_path / "cell.csv")
    plan = rj.optimize(read, paths.robot, cycle_time="+25%")
    plan.save(tmp_path / "plan.csv")
    ran = rj.load_program(tmp_path / "plan.csv")
    asked = {"measured_cycle": 1.1 * plan.cycle_time_s, "cycle_time": plan.cycle_time_s}
    free, bounded = (rj.adjust(ran, paths.robot, given=given, **asked) for given in (None, read))
    speeds = {move.name: move.speed_limit_percent for move in bounded.program.moves}
    assert all(speeds[name] <= most for name, most in bounds.items())
    assert any("faster than in the plan that ran" in warning for warning in free.warnings)
    assert not any("faster than in the plan that ran" in warning for warning in bounded.warnings)
    other = rj.Program(program.tree.model_copy(update={"operations": program.tree.operations[:4]}))
    with pytest.raises(InputError, match="given: it has other moves than the plan"):
        rj.adjust(ran, paths.robot, given=other, **asked)


def test_the_program_as_given_is_the_plan_that_ran(case):
    paths, _, machine, plan = case
    runs = observed(paths, machine, (1.0, 0.3), noise=0.02)
    again = rj.adjust(plan.program, paths.robot, runs=runs, cycle_time=1.1 * plan.cycle_time_s)
    assert again.energy_given_j < 0.95 * again.energy_unoptimized_j


def test_faster_moves_leave_the_program_as_given_what_it_is(case):
    paths, _, machine, _ = case
    program, _ = slow_program(case)
    waiting = program.tree.with_plan({}, added_waits_after_s={program.moves[-1].name: 0.5})
    runs = observed(paths, machine, (1.0, 0.3), noise=0.02)
    strict, faster = (
        rj.optimize(replace(program, tree=waiting), paths.robot, cycle_time="+10%", runs=runs, allow_faster=allowed)
        for allowed in (False, True)
    )
    assert faster.cycle_time_s == pytest.approx(strict.cycle_time_s, abs=0.01)
    assert faster.energy_given_j == pytest.approx(strict.energy_given_j, rel=1e-3)
    assert faster.energy_given_j < 0.98 * faster.energy_unoptimized_j


@pytest.mark.parametrize("factor", [0.9, 1.25])
def test_waits_of_an_adjusted_plan_use_standby_in_the_time_of_the_machine(case, factor):
    """A mode that needs a wait of just what is left: no more of it is lost, or missed, by the scale of time."""
    paths, program, _, _ = case
    data = load_robot_file(paths.robot.name).model_dump(mode="json")
    data["standby"] = {"brakes": {"power_w": 60.0, "least_idle_s": 2.0}}
    robot = Robot(RobotFile.model_validate(data), paths.robot.payload)
    plan = rj.optimize(program, robot, cycle_time="+60%")
    asked = {"measured_cycle": factor * (plan.cycle_time_s - added_s(plan)) + added_s(plan)}
    least = rj.adjust(plan.program, robot, cycle_time=100.0, **asked).least_cycle_time_s
    for left_s in (1.9, 2.6, 3.2, 4.0, 8.0):
        again = rj.adjust(plan.program, robot, cycle_time=least + left_s, **asked)
        held = rj.adjust(plan.program, paths.robot, cycle_time=least + left_s, **asked)
        assert again.cycle_time_s == pytest.approx(least + left_s, abs=2e-3 * len(plan.moves))
        waited = added_s(again)
        assert again.energy_j <= held.energy_j * (1.0 + 1e-4)
        assert waited == pytest.approx(0.0, abs=0.05) or waited >= 2.0 - 1e-9, "a wait too short for the mode"
    assert added_s(again) >= 2.0 and again.run.standby_saving_j > 0.0


def added_s(plan):
    """What a plan waits beyond the program."""
    return sum(move.added_wait_before_s + move.added_wait_after_s for move in plan.program.moves)


def test_the_cycle_time_asked_for_does_not_shrink_trial_by_trial(case):
    paths, _, _, plan = case
    again = plan
    for measured in (1.03, 1.01, 0.99):
        again = rj.adjust(again.program, paths.robot, measured_cycle=measured * plan.cycle_time_s)
        assert again.program.tree.planned_cycle_s == plan.program.tree.planned_cycle_s
        assert again.cycle_time_s <= plan.cycle_time_s + 1e-6
