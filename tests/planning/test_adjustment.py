"""Plans made again after a trial on the machine."""

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots.controller_file import ControllerTiming
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
        ({}, "what the trial gave is needed"),
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
