"""Inverse kinematics: configurations come back from their poses, nothing is missed, what cannot be is told."""

import math

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.robots import list_robots, load_robot
from robojoule.robots.arm_geometry import geometry_of
from robojoule.robots.inverse_kinematics import (
    _SAME_RAD,
    STARTS,
    _candidates,
    _distinct,
    _newton,
    _wrapped,
    flange_placement,
    inverse_of,
    joints_for_pose,
)
from robojoule.robots.mechanism import Mechanism
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Robot

OFFSET_WRISTS = {"fanuc_crx10ia", *(name for name in list_robots() if name.startswith("ur_"))}
TOOL = Placement.of((0.05, -0.02, 0.18), (0.3, -0.2, 1.1))


def random_configurations(robot: Robot, count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(robot.lower_rad, robot.upper_rad, (count, robot.joint_count))


def rounded(placement: Placement, step_m: float = 1e-6, step_rad: float = math.radians(1e-3)) -> Placement:
    """As a vendor writes it: 0.001 mm and 0.001 deg, angles about fixed axes."""
    r = placement.rotation
    angles = (
        math.atan2(r[2, 1], r[2, 2]),
        math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0])),
        math.atan2(r[1, 0], r[0, 0]),
    )
    turns = tuple(round(angle / step_rad) * step_rad for angle in angles)
    return Placement.of(np.round(placement.origin_m / step_m) * step_m, turns)


@pytest.mark.parametrize("name", list_robots())
def test_random_configurations_come_back_from_their_poses(name):
    robot = load_robot(name)
    for q in random_configurations(robot, 15, seed=5):
        pose = flange_placement(robot, q) @ TOOL
        solutions = joints_for_pose(robot, pose, tool=TOOL, near_rad=q)
        np.testing.assert_allclose(solutions[0], q, atol=1e-6)
        assert (solutions >= robot.lower_rad).all() and (solutions <= robot.upper_rad).all()
        distances = np.linalg.norm(solutions - q, axis=1)
        assert (np.diff(distances) >= 0.0).all()
        for solution in solutions:
            reached = flange_placement(robot, solution) @ TOOL
            np.testing.assert_allclose(reached.origin_m, pose.origin_m, atol=1e-8)
            np.testing.assert_allclose(reached.rotation, pose.rotation, atol=1e-8)


def test_wrists_are_what_the_geometry_says():
    offset = {n for n in list_robots() if not geometry_of(load_robot(n).mechanism).has_spherical_wrist}
    assert offset == OFFSET_WRISTS


@pytest.mark.parametrize("name", ["fanuc_crx10ia", "kuka_kr8_r2100_2_arc_hw", "kuka_lbr_iisy11_r1300", "ur_ur5e"])
def test_no_solution_is_missed_that_newton_steps_from_everywhere_find(name):
    robot = load_robot(name)
    for q in random_configurations(robot, 2, seed=9):
        flange = flange_placement(robot, q)
        closed = _distinct(robot.mechanism, flange, _candidates(robot, flange, robot.home_rad))
        starts = np.random.default_rng(1).uniform(-math.pi, math.pi, (2 * STARTS, 6))
        searched = _distinct(robot.mechanism, flange, _newton(robot.mechanism, flange, starts, 60))
        assert len(searched) >= 2
        for solution in searched:
            assert np.abs(_wrapped(closed - solution)).max(axis=1).min() < 100 * _SAME_RAD
        assert len(closed) >= len(searched)


