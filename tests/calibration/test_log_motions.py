"""Motions of a log, and the timing that they tell."""

import numpy as np
import pytest

from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.log_motions import log_timing, logged_motions
from robojoule.errors import InputError
from robojoule.robots import load_robot
from robojoule.robots.controller_file import ControllerTiming
from tests.calibration.machines import closed_cycle

REST_S, STEP_S = 0.4, 0.008
CONTROLLER = ControllerTiming(
    rule="leading_axis", velocity_rad_s=np.ones(6), acceleration_rad_s2=np.full(6, 1.5), filter_time_s=0.02
)


def recorded(paths, limits, noise=0.0):
    """Positions and velocities of the motions one after another with rests, and the true durations."""
    position, velocity, limit, durations = [], [], [], []
    rng = np.random.default_rng(1)
    for motion, each in enumerate(limits):
        samples = paths.sample(motion, each, 1.0 / STEP_S)
        count = len(samples.time_s) - 1
        start, change = paths.start_rad[motion], paths.delta_rad[motion]
        position += [start + share * change for share in samples.path_position[:count]]
        velocity += [speed * change for speed in samples.path_velocity_per_s[:count]]
        rest = round(REST_S / STEP_S)
        position += [start + change] * rest
        velocity += [np.zeros(len(start))] * rest
        limit += [each] * (count + rest)
        durations.append(samples.time_s[-1])
    q, qd = np.array(position), np.array(velocity)
    time = STEP_S * np.arange(len(q))
    return time, q + noise * rng.standard_normal(q.shape), qd, np.array(limit), np.array(durations)


@pytest.fixture(scope="module")
def paths():
    """A UR program: one velocity and one acceleration for all joints."""
    found, _ = closed_cycle(seed=5, moves=12)
    return found.with_controller(CONTROLLER)


def test_every_motion_is_found_with_its_ends_and_duration(paths):
    time, q, qd, limit, durations = recorded(paths, [1.0] * paths.motions, noise=1e-5)
    found = logged_motions("log", time, q, qd, limit)
    assert found.start_rad == pytest.approx(paths.start_rad, abs=1e-3)
    assert found.end_rad - found.start_rad == pytest.approx(paths.delta_rad, abs=2e-3)
    assert found.duration_s == pytest.approx(durations, abs=0.03)
    assert np.abs(np.mean(found.duration_s - durations)) < 0.02
    assert found.left_out == 0


def test_paths_that_are_not_straight_are_left_out(paths):
    time, q, qd, limit, _ = recorded(paths, [1.0] * paths.motions)
    bent = q.copy()
    first = int(np.flatnonzero(np.abs(qd).max(axis=1) > 0.0)[0])
    bent[first : first + 120, 1] += 0.2 * np.sin(np.linspace(0.0, np.pi, 120))
    assert logged_motions("log", time, bent, qd, limit).left_out >= 1


def test_a_log_that_never_rests_is_refused():
    time = np.arange(200) * STEP_S
    with pytest.raises(InputError, match="no point-to-point motion"):
        logged_motions("log", time, np.zeros((200, 6)), np.ones((200, 6)))


@pytest.mark.parametrize("with_limits", [True, False])
def test_speed_and_acceleration_are_those_of_the_program(paths, with_limits):
    limits = [1.0] * 12 if not with_limits else [(1.0, 0.6, 0.35)[motion % 3] for motion in range(12)]
    time, q, qd, limit, _ = recorded(paths, limits, noise=1e-5)
    log = MeasuredLog("log", time, q, np.full(len(time), 500.0), qd, speed_limit=limit if with_limits else None)
    found, doubt = log_timing(log, load_robot("kuka_kr16_r2010_2"))
    assert found is not None and doubt is None
    figures = {parameter.name: parameter for parameter in found.parameters}
    assert found.controller.rule == "leading_axis"
    assert figures["joints.velocity_rad_s"].value == pytest.approx(1.0, rel=0.02)
    assert figures["joints.acceleration_rad_s2"].value == pytest.approx(1.5, rel=0.12)
    assert found.held_out_error_percent < 1.0
    assert found.is_good


def test_several_unknown_speed_limits_give_no_timing(paths):
    time, q, qd, _, _ = recorded(paths, [(1.0, 0.6, 0.35)[motion % 3] for motion in range(12)])
    log = MeasuredLog("log", time, q, np.full(len(time), 500.0), qd)
    found, doubt = log_timing(log, load_robot("kuka_kr16_r2010_2"))
    assert found is None
    assert doubt.startswith("no timing by the log's motions: without a column speed_limit_percent")


def repeated(paths, cycles):
    """A log of some cycles through motions, its sensors a little off each time."""
    start, end = (np.tile(q, (cycles, 1)) for q in (paths.start_rad, paths.start_rad + paths.delta_rad))
    again = type(paths)(paths.robot, start, end).with_controller(CONTROLLER)
    time, q, qd, _, _ = recorded(again, [1.0] * again.motions, noise=1e-4)
    return MeasuredLog("log", time, q, np.full(len(time), 500.0), qd)


def test_motions_that_are_repeated_are_runs_of_one(paths):
    """Leaving out a motion leaves out all its repetitions: more cycles do not make a rule look better."""
    points = np.concatenate([paths.start_rad[:4], paths.start_rad[:1]])
    some = type(paths)(paths.robot, points[:-1], points[1:])
    (once, _), (thrice, _) = (log_timing(repeated(some, cycles), paths.robot) for cycles in (1, 3))
    assert (once.motions, once.runs) == (4, 4)
    assert (thrice.motions, thrice.runs) == (4, 12)
    assert thrice.held_out_error_percent > 0.3 * once.held_out_error_percent


def test_two_motions_back_and_forth_tell_no_timing_and_that_is_said(paths):
    points = paths.start_rad[:2]
    found, doubt = log_timing(repeated(type(paths)(paths.robot, points, points[::-1]), 3), paths.robot)
    assert found is None
    assert "log: the runs are of 2 motions only; allowed: at least 3 different motions" in doubt
