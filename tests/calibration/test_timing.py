"""The controller's timing from runs: hidden machines are found again, and what runs do not tell is named."""

import numpy as np
import pytest

from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.timing import identify_timing
from robojoule.calibration.timing_rules import OWN, candidates
from robojoule.errors import InputError
from robojoule.robots.controller_file import ControllerTiming
from robojoule.robots.robot import Payload, Robot
from tests.calibration.machines import RAMPS_S, closed_cycle, joint_controller, observed

SPEEDS = (1.0, 0.6, 0.3)


@pytest.fixture(scope="module")
def paths():
    return closed_cycle(moves=20)[0]


@pytest.fixture(scope="module")
def found(paths):
    return identify_timing(paths, observed(paths, joint_controller(paths.robot), SPEEDS))


def test_joint_accelerations_are_found(paths, found):
    assert found.rule == "joint_accelerations, acceleration ~ limit^0"
    assert found.rules[0].name == found.rule
    assert found.rules[0].log_probability == 0.0
    assert all(rule.log_probability < 0.0 for rule in found.rules[1:])
    figures = {parameter.name: parameter for parameter in found.parameters}
    told = 0
    for place, joint in enumerate(paths.robot.joint_names):
        one = figures[f"joints.{joint}.acceleration_rad_s2"]
        if one.identified:
            told += 1
            true = paths.robot.velocity_rad_s[place] / RAMPS_S[place]
            assert abs(one.value - true) < max(4.0 * one.standard_error, 0.02 * true), one.name
    assert told >= 3


def test_motions_left_out_are_met(paths, found):
    assert found.held_out_error_percent < 0.6
    assert found.nominal_error_percent > 5.0
    fresh = closed_cycle(seed=77)[0]
    truth = fresh.with_controller(joint_controller(paths.robot)).durations([0.8, 0.45])
    said = fresh.with_controller(found.controller).durations([0.8, 0.45])
    assert np.median(np.abs(said / truth - 1.0)) < 0.005
    assert np.abs(said.sum() / truth.sum() - 1.0) < 0.003


@pytest.mark.parametrize("exponent", [0.0, 1.0])
def test_a_slower_controller_with_scaled_accelerations_is_found(paths, exponent):
    drives = paths.robot.drives
    machine = ControllerTiming(
        rule="torque_limited",
        velocity_rad_s=0.95 * paths.robot.velocity_rad_s,
        acceleration_rad_s2=None,
        acceleration_factor=0.9,
        acceleration_exponent=exponent,
        filter_time_s=2.0 * drives.filter_time_s,
        dead_time_s=0.01,
        least_cruise_share=drives.least_cruise_share,
    )
    found = identify_timing(paths, observed(paths, machine, SPEEDS))
    assert found.controller.rule == "torque_limited"
    assert found.controller.acceleration_exponent == pytest.approx(exponent, abs=0.05)
    assert found.controller.acceleration_factor == pytest.approx(0.9, rel=0.04)
    assert found.controller.filter_time_s == pytest.approx(2.0 * drives.filter_time_s, rel=0.2)


def test_a_program_with_speed_and_acceleration_of_the_leading_axis_is_found(paths):
    joints = paths.robot.joint_count
    machine = ControllerTiming(
        rule="leading_axis",
        velocity_rad_s=np.full(joints, 1.05),
        acceleration_rad_s2=np.full(joints, 1.4),
        filter_time_s=0.02,
    )
    found = identify_timing(paths, observed(paths, machine, SPEEDS))
    figures = {parameter.name: parameter for parameter in found.parameters}
    assert found.controller.rule == "leading_axis"
    assert figures["joints.velocity_rad_s"].value == pytest.approx(1.05, rel=0.005)
    assert figures["joints.acceleration_rad_s2"].value == pytest.approx(1.4, rel=0.03)


def test_runs_at_one_speed_say_nothing_of_the_exponent(paths):
    found = identify_timing(paths, observed(paths, joint_controller(paths.robot), (1.0,)))
    assert "one speed limit" in found.warnings[0]
    assert all("limit^0" in rule.name for rule in found.rules)


def test_joints_that_bind_nowhere_are_named(paths):
    moving = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    robot = paths.robot
    only = type(paths)(robot, paths.start_rad, paths.start_rad + moving * paths.delta_rad)
    found = identify_timing(only, observed(only, joint_controller(robot), SPEEDS))
    names = {parameter.name for parameter in found.unidentified}
    assert {f"joints.{joint}.acceleration_rad_s2" for joint in robot.joint_names[3:]} <= names


