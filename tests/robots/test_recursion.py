"""The recursion along paths against mechanics, Pinocchio's inverse dynamics and differences."""

import numpy as np
import pytest

from robojoule.robots import list_robots, load_robot
from robojoule.robots.recursion import mass_diagonal, path_points, path_regressors
from robojoule.robots.robot import Payload
from tests.robots.arms import random_mechanism, swinging_arm

G = 9.81


def expected(model, q, along):
    """m, c and g by three calls a state, shape (3, n, N)."""
    pin = pytest.importorskip("pinocchio")
    data, zero = model.createData(), np.zeros(model.nv)
    columns = []
    for state, change in zip(q.T, along.T, strict=True):
        gravity = pin.rnea(model, data, state, zero, zero).copy()
        inertia = pin.rnea(model, data, state, zero, change) - gravity
        columns.append([inertia, pin.rnea(model, data, state, change, zero) - gravity, gravity])
    return np.array(columns).transpose(1, 2, 0)


def check(mechanism, states):
    pytest.importorskip("pinocchio")
    q, along = np.random.default_rng(3).uniform(-3.0, 3.0, (2, mechanism.joint_count, states))
    found, reference = path_points(mechanism, q, along), expected(mechanism.model, q, along)
    for part, exact in ((found[:2], reference[:2]), (found[2], reference[2])):  # c of a single joint is zero
        assert np.abs(part - exact).max() <= 1e-13 * np.abs(exact).max()


@pytest.mark.parametrize("name", list_robots())
def test_every_robot_of_the_catalog(name):
    check(load_robot(name, Payload(3.0, (0.02, -0.05, 0.1))).mechanism, 12)


@pytest.mark.parametrize("joints", range(1, 8))
def test_any_axes_placements_inertias_and_gravity(joints):
    rng = np.random.default_rng(joints)
    check(random_mechanism(rng, joints, lumped=(2, 7), gravity=9.81 * rng.normal(size=3)), 20)


def test_a_pendulum():
    """Its torque is m l^2 a - m g l cos q, the angle from the level; nothing is centrifugal about its own axis."""
    arm = swinging_arm(lengths_m=(0.7,), masses_kg=(3.0,))
    q, along = np.random.default_rng(0).uniform(-3, 3, (2, 1, 30))
    inertia, centrifugal, gravity = path_points(arm, q, along)
    assert inertia == pytest.approx(3.0 * 0.7**2 * along, abs=1e-13)
    assert centrifugal == pytest.approx(0.0, abs=1e-13)
    assert gravity == pytest.approx(-3.0 * G * 0.7 * np.cos(q), abs=1e-13)


def test_two_links_in_a_plane():
    """Textbook mass matrix, velocity products and gravity of point masses at the ends of two rods."""
    (m1, m2), (l1, l2) = (2.0, 1.5), (0.5, 0.4)
    arm = swinging_arm(lengths_m=(l1, l2), masses_kg=(m1, m2))
    q, dq = np.random.default_rng(1).uniform(-3, 3, (2, 2, 40))
    c1, c2, s2, c12 = np.cos(q[0]), np.cos(q[1]), np.sin(q[1]), np.cos(q[0] + q[1])
    m11 = (m1 + m2) * l1**2 + m2 * l2**2 + 2 * m2 * l1 * l2 * c2
    m12 = m2 * l2**2 + m2 * l1 * l2 * c2
    product = m2 * l1 * l2 * s2
    inertia, centrifugal, gravity = path_points(arm, q, dq)
    assert inertia == pytest.approx(np.array([m11 * dq[0] + m12 * dq[1], m12 * dq[0] + m2 * l2**2 * dq[1]]), abs=1e-12)
    expected_c = [-product * (2 * dq[0] * dq[1] + dq[1] ** 2), product * dq[0] ** 2]
    assert centrifugal == pytest.approx(np.array(expected_c), abs=1e-12)
    outer = m2 * l2 * c12
    assert gravity == pytest.approx(-G * np.array([(m1 + m2) * l1 * c1 + outer, outer]), abs=1e-12)


def potential_and_kinetic(arm, q, dq):
    """Energies of configurations (n, N) that move by dq, from where the bodies are: V and T, shape (N,) each."""
    step = 1e-5
    places = [arm.body_placements((q + k * step * dq).T) for k in (-1, 0, 1)]
    potential, kinetic = np.zeros(q.shape[1]), np.zeros(q.shape[1])
    for number, body in enumerate(arm.bodies, start=1):
        centers = [o[number] + np.einsum("ijn,j->in", r[number], body.center_m) for r, o in places]
        velocity = (centers[2] - centers[0]) / (2 * step)
        change = (places[2][0][number] - places[0][0][number]) / (2 * step)
        spin = np.einsum("ijn,kjn->ikn", change, places[1][0][number])  # skew matrix of the angular velocity
        omega = np.einsum("jin,jn->in", places[1][0][number], np.array([spin[2, 1], spin[0, 2], spin[1, 0]]))
        potential -= body.mass_kg * arm.gravity_m_s2 @ centers[1]
        kinetic += body.mass_kg * (velocity**2).sum(axis=0) / 2
        kinetic += np.einsum("in,ij,jn->n", omega, body.inertia_kg_m2, omega) / 2
    return potential, kinetic