@pytest.mark.parametrize("name", ["kuka_kr16_r2010_2", "fanuc_r2000ic_165f", "fanuc_crx10ia", "ur_ur10e"])
def test_rounded_poses_at_singular_positions_and_at_limits(name):
    robot = load_robot(name)
    hard = [robot.home_rad, np.zeros(6), robot.home_rad + np.array([0.4, 0.0, 0.0, 0.7, 0.0, -0.9])]
    random = random_configurations(robot, 6, seed=3)
    random[:, [0, 3]] = robot.upper_rad[[0, 3]]
    for q in (*(q for q in hard if (q >= robot.lower_rad).all() and (q <= robot.upper_rad).all()), *random):
        pose = rounded(flange_placement(robot, q))
        nearest = joints_for_pose(robot, pose, near_rad=q)[0]
        reached = flange_placement(robot, nearest)
        np.testing.assert_allclose(reached.origin_m, pose.origin_m, atol=3e-5)
        np.testing.assert_allclose(reached.rotation, pose.rotation, atol=3e-5)


def test_a_stretched_wrist_stays_as_it_is_nearby():
    robot = load_robot("kuka_kr16_r2010_2")
    q = np.radians([20.0, -80.0, 100.0, 30.0, 0.0, -50.0])
    nearest = joints_for_pose(robot, flange_placement(robot, q), near_rad=q)[0]
    np.testing.assert_allclose(nearest, q, atol=1e-6)


def test_whole_turns_within_the_limits_are_solutions_of_their_own():
    robot = load_robot("ur_ur5e")
    q = np.radians([10.0, -80.0, 70.0, -60.0, -90.0, -30.0])
    turned = q + np.array([0.0, 0.0, 0.0, 0.0, 0.0, math.tau])
    solutions = joints_for_pose(robot, flange_placement(robot, q), near_rad=turned - 0.1)
    same = solutions[np.abs(_wrapped(solutions - q)).max(axis=1) < 1e-6]
    assert len(same) == 2**5  # joint 3 alone turns less than a full turn from its middle
    np.testing.assert_allclose(solutions[0], turned, atol=1e-6)


def test_an_arm_without_a_closed_form_is_searched():
    """Axis 3 of a KR16 tilted by 20 degrees against axis 2: no arm that is built, but any URDF may say so."""
    robot = load_robot("kuka_kr16_r2010_2")
    mechanism: Mechanism = robot.mechanism
    tilted = mechanism.placements[2] @ Placement.of((0.0, 0.03, 0.0), (math.radians(20.0), 0.0, 0.1))
    placements = (*mechanism.placements[:2], tilted, *mechanism.placements[3:])
    changed = Mechanism(**{**vars_of(mechanism), "placements": placements})
    robot = robot.variant(mechanism=changed)
    assert geometry_of(changed).solutions(flange_placement(robot, robot.home_rad), robot.home_rad) is None
    for q in random_configurations(robot, 3, seed=4):
        solutions = joints_for_pose(robot, flange_placement(robot, q), near_rad=q)
        np.testing.assert_allclose(solutions[0], q, atol=1e-6)
        assert len(solutions) > 1


def vars_of(mechanism: Mechanism) -> dict:
    return {name: getattr(mechanism, name) for name in Mechanism.__dataclass_fields__}


def test_the_inverse_of_a_placement():
    both = inverse_of(TOOL) @ TOOL
    np.testing.assert_allclose(both.rotation, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(both.origin_m, np.zeros(3), atol=1e-15)


def test_poses_out_of_reach_and_beyond_limits_are_told():
    robot = load_robot("kuka_kr16_r2010_2")
    with pytest.raises(InputError, match=r"cannot bring its flange to x, y, z = 5000\.0, 0\.0, 0\.0 mm"):
        joints_for_pose(robot, Placement.of((5.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    beyond = np.radians([0.0, 100.0, 0.0, 0.0, 40.0, 0.0])  # joint 2 turns to 65 deg
    with pytest.raises(InputError, match=r"only with \S+ at -?\d+\.\d\d deg or so; allowed: a pose within the joint"):
        joints_for_pose(robot, flange_placement(robot, beyond))
    with pytest.raises(InputError, match="not finite"):
        joints_for_pose(robot, Placement(np.eye(3), np.array([np.nan, 0.0, 0.0])))
    with pytest.raises(InputError, match="must be six numbers"):
        joints_for_pose(robot, flange_placement(robot, robot.home_rad), near_rad=[0.0])
