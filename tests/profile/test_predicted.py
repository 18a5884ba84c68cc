"""Predicting profiles: convexity, durations, files, what is refused; the reference predictor."""

import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from robojoule.calibration.run_model import run_parameters
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.predicted import calibrated_predictor
from robojoule.profile.predictor_file import load_profile_predictor, save_profile_predictor
from robojoule.profile.reference import TRAINED, reference_predictor
from robojoule.robots import load_robot
from robojoule.robots.drives import DriveParameters
from robojoule.robots.robot import Payload, Robot
from tests.reproduction.study import cases


@pytest.fixture(scope="module")
def noisy():
    """A predictor calibrated on noisy runs of a few trees, and its plant."""
    plant = cases.plant()
    return plant, calibrated_predictor(cases.nominal(), [cases.measured(plant, 8, 11)])


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


def test_files_have_stable_bytes_and_predict_the_same(noisy, tmp_path):
    plant, predictor = noisy
    for name in ("one", "two"):
        save_profile_predictor(predictor, tmp_path / name)
    for name in ("predictor.json", "predictor.npz"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    again = load_profile_predictor(tmp_path / "one")
    assert again.note == predictor.note
    paths = cases.batch(plant, 2, 25).nominal_paths
    np.testing.assert_array_equal(
        again.predict(paths, cases.LIMITS).cautious_j, predictor.predict(paths, cases.LIMITS).cautious_j
    )


def test_truncated_and_foreign_files_are_refused(noisy, tmp_path):
    save_profile_predictor(noisy[1], tmp_path / "model")
    arrays = tmp_path / "model" / "predictor.npz"
    content = arrays.read_bytes()
    arrays.write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match=r"predictor.npz: the file does not hold a predictor"):
        load_profile_predictor(tmp_path / "model")
    arrays.unlink()
    with pytest.raises(InputError, match="no such file"):
        load_profile_predictor(tmp_path / "model")


@pytest.mark.parametrize(
    ("name", "spoil", "message"),
    [
        ("covariance", lambda a: a[:-1], "the array 'covariance' has shape"),
        ("residual_mean", lambda a: a[:-1], "the array 'residual_mean' has shape"),
        ("directions", lambda a: a[:-10], "the inertial directions have shape"),
        ("nominal_coulomb_nm", lambda a: a[:-1], "the figures of the drives do not fit together"),
        ("unknowns", lambda a: np.full_like(a, np.nan), "not finite numbers"),
        ("unknowns", lambda a: np.array([{"code": 1}] * len(a), dtype=object), "does not hold a predictor"),
        ("unknowns", lambda a: None, "the array 'unknowns' is missing"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(noisy, tmp_path, name, spoil, message):
    save_profile_predictor(noisy[1], tmp_path)
    with np.load(tmp_path / "predictor.npz") as stored:
        arrays = {key: stored[key] for key in stored.files}
    arrays[name] = spoil(arrays[name])
    np.savez(tmp_path / "predictor.npz", **{key: array for key, array in arrays.items() if array is not None})
    with pytest.raises(InputError, match=message):
        load_profile_predictor(tmp_path)


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


def test_without_runs_it_is_nominal_physics_with_a_wide_interval(noisy):
    plant, calibrated = noisy
    test = cases.batch(plant, 6, 26)
    nominal = calibrated_predictor(cases.nominal())
    found, known = (predictor.predict(test.nominal_paths, cases.LIMITS) for predictor in (nominal, calibrated))
    truth = test.paths.simulate(cases.LIMITS).energy_j
    assert np.median(np.abs(known.energy_j / truth - 1)) < np.median(np.abs(found.energy_j / truth - 1))
    widths = [np.median((p.upper_j - p.lower_j) / p.energy_j) for p in (found, known)]
    assert widths[0] > 2.0 * widths[1]
    assert ((truth >= found.lower_j) & (truth <= found.upper_j)).mean() > 0.6
    assert "nominal physics" in nominal.note
    assert calibrated.note.startswith("calibrated on ")


@pytest.fixture(scope="module")
def reference():
    return reference_predictor(cases.nominal())


def test_the_trained_predictor_is_of_the_present_catalog_entry(reference):
    """If it is not, run the pipeline and `python -m reproduction.profile_predictor.publish`."""
    robot = cases.nominal()
    nominal = run_parameters(robot.drives, reference.directions).nominal
    for field in fields(DriveParameters):
        np.testing.assert_array_equal(getattr(reference.nominal, field.name), getattr(nominal, field.name))
    assert [path.name for path in sorted(TRAINED.iterdir())] == [robot.name]
    assert reference.robot == robot.name
    assert "simulated runs" in reference.note


def test_the_trained_predictor_holds_simulated_energies_of_new_trees_in_its_interval(reference):
    """Freshly drawn trees, which no part of the training or of its judgement saw."""
    paths = cases.batch(cases.plant(), 25, 4711).nominal_paths  # the machine is the entry itself
    limits = np.linspace(0.1, 1.0, 19)
    truth = paths.simulate(limits).energy_j
    found = reference.predict(paths, limits)
    moving = paths.moving
    assert np.abs(found.energy_j / truth - 1.0)[moving].max() < 5e-3
    assert ((truth >= found.lower_j) & (truth <= found.upper_j))[moving].mean() > 0.75
    np.testing.assert_allclose(found.idle_start_w, paths.idle_power_start_w, rtol=1e-3)


def test_other_robots_and_changed_ones_get_nominal_physics(reference):
    stranger = load_robot("ur_ur10e", Payload(2.0))
    robot = load_robot("kuka_kr16_r2010_2", Payload(10.0))
    changed = robot.variant(drives=replace(robot.drives, base_power_w=robot.drives.base_power_w * 1.1))
    heavier = Robot(robot.file.model_copy(update={"rated_payload_kg": 17.0}), robot.payload)
    for robot in (stranger, changed, heavier):
        predictor = reference_predictor(robot)
        assert predictor.note.startswith(f"no run of {robot.name} is known: nominal physics")
        paths = MotionPaths(robot, robot.home_rad, robot.home_rad + 0.2)
        found = predictor.predict(paths, cases.LIMITS)
        np.testing.assert_allclose(found.energy_j, paths.simulate(cases.LIMITS).energy_j, rtol=0.2)
        half_width = (found.upper_j - found.lower_j)[0] / 2.0 / found.energy_j[0]
        assert half_width.min() > 0.03


def test_predicting_needs_numpy_alone():
    code = (
        "import sys, numpy as np\n"
        "from robojoule.profile.reference import reference_predictor\n"
        "from robojoule.motion.simulation import MotionPaths\n"
        "from robojoule.robots import load_robot\n"
        "robot = load_robot('kuka_kr16_r2010_2')\n"
        "paths = MotionPaths(robot, robot.home_rad, robot.home_rad + 0.3)\n"
        "print(reference_predictor(robot).predict(paths, [0.1, 0.5, 1.0]).energy_j[0].min() > 0.0)\n"
        "heavy = {'sklearn', 'scipy', 'pandas', 'joblib', 'threadpoolctl', 'mlflow', 'pyarrow', 'reproduction'}\n"
        "print(sorted({name.split('.')[0] for name in sys.modules} & heavy))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "[]"]
