"""Path-projected torques against full inverse dynamics and against mechanics."""

import numpy as np
import pinocchio as pin
import pytest

from robojoule.dynamics import chebyshev_basis, chebyshev_nodes, inverse_dynamics, node_count, path_torques
from tests.core_cases import hard_paths, kr16, random_motions


@pytest.fixture(scope="module")
def robot():
    return kr16()


def test_projection_equals_full_inverse_dynamics_at_random_states(robot):
    start, end = random_motions(robot, 20)
    delta = end - start
    torques = path_torques(robot, start, delta)
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


def test_far_motions_have_enough_nodes(robot):
    paths = hard_paths(robot)
    for coefficients in (paths.torques.inertia_nm_s2, paths.torques.velocity_nm_s2, paths.torques.gravity_nm):
        tail = np.abs(coefficients[:, -4:]).max()
        assert tail <= 1e-9 * np.abs(coefficients).max()


def test_batched_inverse_dynamics_equals_pinocchios_own_call(robot):
    rng = np.random.default_rng(0)
    q, qd, qdd = rng.normal(size=(3, 7, 6))
    data = robot.model.createData()
    expected = np.array([pin.rnea(robot.model, data, *state) for state in zip(q, qd, qdd, strict=True)])
    assert np.array_equal(inverse_dynamics(robot, q, qd, qdd), expected)


def test_turning_joint_1_changes_nothing(robot):
    start, end = random_motions(robot, 10)
    delta = end - start
    turned = start.copy()
    turned[:, 0] += np.linspace(-2, 2, 10)
    here, there = path_torques(robot, start, delta), path_torques(robot, turned, delta)
    for name in ("inertia_nm_s2", "velocity_nm_s2", "gravity_nm"):
        a, b = getattr(here, name), getattr(there, name)
        assert np.abs(a - b).max() <= 1e-12 * max(1.0, np.abs(a).max())


def test_nodes_and_basis():
    nodes = chebyshev_nodes(9)
    assert nodes[[0, 4, 8]] == pytest.approx([0.0, 0.5, 1.0])
    basis = chebyshev_basis(nodes, 5)
    for k in range(5):
        assert basis[:, k] == pytest.approx(np.cos(k * np.arccos(np.clip(2 * nodes - 1, -1, 1))), abs=1e-12)


def test_node_count_grows_with_travel():
    counts = [node_count(np.full((1, 6), travel)) for travel in (0.0, 0.5, 2.0, 6.0, 50.0)]
    assert counts == sorted(counts)
    assert counts[-1] >= 600
    assert node_count(np.zeros((0, 6))) == counts[0]