def test_torques_are_derivatives_of_energies():
    """g = dV/dq, q' m = 2 T, and q' c = dT/ds along q' held: energies come from finite differences of places alone."""
    rng = np.random.default_rng(2)
    arm = random_mechanism(rng, 4, gravity=(1.0, -2.0, -9.0))
    q, dq = rng.uniform(-2, 2, (2, 4, 10))
    inertia, centrifugal, gravity = path_points(arm, q, dq)
    assert (dq * inertia).sum(axis=0) == pytest.approx(2 * potential_and_kinetic(arm, q, dq)[1], rel=1e-7)
    step = 1e-4
    for joint in range(4):
        aside = np.zeros((4, 1))
        aside[joint] = step
        ends = [potential_and_kinetic(arm, q + k * aside, dq)[0] for k in (-1, 1)]
        assert gravity[joint] == pytest.approx((ends[1] - ends[0]) / (2 * step), abs=1e-6)
    ends = [potential_and_kinetic(arm, q + k * step * dq, dq)[1] for k in (-1, 1)]
    scale = np.abs(centrifugal).max()
    assert (dq * centrifugal).sum(axis=0) == pytest.approx((ends[1] - ends[0]) / (2 * step), abs=1e-5 * scale)


@pytest.mark.parametrize("joints", [1, 3, 6])
def test_regressors_equal_pinocchios(joints):
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(joints)
    arm = random_mechanism(rng, joints, lumped=(2,), gravity=9.81 * rng.normal(size=3))
    q, along = rng.uniform(-3, 3, (2, joints, 9))
    found = path_regressors(arm, q, along, np.eye(10 * joints))
    model, data, zero = arm.model, arm.model.createData(), np.zeros(joints)
    for point in range(9):
        calls = [(zero, along[:, point]), (along[:, point], zero), (zero, zero)]
        whole = [pin.computeJointTorqueRegressor(model, data, q[:, point], *call).copy() for call in calls]
        for part, exact in zip(found[..., point], (whole[0] - whole[2], whole[1] - whole[2], whole[2]), strict=True):
            exact = exact.reshape(part.shape)  # a single joint: Pinocchio gives a flat array
            assert part == pytest.approx(exact, abs=1e-12 * max(1.0, np.abs(exact).max()))


def test_regressors_are_the_torques_of_changed_bodies():
    """Torques are linear in the parameters: a difference of two arms is exact, however large."""
    rng = np.random.default_rng(5)
    arm = random_mechanism(rng, 5)
    q, along = rng.uniform(-3, 3, (2, 5, 700))  # more than one block
    directions = rng.normal(size=(50, 7)) * 0.1
    found = path_regressors(arm, q, along, directions)
    nominal = path_points(arm, q, along)
    for place, direction in enumerate(directions.T):
        difference = path_points(arm.with_changes(direction), q, along) - nominal
        assert found[:, :, place] == pytest.approx(difference, abs=1e-11 * np.abs(nominal).max())
    assert path_regressors(arm, q, along, directions[:, :0]).shape == (3, 5, 0, 700)


def test_mass_diagonal_is_that_of_the_mass_matrix():
    pin = pytest.importorskip("pinocchio")
    arm = random_mechanism(np.random.default_rng(6), 6)
    q = np.random.default_rng(7).uniform(-3, 3, (8, 6))
    data = arm.model.createData()
    exact = [np.diag(pin.crba(arm.model, data, configuration)) for configuration in q]
    assert mass_diagonal(arm, q) == pytest.approx(np.array(exact), rel=1e-12)


def test_a_point_does_not_depend_on_the_points_beside_it():
    arm = load_robot("ur_ur10e").mechanism
    q, along = np.random.default_rng(4).uniform(-3.0, 3.0, (2, 6, 4100))
    whole = path_points(arm, q, along)
    for part in (slice(0, 1), slice(3, 20), slice(1500, 4100)):
        assert np.array_equal(path_points(arm, q[:, part], along[:, part]), whole[:, :, part])
    assert path_points(arm, q[:, :0], along[:, :0]).shape == (3, 6, 0)
