"""The controller's rule: from its definition, and as a property of every robot at every payload it is rated for."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.time_laws import ramp_time_s
from robojoule.robots import list_robots, load_robot, load_robot_file
from robojoule.robots.robot import Payload
from tests.core_cases import kr16, random_motions

RAISED = 1.005  # a step in payload
COM_M = (0.0, 0.0, 0.1)


def accelerations(robot, paths, velocity):
    """What the limits of every joint at every node leave at peak velocities (M,): the definition."""
    drives, delta, peak = robot.drives, paths.delta_rad[:, None, :], robot.peak_effort_nm
    inertia, centrifugal, gravity = paths.torques.at_nodes
    v = velocity[:, None, None]
    standing = gravity + drives.coulomb_nm * np.sign(delta)
    moving = standing + v * (drives.viscous_nm_s_per_rad * delta + v * centrifugal)
    steady = np.maximum(np.abs(standing), np.abs(moving))
    beyond = np.clip(peak - steady, 0.0, drives.torque_floor * peak)
    left = np.maximum(drives.torque_use * peak - steady, beyond)
    return (left / np.abs(inertia + drives.reflected_inertia_kg_m2 * delta)).min(axis=(1, 2))


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("name", ["kuka_kr16_r2010_2", "kuka_kr500_r2800_2", "ur_ur10e"])
def test_full_speed_is_the_highest_velocity_with_the_least_cruise(name, share):
    robot = load_robot(name, Payload(8.0))
    robot = robot.variant(drives=dataclasses.replace(robot.drives, least_cruise_share=share))
    paths = MotionPaths(robot, *random_motions(robot, 60, seed=9))
    fastest, filter_s = paths.timing.fastest_velocity, robot.drives.filter_time_s
    a = accelerations(robot, paths, fastest)
    assert paths.timing.acceleration == pytest.approx(a, rel=1e-12)
    cruise_s = 1.0 / fastest - ramp_time_s(fastest, a, filter_s)
    assert np.all(cruise_s >= share * paths.minimum_durations() - 1e-12)
    faster = fastest * (1.0 + 1e-9)
    ramp_s = ramp_time_s(faster, accelerations(robot, paths, faster), filter_s)
    capped = faster * ramp_s > (1.0 - share) / (1.0 + share)
    assert np.all(capped | (faster > paths.timing.full_velocity))
    assert capped.any()


def test_little_more_time_saves_little():
    """The profile is steep at full speed, not vertical: 0.1 % more time saves about half a per cent, 1 % some five."""
    robot = kr16()
    paths = MotionPaths(robot, *random_motions(robot, 200))
    fastest = paths.minimum_durations()
    limits = [paths.speed_limits_for_durations(factor * fastest) for factor in (1.0, 1.001, 1.01, 1.05)]
    energy = paths.simulate(np.stack(limits, axis=1)).energy_j
    saved = 100.0 * (1.0 - energy[:, 1:] / energy[:, :1])
    assert np.median(saved[:, 0]) < 0.7
    assert np.median(saved[:, 1]) < 7.0 * np.median(saved[:, 2]) / 14.0
    assert np.all(np.diff(np.median(saved, axis=0)) > 0)


def holdable(paths):
    """Whether the standing torques of each motion leave all of the floor within the peak limits."""
    robot = paths.robot
    gravity = np.abs(paths.torques.at_nodes[2]) + robot.drives.coulomb_nm
    return np.all(gravity <= (1.0 - robot.drives.torque_floor) * robot.peak_effort_nm, axis=(1, 2))


@pytest.mark.parametrize("name", list_robots())
def test_durations_are_continuous_in_payload_and_alike_in_both_directions(name):
    rated = load_robot_file(name).rated_payload_kg
    robot = load_robot(name, Payload(rated, COM_M))
    start, end = random_motions(robot, 100, seed=3)
    within = np.ones(len(start), dtype=bool)
    for mass in (0.3 * rated, 0.7 * rated, rated / RAISED):
        light, heavy = (load_robot(name, Payload(kg, COM_M)) for kg in (mass, mass * RAISED))
        within &= can_stand(heavy, start, end)
        durations = [MotionPaths(arm, start[within], end[within]).minimum_durations() for arm in (light, heavy)]
        step = durations[1] / durations[0]
        assert np.all((step <= 1.03) & (step >= 1.0 / 1.03))
    assert within.mean() > 0.5
    forward = MotionPaths(robot, start[within], end[within]).minimum_durations()
    reverse = MotionPaths(robot, end[within], start[within]).minimum_durations()
    assert np.all(np.abs(np.log(forward / reverse)) <= np.log(2.0))


def can_stand(robot, start, end):
    """`holdable`, before any time law is computed: some motions may have none."""
    weightless = load_robot(robot.name)
    paths = MotionPaths(robot, start, end, controller=weightless)
    return holdable(paths)


def test_the_docs_say_how_many_motions_no_test_of_the_rule_covers():
    """Of 100 random motions at rated payload: those at whose ends or between the limits cannot hold the arm."""
    outside = {}
    for name in list_robots():
        robot = load_robot(name, Payload(load_robot_file(name).rated_payload_kg, COM_M))
        count = int((~can_stand(robot, *random_motions(robot, 100, seed=3))).sum())
        if count:
            outside[name] = count
    page = (Path(__file__).parents[2] / "docs" / "robots.md").read_text(encoding="utf-8")
    table = page.split("| robot | motions it cannot hold |")[1].split("\n\n")[0]
    assert {name: int(count) for name, count in re.findall(r"^\| `(\w+)` \| (\d+) \|$", table, re.MULTILINE)} == outside


def test_a_pose_that_the_arm_cannot_hold_is_refused():
    robot = kr16()
    weak = robot.variant(peak_effort_nm=robot.effort_nm * np.array([1.0, 0.2, 1.0, 1.0, 1.0, 1.0]))
    stretched = np.radians([0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(InputError, match=r"joint_2 of kuka_kr16_r2010_2 cannot move the arm.*less than its peak"):
        MotionPaths(weak, stretched, stretched + 0.1).minimum_durations()
