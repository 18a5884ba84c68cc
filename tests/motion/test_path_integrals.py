"""Path integrals against the simulation, their derivatives against differences."""

from dataclasses import replace

import numpy as np
import pytest

from robojoule.calibration.inertial import draw_errors, inertial_directions
from robojoule.calibration.run_model import evaluate_runs, run_parameters
from robojoule.errors import InputError
from robojoule.motion.path_integrals import PathIntegrals
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload

LIMITS = np.array([0.1, 0.25, 0.5, 0.8, 1.0])


def changed(robot, changes, drives=None):
    """The robot with changed bodies and, if given, other drives."""
    return robot.variant(drives=drives, mechanism=robot.mechanism.with_changes(changes))


def motions(robot, count=12):
    rng = np.random.default_rng(4)
    start = robot.home_rad + rng.uniform(-0.5, 0.5, (count, 6))
    end = start + rng.uniform(-0.9, 0.9, (count, 6))
    end[2] = start[2]  # no motion at all
    end[3, :5] = start[3, :5]  # one joint only
    return start, end


@pytest.fixture(scope="module", params=["kuka_kr16_r2010_2", "ur_ur5e", "kuka_kr500_r2800_2", "fanuc_lrmate200id"])
def case(request):
    robot = load_robot(request.param, Payload(3.0))
    start, end = motions(robot)
    directions = inertial_directions(robot, 12, 0.15)
    paths = MotionPaths(robot, start, end)
    integrals = PathIntegrals(paths, LIMITS, directions)
    vector = run_parameters(robot.drives, directions)
    x = 0.2 * np.random.default_rng(1).standard_normal(vector.size)
    return robot, start, end, directions, integrals, vector, x


def test_equal_the_simulation_of_a_robot_with_the_same_parameters(case):
    robot, start, end, directions, integrals, vector, x = case
    drives = vector.drives(x)
    plant = MotionPaths(changed(robot, directions @ vector.inertial(x), drives), start, end, controller=robot)
    expected = plant.simulate(LIMITS)
    found = integrals.evaluate(drives, vector.inertial(x))
    np.testing.assert_allclose(integrals.duration_s, expected.duration_s, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.energy_j, expected.energy_j, rtol=1e-6)
    np.testing.assert_allclose(found.idle_w[:, 0], plant.idle_power_start_w, rtol=1e-9)
    np.testing.assert_allclose(found.idle_w[:, 1], plant.idle_power_end_w, rtol=1e-9)
    assert (found.energy_j[2] == 0.0).all()


def test_derivatives_are_those_of_the_energies(case):
    *_, integrals, vector, x = case
    found = evaluate_runs(vector, integrals, x)
    gradient, idle = found.energy_jacobian, found.idle_jacobian
    for place in range(vector.size):
        step = np.zeros(vector.size)
        step[place] = 1e-5
        above, below = (integrals.evaluate(vector.drives(y), vector.inertial(y)) for y in (x + step, x - step))
        difference = (above.energy_j - below.energy_j) / 2e-5
        tolerance = 1e-4 * np.abs(difference).max() + 1e-5
        np.testing.assert_allclose(gradient[..., place], difference, atol=tolerance)
        np.testing.assert_allclose(idle[..., place], (above.idle_w - below.idle_w) / 2e-5, rtol=1e-5, atol=1e-4)


def test_viscosity_scales_viscous_friction_only(case):
    *_, integrals, vector, x = case
    drives = vector.drives(x)
    factor = np.linspace(0.8, 1.3, len(integrals.delta_rad))
    found = integrals.evaluate(drives, vector.inertial(x), factor)
    one = replace(drives, viscous_nm_s_per_rad=drives.viscous_nm_s_per_rad * factor[5])
    np.testing.assert_allclose(found.energy_j[5], integrals.evaluate(one, vector.inertial(x)).energy_j[5], rtol=1e-12)


def test_directions_of_another_number_of_joints_are_refused(case):
    robot, start, end, directions, *_ = case
    with pytest.raises(InputError, match="bodies"):
        PathIntegrals(MotionPaths(robot, start, end), LIMITS, directions[:50])


def test_errors_keep_bodies_physical():
    robot, rng = load_robot("kuka_kr16_r2010_2"), np.random.default_rng(0)
    for body in robot.mechanism.bodies:
        for _ in range(50):
            changed = draw_errors(rng, 0.15).applied(body)
            inertia = changed.inertia_kg_m2
            assert (np.linalg.eigvalsh(np.trace(inertia) / 2 * np.eye(3) - inertia) >= -1e-12).all()
            assert abs(changed.mass_kg - body.mass_kg) <= 0.15 * body.mass_kg


def test_directions_explain_the_torques_of_drawn_errors():
    robot = load_robot("kuka_kr16_r2010_2")
    directions = inertial_directions(robot, 16, 0.15)
    rng = np.random.default_rng(2)
    start, end = motions(robot)
    nominal = MotionPaths(robot, start, end).torques.gravity_nm
    errors = [draw_errors(rng, 0.15) for _ in range(6)]
    changes = [
        e.applied(body).parameters - body.parameters for e, body in zip(errors, robot.mechanism.bodies, strict=True)
    ]
    truth = MotionPaths(changed(robot, np.concatenate(changes)), start, end).torques.gravity_nm
    per_unit = [(MotionPaths(changed(robot, d), start, end).torques.gravity_nm - nominal).ravel() for d in directions.T]
    off = (truth - nominal).ravel()
    left = off - np.stack(per_unit, axis=1) @ np.linalg.lstsq(np.stack(per_unit, axis=1), off, rcond=None)[0]
    assert np.linalg.norm(left) < 0.01 * np.linalg.norm(off)
