"""Time laws of controllers whose timing was learnt: limits against closed forms and the controller by the drives."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.motion.path_integrals import PathIntegrals
from robojoule.motion.series_path import SeriesPath
from robojoule.motion.simulation import Engines, MotionPaths
from robojoule.robots.controller_file import ControllerTiming
from tests.calibration.machines import RAMPS_S, joint_controller
from tests.core_cases import SPEED_LIMITS, hard_paths, kr16, random_motions

PARTS = ("potential_j", "friction_j", "copper_j", "braking_j", "inverter_j", "base_j", "drive_active_j")


def by_the_drives(robot, **changes):
    """The learnt figures that say what the drives say."""
    figures = {
        "rule": "torque_limited",
        "velocity_rad_s": robot.velocity_rad_s,
        "acceleration_rad_s2": None,
        "filter_time_s": robot.drives.filter_time_s,
        "least_cruise_share": robot.drives.least_cruise_share,
    }
    return ControllerTiming(**figures | changes)


@pytest.fixture(scope="module")
def paths():
    return hard_paths(kr16())


def test_figures_of_the_drives_give_the_laws_of_the_drives(paths):
    learnt = paths.with_controller(by_the_drives(paths.robot))
    assert learnt.durations(SPEED_LIMITS) == pytest.approx(paths.durations(SPEED_LIMITS), rel=1e-9)
    assert learnt.simulate(SPEED_LIMITS).energy_j == pytest.approx(paths.simulate(SPEED_LIMITS).energy_j, rel=1e-8)
    assert learnt.fastest_speed_limits() == pytest.approx(paths.fastest_speed_limits(), rel=1e-8)
    wanted = paths.durations([0.3])[:, 0]
    found = learnt.speed_limits_for_durations(wanted)  # one of many where a motion has no length
    assert paths.durations(found[:, None])[:, 0] == pytest.approx(wanted, rel=1e-6)


def test_one_joint_takes_its_length_over_velocity_plus_ramp_filter_and_dead_time(paths):
    """Closed form of a trapezoid with jerk phases, as a machine's manual gives it."""
    robot = paths.robot
    controller = joint_controller(robot, exponent=1.0, dead_s=0.02)
    limit, length = 0.5, float(np.radians(90.0))  # the first of the hard motions: joint 1 alone
    velocity = limit * 0.97 * robot.velocity_rad_s[0]
    acceleration = limit * robot.velocity_rad_s[0] / RAMPS_S[0]
    expected = length / velocity + velocity / acceleration + 0.08 + 0.02
    assert paths.with_controller(controller).durations([limit])[0, 0] == pytest.approx(expected, rel=1e-12)


def test_the_joint_that_needs_most_sets_the_acceleration(paths):
    accelerations = joint_controller(paths.robot).acceleration_rad_s2
    found = paths.with_controller(joint_controller(paths.robot)).timing.acceleration
    expected = [
        min(a / abs(change) for a, change in zip(accelerations, row, strict=True) if change) for row in paths.delta_rad
    ]
    assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0])
def test_speed_limits_invert_durations_and_are_the_smallest(paths, exponent):
    machine = paths.with_controller(joint_controller(paths.robot, exponent, dead_s=0.01))
    wanted = machine.durations([0.37])[:, 0]
    found = machine.speed_limits_for_durations(wanted)
    assert machine.durations(found[:, None])[:, 0] == pytest.approx(wanted, rel=1e-9)
    slower = machine.durations(found[:, None] * 0.999)[:, 0]
    assert ((slower > wanted) | (found == 1.0)).all()  # 1 where the fastest run is wanted
    with pytest.raises(InputError, match="full speed"):
        machine.speed_limits_for_durations(machine.minimum_durations() * 0.99)


def test_energies_have_their_parts_and_their_dead_time(paths):
    still = paths.with_controller(joint_controller(paths.robot)).simulate(SPEED_LIMITS)
    runs = paths.with_controller(joint_controller(paths.robot, dead_s=0.05)).simulate(SPEED_LIMITS)
    assert sum(getattr(runs, part) for part in PARTS) == pytest.approx(runs.energy_j, rel=1e-12)
    longer = 0.05 * paths.idle_power_end_w[:, None]
    assert runs.energy_j - still.energy_j == pytest.approx(np.broadcast_to(longer, runs.energy_j.shape), rel=1e-6)


