"""Path-projected torques against full inverse dynamics and against mechanics."""

from dataclasses import replace

import numpy as np
import pytest

from robojoule.motion.corners import Corners
from robojoule.motion.dynamics import (
    LIMIT_NODES,
    chebyshev_basis,
    chebyshev_nodes,
    inverse_dynamics,
    node_counts,
    path_torques,
)
from robojoule.motion.path import StraightPath
from robojoule.robots import list_robots, load_robot
from robojoule.robots.robot import Payload, Robot
from tests.core_cases import hard_paths, kr16, random_motions
from tests.motion.chains import random_chains
from tests.robots.arms import arm_file, random_mechanism


@pytest.fixture(scope="module")
def robot():
    return kr16()


def test_projection_equals_full_inverse_dynamics_at_random_states(robot):
    pin = pytest.importorskip("pinocchio")
    start, end = random_motions(robot, 20)
    delta = end - start
    torques = path_torques(robot, StraightPath(start, delta))
    rng = np.random.default_rng(5)
    data = robot.model.createData()
    for motion in range(len(start)):
        s, s1, s2 = rng.uniform(0, 1), rng.uniform(0, 4), rng.uniform(-20, 20)
        basis = chebyshev_basis(np.array([s]), torques.inertia_nm_s2.shape[1])
        projected = (
            basis @ torques.inertia_nm_s2[motion] * s2
            + basis @ torques.velocity_nm_s2[motion] * s1**2
            + basis @ torques.gravity_nm[motion]
        )[0]
        full = pin.rnea(robot.model, data, start[motion] + s * delta[motion], delta[motion] * s1, delta[motion] * s2)
        assert projected == pytest.approx(full, abs=1e-9 * max(1.0, np.abs(full).max()))


def test_series_end_below_rounding(robot):
    paths = hard_paths(robot)
    for torques in (paths.torques, path_torques(robot, StraightPath.between(*random_motions(robot, 200)))):
        for motion, count in enumerate(torques.counts):
            tail = np.abs(torques.coefficients[motion, :, count - 2 : count]).max()
            assert tail <= 1e-9 * np.abs(torques.coefficients[motion]).max()


@pytest.mark.parametrize("arm", [kr16(), Robot(arm_file(1))], ids=lambda arm: f"{arm.joint_count} joints")
def test_batched_inverse_dynamics_equals_pinocchios_own_call(arm):
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(0)
    q, qd, qdd = rng.normal(size=(3, 7, arm.joint_count))
    data = arm.model.createData()
    expected = np.array([pin.rnea(arm.model, data, *state) for state in zip(q, qd, qdd, strict=True)])
    assert np.array_equal(inverse_dynamics(arm, q, qd, qdd), expected)


def assert_engines_agree(arm, q, qd, qdd):
    pytest.importorskip("pinocchio")
    own, theirs = (inverse_dynamics(arm, q, qd, qdd, engine=engine) for engine in ("recursion", "pinocchio"))
    assert own.shape == q.shape
    assert np.abs(own - theirs).max(initial=0.0) <= 1e-9 * max(1.0, np.abs(theirs).max(initial=0.0))
    assert np.array_equal(inverse_dynamics(arm, q, qd, qdd), theirs)  # which is chosen where it is installed


@pytest.mark.parametrize("joints", range(1, 8))
@pytest.mark.parametrize("lumped", [(), (1,), (2, 3, 6, 7)], ids=["all bodies", "first lumped", "wrist lumped"])
@pytest.mark.parametrize(
    "tilt", [(0.0, 0.0, -9.81), (9.81, 0.0, 0.0), (-3.0, 6.0, 7.0)], ids=["floor", "wall", "tilted"]
)
def test_engines_agree_on_any_arm(joints, lumped, tilt):
    rng = np.random.default_rng(joints)
    arm = Robot(arm_file(joints)).variant(mechanism=random_mechanism(rng, joints, lumped=lumped, gravity=tilt))
    assert_engines_agree(arm, *rng.uniform(-4.0, 4.0, (3, 30, joints)) * np.array([1.0, 2.0, 20.0])[:, None, None])


@pytest.mark.parametrize("name", ["kuka_kr16_r2010_2", "fanuc_r2000ic_165f", "ur_ur3e"])
def test_engines_agree_in_hard_states(name):
    """At rest, at the limits at full speed, one joint alone, far beyond a turn, and no state at all."""
    arm = load_robot(name, Payload(2.0, (0.1, -0.05, 0.2)))
    zero = np.zeros((1, 6))
    one = np.eye(6) * arm.velocity_rad_s
    many = np.repeat(arm.upper_rad[None], 6, axis=0)
    assert_engines_agree(arm, zero, zero, zero)
    assert_engines_agree(arm, many, one, 10.0 * one)
    assert_engines_agree(arm, many, np.zeros((6, 6)), 10.0 * one)
    assert_engines_agree(arm, np.full((1, 6), 300.0), zero + arm.velocity_rad_s, zero - 50.0)
    assert_engines_agree(arm, zero[:0], zero[:0], zero[:0])


