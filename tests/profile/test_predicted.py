"""The physics-informed predictor: recovery, convexity, intervals, transfer, files, speed."""

from dataclasses import replace

import numpy as np
import pytest

from reproduction.study.transfer import transferred_prior
from robojoule.calibration.unknowns import Unknowns
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.predicted import fit_profile_predictor
from robojoule.profile.predictor_file import export_profile_predictor, load_profile_predictor
from tests.reproduction.study import cases

CLEAN = {"noise": 0.0, "temperature_spread": 0.0, "shear_thinning": 0.0}


@pytest.fixture(scope="module")
def noisy():
    """A predictor fitted to noisy measurements of 30 trees, and its plant."""
    plant = cases.plant()
    return plant, fit_profile_predictor(cases.nominal(), [cases.measured(plant, 30, 11)])


def test_recovers_the_hidden_parameters_from_clean_data():
    plant = cases.plant(**CLEAN)
    predictor = fit_profile_predictor(cases.nominal(), [cases.measured(plant, 30, 7)])
    unknowns = Unknowns(cases.nominal().drives, predictor.directions)
    found, truth = unknowns.drives(predictor.calibration.x), plant.drives
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


def test_profiles_are_convex_and_durations_exact(noisy):
    plant, predictor = noisy
    test = cases.batch(plant, 4, 21)
    limits = test.speed_limits(25)
    predicted = predictor.predict(test.nominal_paths, limits)
    np.testing.assert_allclose(predicted.duration_s, test.paths.simulate(limits).duration_s, rtol=1e-9)
    for motion in range(test.paths.motions):
        for cautious in (False, True):
            profile = (predicted.cautious() if cautious else predicted).enclosure(motion).above
            assert (np.diff(profile.slopes_w) > 0.0).all()
    np.testing.assert_allclose(predicted.cautious_j[:, -1], predicted.energy_j[:, -1])
    assert (predicted.cautious_j >= predicted.energy_j - 1e-9).all()


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
    assert error(predicted) < 1.5 * error(test.oracle_paths.simulate(cases.LIMITS).energy_j)


def test_predicts_a_payload_it_never_saw(noisy):
    plant, predictor = noisy
    test = cases.batch(plant, 10, 24, payload_kg=3.0)
    truth = test.oracle_paths.simulate(cases.LIMITS).energy_j
    predicted = predictor.predict(test.nominal_paths, cases.LIMITS).energy_j
    assert np.median(np.abs(predicted / truth - 1)) < 0.03


def test_files_have_stable_bytes_and_predict_the_same(noisy, tmp_path):
    plant, predictor = noisy
    for name in ("one", "two"):
        export_profile_predictor(predictor, tmp_path / name)
    for suffix in (".json", ".npz"):
        assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()
    again = load_profile_predictor(tmp_path / "one.npz")
    paths = cases.batch(plant, 2, 25).nominal_paths
    np.testing.assert_array_equal(
        again.predict(paths, cases.LIMITS).cautious_j, predictor.predict(paths, cases.LIMITS).cautious_j
    )


def test_truncated_and_foreign_files_are_refused(noisy, tmp_path):
    export_profile_predictor(noisy[1], tmp_path / "model")
    content = (tmp_path / "model.npz").read_bytes()
    (tmp_path / "model.npz").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match="holds no predictor"):
        load_profile_predictor(tmp_path / "model")
    (tmp_path / "model.npz").unlink()
    with pytest.raises(InputError, match="no such file"):
        load_profile_predictor(tmp_path / "model")


def test_another_entry_is_refused(noisy):
    robot = cases.nominal()
    changed = replace(robot.drives, base_power_w=robot.drives.base_power_w + 1.0)
    paths = MotionPaths(robot, robot.home_rad, robot.home_rad + 0.2)
    paths.robot = type("Changed", (), {"name": robot.name, "drives": changed})()
    with pytest.raises(InputError, match="fit it again"):
        noisy[1].predict(paths, cases.LIMITS)
    paths.robot = type("Other", (), {"name": "ur_ur5e", "drives": changed})()
    with pytest.raises(InputError, match="knows kuka_kr16"):
        noisy[1].predict(paths, cases.LIMITS)


def test_what_robots_share_is_transferred(noisy):
    robot, predictor = cases.nominal(), noisy[1]
    unknowns = Unknowns(robot.drives, predictor.directions)
    prior = transferred_prior(unknowns, [(unknowns, predictor.calibration)] * 4)
    coulomb = unknowns.part("coulomb")
    found = predictor.calibration.x[coulomb]
    assert abs(prior.mean[coulomb][0] - found.mean()) < abs(found.mean())  # towards what was seen
    assert (prior.mean[unknowns.part("inertial")] == 0.0).all()
    assert transferred_prior(unknowns, []).mean.tolist() == unknowns.prior().mean.tolist()
    without = fit_profile_predictor(robot, [], prior)
    np.testing.assert_array_equal(without.calibration.x, prior.mean)


def test_thinned_measurements_cover_all_speed_limits(noisy):
    plant, _ = noisy
    thin = cases.measured(plant, 3, 31)
    assert thin.energy_j.shape[1] == 3
    assert set(np.unique(thin.speed_limits)) == set(cases.LIMITS)
