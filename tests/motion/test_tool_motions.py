"""Motions of the tool: its way and speed by Pinocchio, durations in closed form, energies by inverse dynamics."""

from dataclasses import fields

import numpy as np
import pytest

from robojoule.motion.tool_motions import ToolMotions, ToolMove
from robojoule.robots import load_robot
from robojoule.robots.drives import drive_powers, mains_energy_j, mains_power_w
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload
from tests.calibration.machines import joint_controller
from tests.motion.tool_moves import ROBOTS, random_moves

LIMITS = np.array([1.0, 0.5, 0.1])


@pytest.fixture(scope="module", params=ROBOTS)
def moved(request):
    robot = load_robot(request.param, Payload(5.0, (0.02, 0.0, 0.1)))
    return ToolMotions(robot, [*random_moves(robot, 4, seed=1), *random_moves(robot, 2, seed=2, circles=True)])


def tool_by_pinocchio(robot, q, tool_m):
    """Places of the point of the tool, shape (N, 3). [m]"""
    pin = pytest.importorskip("pinocchio")
    model, found = robot.model, []
    data = model.createData()
    for row in q:
        pin.forwardKinematics(model, data, row)
        body = data.oMi[robot.mechanism.tool_body]
        flange = Placement(body.rotation, body.translation) @ robot.mechanism.tool
        found.append(flange.at(np.array(tool_m)))
    return np.array(found)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_tool_keeps_to_its_line_at_constant_speed(name):
    """A line of a length L at tool speed v with acceleration a takes L / v + v / a + T, T being a jerk phase."""
    robot = load_robot(name, Payload(5.0))
    speed, acceleration = 0.1, 2.0
    moves = [
        move
        for move in random_moves(robot, 6, seed=5, acceleration_m_s2=acceleration)
        if move.followed(robot).course.length_m > 0.1
    ]
    assert len(moves) >= 2
    motions = ToolMotions(robot, moves)
    for number, move in enumerate(moves):
        course = move.followed(robot).course
        limits = np.full(len(moves), speed / course.length_m / motions.timing.full_velocity[number])
        duration = course.length_m / speed + speed / acceleration + robot.drives.filter_time_s
        assert motions.durations(limits[:, None])[number, 0] == pytest.approx(duration, rel=1e-9)
        samples = motions.power_samples(number, limits, 1000.0)
        at = tool_by_pinocchio(robot, samples.position_rad, move.tool_m)
        along = course.shift_m / course.length_m
        way = (at - at[0]) @ along
        assert np.abs(at - at[0] - way[:, None] * along).max() < 1e-6
        ramp = speed / acceleration + robot.drives.filter_time_s
        cruising = (samples.time_s > ramp) & (samples.time_s < duration - ramp)
        cruising[-1] = False
        steps = np.diff(way[cruising]) / np.diff(samples.time_s[cruising])
        np.testing.assert_allclose(steps, speed, rtol=1e-6)
        assert way[-1] == pytest.approx(course.length_m, abs=1e-8)


def test_energies_are_those_of_inverse_dynamics_along_finite_differences(moved):
    """Positions alone are taken from the run: velocities and accelerations are differences, torques Pinocchio's."""
    pin = pytest.importorskip("pinocchio")
    drives = moved.robot.drives
    runs, model = moved.simulate([0.4]), moved.robot.model
    data = model.createData()
    for motion in range(moved.motions):
        samples = moved.power_samples(motion, np.full(moved.motions, 0.4), 8000.0)
        time, q = samples.time_s[:-1], samples.position_rad[:-1]
        step = time[1] - time[0]
        middle, velocity = q[1:-1], (q[2:] - q[:-2]) / (2.0 * step)
        acceleration = (q[2:] - 2.0 * q[1:-1] + q[:-2]) / step**2
        rigid = np.array([pin.rnea(model, data, *row) for row in zip(middle, velocity, acceleration, strict=True)])
        load = rigid + drives.reflected_inertia_kg_m2 * acceleration
        power = drive_powers(drives, np.sign(velocity) * (np.abs(velocity) > 1e-7), velocity, load)
        drawn, bus = (np.sum(values) * step for values in (np.maximum(power.bus_w, 0.0), power.bus_w))
        duration = samples.time_s[-1]
        ends_j = (duration - step * len(middle)) * moved.idle_power_end_w[motion]
        energy = mains_energy_j(drives, step * len(middle), drawn, bus) + ends_j
        assert runs.duration_s[motion, 0] == pytest.approx(duration, rel=1e-9)
        assert runs.energy_j[motion, 0] == pytest.approx(energy, rel=3e-4)
        assert runs.peak_power_w[motion, 0] == pytest.approx(mains_power_w(drives, power.bus_w).max(), rel=0.02)
        np.testing.assert_allclose(samples.velocity_rad_s[1:-2], velocity, atol=1e-4)
        np.testing.assert_allclose(samples.acceleration_rad_s2[1:-2], acceleration, atol=0.05)
    parts = runs.potential_j + runs.friction_j + runs.copper_j + runs.braking_j + runs.inverter_j
    assert parts + runs.base_j + runs.drive_active_j == pytest.approx(runs.energy_j, rel=1e-9)


