"""The physics-informed predictor fitted to runs of many trees: recovery, intervals, residual, transfer."""

import numpy as np
import pytest

from reproduction.profile_predictor.fit import fit_profile_predictor
from reproduction.profile_predictor.residual_fit import fit_residual
from reproduction.study.transfer import transferred_prior
from robojoule.calibration.run_model import run_parameters
from robojoule.motion.path_integrals import INERTIAL
from tests.reproduction.study import cases

CLEAN = {"noise": 0.0, "temperature_spread": 0.0, "shear_thinning": 0.0}


@pytest.fixture(scope="module")
def noisy():
    """A predictor fitted to noisy runs of 30 trees, and its plant."""
    plant = cases.plant()
    return plant, fit_profile_predictor(cases.nominal(), [cases.measured(plant, 30, 11)])


def test_recovers_the_hidden_parameters_from_clean_data():
    plant = cases.plant(**CLEAN)
    predictor = fit_profile_predictor(cases.nominal(), [cases.measured(plant, 30, 7)])
    vector = run_parameters(cases.nominal().drives, predictor.directions)
    found, truth = vector.drives(predictor.calibration.x), plant.drives
    assert found.base_power_w == pytest.approx(truth.base_power_w, rel=1e-3)
    assert found.drive_active_power_w == pytest.approx(truth.drive_active_power_w, rel=1e-2)
    # Wrists carry little: load friction shows there in many trees only; in the last joint neither it nor copper does.
    tolerances = {"coulomb_nm": 0.01, "viscous_nm_s_per_rad": 0.01, "copper_w_per_nm2": 0.01, "load_friction": 0.05}
    for name, tolerance in tolerances.items():
        np.testing.assert_allclose(getattr(found, name)[:5], getattr(truth, name)[:5], rtol=tolerance)
    test = cases.batch(plant, 6, 8)
    expected = test.paths.simulate(cases.LIMITS).energy_j
    predicted = predictor.predict(test.nominal_paths, cases.LIMITS)
    np.testing.assert_allclose(predicted.energy_j, expected, rtol=2e-3)
    np.testing.assert_allclose(predicted.idle_start_w, test.idle_prior_w, rtol=2e-3)
    np.testing.assert_allclose(predicted.idle_end_w, test.idle_post_w, rtol=2e-3)


def test_intervals_hold_the_truth_of_held_out_trees(noisy):
    plant, predictor = noisy
    test = cases.batch(plant, 40, 22)
    truth = test.paths.simulate(cases.LIMITS).energy_j
    predicted = predictor.predict(test.nominal_paths, cases.LIMITS)
    inside = (truth >= predicted.lower_j) & (truth <= predicted.upper_j)
    assert 0.8 <= inside.mean() <= 1.0
    width = (predicted.upper_j - predicted.lower_j) / predicted.energy_j / 2
    assert np.median(width) < 0.12


def test_is_nearer_than_nominal_physics_and_near_the_oracle(noisy):
    plant, predictor = noisy
    test = cases.batch(plant, 20, 23)
    truth = test.paths.simulate(cases.LIMITS).energy_j
    predicted = predictor.predict(test.nominal_paths, cases.LIMITS).energy_j

    def error(energy):
        return np.median(np.abs(energy / truth - 1))

    assert error(predicted) < 0.8 * error(test.nominal_paths.simulate(cases.LIMITS).energy_j)
    assert error(predicted) < 1.7 * error(test.oracle_paths.simulate(cases.LIMITS).energy_j)


def test_predicts_a_payload_it_never_saw(noisy):
    plant, predictor = noisy
    test = cases.batch(plant, 10, 24, payload_kg=3.0)
    truth = test.oracle_paths.simulate(cases.LIMITS).energy_j
    predicted = predictor.predict(test.nominal_paths, cases.LIMITS).energy_j
    assert np.median(np.abs(predicted / truth - 1)) < 0.03


def test_what_robots_share_is_transferred(noisy):
    robot, predictor = cases.nominal(), noisy[1]
    vector = run_parameters(robot.drives, predictor.directions)
    prior = transferred_prior(vector, [(vector, predictor.calibration)] * 4)
    coulomb = vector.part("coulomb_nm")
    found = predictor.calibration.x[coulomb]
    assert abs(prior.mean[coulomb][0] - found.mean()) < abs(found.mean())  # towards what was seen
    assert (prior.mean[vector.part(INERTIAL)] == 0.0).all()
    assert transferred_prior(vector, []).mean.tolist() == vector.prior().mean.tolist()
    without = fit_profile_predictor(robot, [], prior)
    np.testing.assert_array_equal(without.calibration.x, prior.mean)


def test_thinned_runs_cover_all_speed_limits(noisy):
    plant, _ = noisy
    thin = cases.measured(plant, 3, 31)
    assert thin.energy_j.shape[1] == 3
    assert set(np.unique(thin.speed_limits)) == set(cases.LIMITS)


def test_a_residual_is_learned_only_where_it_helps_on_other_trees():
    rng = np.random.default_rng(4)
    features, tree = rng.normal(2.0, 3.0, (600, 5)), np.arange(600) // 30
    weights = np.array([0.01, 0.0, -0.02, 0.0, 0.005])
    relative = (features - features.mean(axis=0)) / features.std(axis=0) @ weights + 0.002 * rng.standard_normal(600)
    found = fit_residual(features, relative, tree)
    assert found.gain > 0.9
    np.testing.assert_allclose(found.weights, weights, atol=1e-3)
    # The closed form of the same penalty: the mean squared error plus 1e-4 times the squared weights.
    design = (features - found.mean) / found.scale
    limit = 4.0 * 1.4826 * np.median(np.abs(relative)) + 1e-9
    normal = design.T @ design + 1e-4 * 600 * np.eye(5)
    expected = np.linalg.solve(normal, design.T @ np.clip(relative, -limit, limit))
    np.testing.assert_allclose(found.weights, expected, rtol=1e-10)
    assert not fit_residual(features, rng.standard_normal(600), tree).weights.any()
    assert not fit_residual(features, relative, tree % 9).weights.any()  # too few trees to tell