def test_turning_joint_1_changes_nothing(robot):
    start, end = random_motions(robot, 10)
    delta = end - start
    turned = start.copy()
    turned[:, 0] += np.linspace(-2, 2, 10)
    here, there = path_torques(robot, StraightPath(start, delta)), path_torques(robot, StraightPath(turned, delta))
    for name in ("inertia_nm_s2", "velocity_nm_s2", "gravity_nm"):
        a, b = getattr(here, name), getattr(there, name)
        assert np.abs(a - b).max() <= 1e-12 * max(1.0, np.abs(a).max())


def test_nodes_and_basis():
    nodes = chebyshev_nodes(9)
    assert nodes[[0, 4, 8]] == pytest.approx([0.0, 0.5, 1.0])
    basis = chebyshev_basis(nodes, 5)
    for k in range(5):
        assert basis[:, k] == pytest.approx(np.cos(k * np.arccos(np.clip(2 * nodes - 1, -1, 1))), abs=1e-12)


def test_node_counts_grow_with_travel(robot):
    travel = np.array([0.0, 0.5, 2.0, 6.0, 60.0])
    counts = node_counts(robot, np.repeat(travel[:, None], 6, axis=1))
    assert np.all(np.diff(counts) >= 0)
    assert counts[-1] >= 600
    assert node_counts(robot, np.zeros((0, 6))).shape == (0,)


def test_a_first_joint_about_the_vertical_needs_no_nodes(robot):
    delta = np.array([[6.0, 0, 0, 0, 0, 0], [0, 6.0, 0, 0, 0, 0]])
    counts = node_counts(robot, delta)
    assert counts[0] == node_counts(robot, np.zeros((1, 6)))[0] < counts[1]
    leaning = robot.variant(mechanism=replace(robot.mechanism, gravity_m_s2=np.array([5.0, 0.0, -8.0])))
    assert node_counts(leaning, delta)[0] == counts[1]
    start = np.zeros((2, 6))
    exact = path_torques(leaning, StraightPath(start, delta), 60)
    assert path_torques(leaning, StraightPath(start, delta)).gravity_nm[0] == pytest.approx(
        exact.gravity_nm[0, : counts[1]], abs=1e-7
    )


def test_values_for_torque_limits_are_those_of_full_inverse_dynamics(robot):
    start, end = random_motions(robot, 8)
    delta = (end - start) * np.linspace(0.2, 2.0, 8)[:, None]
    torques = path_torques(robot, StraightPath(start, delta))
    inertia, _, gravity = torques.at_nodes
    assert inertia.shape[1] >= LIMIT_NODES
    zero = np.zeros_like(start)
    for at, place in ((0, start), (-1, start + delta)):
        expected = inverse_dynamics(robot, place, zero, zero)
        assert gravity[:, at] == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
        assert inertia[:, at] == pytest.approx(
            inverse_dynamics(robot, place, zero, delta) - expected, abs=1e-9 * np.abs(inertia).max()
        )


def test_a_motion_does_not_depend_on_its_companions(robot):
    start, end = random_motions(robot, 60)
    torques = path_torques(robot, StraightPath(start, end - start))
    assert len(np.unique(torques.counts)) > 1
    for part in (slice(0, 1), slice(7, 25), slice(20, 60)):
        alone = path_torques(robot, StraightPath(start[part], (end - start)[part]))
        width = alone.coefficients.shape[2]
        assert np.array_equal(alone.counts, torques.counts[part])
        assert np.array_equal(alone.coefficients, torques.coefficients[part, :, :width])
        for found, expected in zip(alone.at_nodes, torques.at_nodes, strict=True):
            assert np.array_equal(found[:, -1], expected[part, -1])


@pytest.mark.parametrize("name", list_robots())
def test_engines_agree_along_paths_of_every_robot(name):
    """Torque terms to 1e-9 of the largest, at the nodes where limits are looked at."""
    arm = load_robot(name)
    path = StraightPath.between(*random_motions(arm, 30))
    found, expected = (path_torques(arm, path, engine=engine).at_nodes for engine in ("recursion", "pinocchio"))
    for own, theirs in zip(found, expected, strict=True):
        assert np.abs(own - theirs).max() <= 1e-9 * np.abs(theirs).max()


def test_curves_need_no_more_nodes_than_they_get():
    """Corners with their curvature: the series of their own number of nodes against one of many more."""
    robot = kr16()
    pieces = Corners.of(robot, random_chains(robot)).pieces
    torques, exact = path_torques(robot, pieces), path_torques(robot, pieces, 60)
    s = np.linspace(0.0, 1.0, 50)
    found, expected = (
        np.matmul(one.coefficients, chebyshev_basis(s, one.coefficients.shape[2]).T) for one in (torques, exact)
    )
    size = np.abs(expected).max(axis=2, keepdims=True)
    assert np.abs(found - expected).max() <= 1e-7 * size.max()
    assert (np.abs(found - expected) <= 1e-6 * size + 1e-9).all()