def test_the_robot_file_is_taken_for_its_programs(paths, found):
    file = found.robot_file()
    robot = Robot(file, Payload(10.0))
    assert robot.name == f"{paths.robot.name}_identified"
    assert robot.takes_programs_of(paths.robot.name)
    assert not robot.takes_programs_of("ur_ur10e")
    again = type(paths)(robot, paths.start_rad, paths.start_rad + paths.delta_rad)
    expected = paths.with_controller(found.controller).durations([0.5])
    assert again.durations([0.5]) == pytest.approx(expected, rel=1e-4)


def test_too_few_motions_and_motions_of_no_length_are_refused(paths):
    runs = observed(paths, joint_controller(paths.robot), (1.0,))
    few = MeasuredRuns("few", runs.motion[:2], runs.speed_limits[:2], runs.duration_s[:2], runs.energy_j[:2], 0.004)
    with pytest.raises(InputError, match="runs are of 2 motions only; allowed: at least 3"):
        identify_timing(paths, few)
    still = type(paths)(paths.robot, paths.start_rad, paths.start_rad)
    with pytest.raises(InputError, match="goes nowhere"):
        identify_timing(still, runs)


def test_nothing_is_confounded_by_noise_of_a_stopwatch(paths):
    runs = observed(paths, joint_controller(paths.robot), SPEEDS, stamp_s=0.1)
    found = identify_timing(paths, runs)
    fresh = closed_cycle(seed=78)[0]
    truth = fresh.with_controller(joint_controller(paths.robot)).durations([0.5])
    said = fresh.with_controller(found.controller).durations([0.5])
    assert np.abs(said.sum() / truth.sum() - 1.0) < 0.02


def as_the_entry_says(scatter, seed):
    """Four moves, one of them short, at two speeds: too few to tell eight figures, and no need to."""
    paths, _ = closed_cycle(moves=4)
    paths = type(paths)(paths.robot, paths.start_rad, paths.start_rad + paths.delta_rad * [[1], [1], [0.03], [1]])
    limits = (1.0, 0.4)
    seconds = paths.durations(limits)
    seconds = seconds * (1.0 + scatter * np.random.default_rng(seed).standard_normal(seconds.shape))
    moves, none = np.tile(np.arange(4), 2), np.full(8, np.nan)
    runs = MeasuredRuns("runs", moves, np.repeat(limits, 4), seconds.T.ravel(), none, 0.001)
    return paths, identify_timing(paths, runs)


@pytest.mark.parametrize("scatter", [0.0, 0.003])
@pytest.mark.parametrize("seed", range(4))
def test_a_machine_that_is_as_its_entry_says_is_taken_for_that(scatter, seed):
    paths, found = as_the_entry_says(scatter, seed)
    assert found.rule == OWN
    assert found.held_out_error_percent == pytest.approx(found.nominal_error_percent, abs=1e-4)
    assert found.controller.velocity_rad_s == pytest.approx(paths.robot.velocity_rad_s)
    assert not found.is_good and found.robot_file().controller is None
    assert found.warnings == ("the entry's own timing meets the runs as well as any rule, so it is kept",)
    assert found.parameters == ()


@pytest.mark.parametrize("seed", range(4))
def test_no_rule_is_chosen_that_misses_motions_left_out_by_far_more_than_the_entry(seed):
    """Runs that scatter by six times of what stamps let expect, which leads some of the rules far off."""
    _, found = as_the_entry_says(0.012, seed)
    assert found.held_out_error_percent < 3.0 * found.nominal_error_percent < 6.0
    assert max(rule.held_out_error_percent for rule in found.rules) > 10.0


@pytest.mark.parametrize("rule", ["torque_limited", "joint_accelerations", "leading_axis", None])
def test_the_entry_s_own_timing_is_that_of_its_paths(paths, rule):
    """Also where the entry is a machine whose timing was learnt before."""
    robot, limits = paths.robot, np.array([1.0, 0.6, 0.25])
    if rule is not None:
        learnt = ControllerTiming(
            rule=rule,
            velocity_rad_s=0.9 * robot.velocity_rad_s if rule != "leading_axis" else np.full(robot.joint_count, 1.1),
            acceleration_rad_s2=None if rule == "torque_limited" else np.full(robot.joint_count, 3.0),
            acceleration_factor=0.8 if rule == "torque_limited" else 1.0,
            acceleration_exponent=0.7,
            filter_time_s=0.06,
            dead_time_s=0.01,
        )
        robot = robot.variant(controller=learnt)
    own_paths = type(paths)(robot, paths.start_rad, paths.start_rad + paths.delta_rad)
    (own,) = (one for one in candidates(own_paths) if one.is_own)
    motion = np.repeat(np.arange(paths.motions), limits.size)
    found, _ = own.evaluate(own.mean[None], motion, np.tile(limits, paths.motions)[None])
    assert found.reshape(-1, limits.size) == pytest.approx(own_paths.durations(limits), rel=1e-6)