@pytest.mark.parametrize("limit", LIMITS)
def test_velocities_and_torques_keep_within_their_limits(moved, limit):
    robot = moved.robot
    for motion in range(moved.motions):
        samples = moved.power_samples(motion, np.full(moved.motions, limit), 1000.0)
        qd = samples.velocity_rad_s
        assert (np.abs(qd) <= limit * robot.velocity_rad_s * (1.0 + 1e-3)).all()
        assert qd[[0, -1]] == pytest.approx(0.0, abs=1e-9)
        # Up to the peak: where steady torques take most of what may be used, a floor is left for acceleration.
        assert (np.abs(samples.torque_nm) <= robot.peak_effort_nm).all()


def test_a_given_acceleration_is_kept_to(moved):
    robot = moved.robot
    moves = random_moves(robot, 3, seed=9, acceleration_m_s2=0.5)
    motions = ToolMotions(robot, moves)
    for number, move in enumerate(moves):
        samples = motions.power_samples(number, np.ones(len(moves)), 2000.0)
        at = tool_by_pinocchio(robot, samples.position_rad[:-1], move.tool_m)
        second = np.diff(at, n=2, axis=0) * 2000.0**2
        assert np.linalg.norm(second, axis=1).max() <= 0.5 * (1.0 + 1e-3)


def test_some_of_the_motions_are_the_same_alone(moved):
    runs, part = moved.simulate(LIMITS), moved.subset(np.array([4, 1]))
    for field in fields(runs):
        one, other = getattr(runs, field.name)[[4, 1]], getattr(part.simulate(LIMITS), field.name)
        assert other == pytest.approx(one, rel=1e-9), field.name
    assert part.idle_power_end_w == pytest.approx(moved.idle_power_end_w[[4, 1]])


def test_speed_limits_for_durations_are_the_inverse_of_durations(moved):
    wanted = moved.durations([0.37])[:, 0]
    limits = moved.speed_limits_for_durations(wanted)
    assert moved.durations(limits[:, None])[:, 0] == pytest.approx(wanted, rel=1e-9)
    top = moved.fastest_speed_limits()
    assert moved.durations(top[:, None])[:, 0] == pytest.approx(moved.minimum_durations(), rel=1e-9)


def test_a_motion_that_goes_nowhere_takes_no_time_and_no_energy():
    robot = load_robot("kuka_kr16_r2010_2")
    move = random_moves(robot, 1, seed=4)[0]
    motions = ToolMotions(robot, [ToolMove(move.start_rad, move.start_rad), move])
    runs = motions.simulate(LIMITS)
    assert not motions.moving[0]
    assert motions.moving[1]
    assert not runs.energy_j[0].any()
    assert not motions.durations(LIMITS)[0].any()
    assert motions.fastest_speed_limits()[0] == 1.0
    assert motions.idle_power_start_w[0] == pytest.approx(motions.idle_power_start_w[1])


def test_a_learnt_dead_time_is_part_of_every_motion():
    robot = load_robot("kuka_kr16_r2010_2")
    learnt = robot.variant(controller=joint_controller(robot, dead_s=0.05))
    moves = random_moves(robot, 2, seed=4)
    plain, dead = ToolMotions(robot, moves), ToolMotions(learnt, moves)
    extra = learnt.controller.dead_time_s
    assert extra > 0.0
    assert dead.durations(LIMITS) == pytest.approx(plain.durations(LIMITS) + extra)
    more = dead.simulate(LIMITS).energy_j - plain.simulate(LIMITS).energy_j
    assert more == pytest.approx(np.outer(plain.idle_power_end_w * extra, np.ones(3)))


def test_runs_at_one_speed_limit_are_the_same_however_often_they_are_asked_for(moved):
    once, often = moved.simulate([0.4]), moved.simulate([0.4, 0.4, 0.4])
    for field in fields(once):
        found = getattr(often, field.name)
        assert found.shape[1] == 3
        assert np.array_equal(found, np.repeat(getattr(once, field.name), 3, axis=1)), field.name