def test_path_integrals_follow_the_learnt_laws(paths):
    machine = paths.with_controller(joint_controller(paths.robot, 0.5, dead_s=0.03))
    none = np.zeros((60, 0))
    integrals = PathIntegrals(machine, SPEED_LIMITS, none)
    found = integrals.evaluate(paths.robot.drives, np.zeros(0), gradient=True)
    assert found.energy_j == pytest.approx(machine.simulate(SPEED_LIMITS).energy_j, rel=1e-6)
    base = found.energy_gradient["base_power_w"]
    assert base == pytest.approx(machine.durations(SPEED_LIMITS), rel=1e-9)


def test_samples_and_ruckig_follow_the_learnt_laws():
    pytest.importorskip("ruckig")
    robot = kr16()
    start, end = random_motions(robot, 4)
    controller = joint_controller(robot, exponent=1.0)
    own = MotionPaths(robot, start, end).with_controller(controller)
    other = MotionPaths(robot, start, end, engines=Engines(time_laws="ruckig")).with_controller(controller)
    assert other.simulate([0.3, 1.0]).duration_s == pytest.approx(own.durations([0.3, 1.0]), rel=1e-6)
    samples = own.sample(2, 0.3)
    assert samples.time_s[-1] == pytest.approx(own.durations([0.3])[2, 0], rel=1e-6)
    assert samples.path_position[-1] == pytest.approx(1.0, abs=1e-6)


def test_some_motions_of_many_keep_their_timing():
    robot = kr16()
    start, end = random_motions(robot, 5)
    learnt = robot.variant(controller=joint_controller(robot))
    paths = MotionPaths(learnt, start, end)
    assert paths.subset(np.array([3, 1])).durations([0.4]) == pytest.approx(paths.durations([0.4])[[3, 1]])


@pytest.mark.parametrize("some", [MotionPaths.subset, MotionPaths.known])
def test_some_motions_keep_a_timing_that_the_robot_s_file_does_not_have(some):
    robot = kr16()
    paths = MotionPaths(robot, *random_motions(robot, 5))
    learnt = paths.with_controller(joint_controller(robot, dead_s=0.03))
    rows = np.array([3, 1])
    part = some(learnt, rows)
    assert part.durations([0.4, 1.0]) == pytest.approx(learnt.durations([0.4, 1.0])[rows])
    assert part.simulate([0.4]).energy_j == pytest.approx(learnt.simulate([0.4]).energy_j[rows])


def test_some_curved_motions_stay_curved():
    robot = kr16()
    bend = np.zeros((3, robot.joint_count, 3))
    bend[:, :, 0], bend[:, :, 1], bend[:, :, 2] = robot.home_rad, 0.2, 0.05
    bend[:, :, 1] *= [[1.0], [1.5], [2.0]]
    paths = MotionPaths.along(robot, SeriesPath(bend))
    found = paths.subset(np.array([2, 0])).simulate([0.5])
    assert found.energy_j == pytest.approx(paths.simulate([0.5]).energy_j[[2, 0]])


def test_a_dead_time_below_that_of_a_motion_is_refused(paths):
    learnt = paths.with_controller(by_the_drives(paths.robot, dead_time_s=-0.01))
    assert learnt.durations([0.5]) == pytest.approx(paths.durations([0.5]) - 0.01 * paths.moving[:, None])
    least_s = float(paths.durations([1.0])[paths.moving].min())
    early = paths.with_controller(by_the_drives(paths.robot, dead_time_s=-1.1 * least_s))
    for call in (early.durations, early.simulate):
        with pytest.raises(InputError, match=r"controller.dead_time_s: a motion of .* s would take -.* s with a dead"):
            call([0.5])


def test_a_motion_of_no_length_takes_no_time():
    robot = kr16()
    paths = MotionPaths(robot, [robot.home_rad], [robot.home_rad]).with_controller(joint_controller(robot, dead_s=0.1))
    assert paths.durations([0.5]) == pytest.approx(0.0)
    assert paths.simulate([0.5]).energy_j == pytest.approx(0.0)
