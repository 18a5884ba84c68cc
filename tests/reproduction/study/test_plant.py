"""The plant: reproducible, physical, different from the entry where it should be and equal elsewhere."""

import numpy as np

from reproduction.study.config import load_study_params
from reproduction.study.plant import PlantDrives, PlantPaths, draw_plant
from robojoule.calibration.run_fit import NOISE, STATE_SPREAD
from robojoule.calibration.run_model import INERTIA_SPREAD, PRIOR_SPREAD
from robojoule.robots.drives import DriveParameters
from tests.reproduction.study import cases

NOTHING = {
    "inertia_spread": 0.0,
    "drive_spread": 0.0,
    "base_spread": 0.0,
    "load_friction": (0.0, 0.0),
    "shear_thinning": 0.0,
    "temperature_spread": 0.0,
}


def test_one_seed_gives_one_plant_and_the_payload_changes_nothing():
    one, two = draw_plant(cases.nominal(), 3), draw_plant(cases.nominal(0.0), 3)
    np.testing.assert_array_equal(one.body_changes, two.body_changes)
    np.testing.assert_array_equal(one.drives.coulomb_nm, two.drives.coulomb_nm)
    assert not np.array_equal(one.drives.coulomb_nm, draw_plant(cases.nominal(), 4).drives.coulomb_nm)


def test_a_plant_without_spread_is_the_entry():
    batch = cases.batch(cases.plant(**NOTHING), 2, 1)
    runs, nominal = batch.paths.simulate(cases.LIMITS), batch.nominal_paths.simulate(cases.LIMITS)
    # More quadrature nodes: equal but for the kink where the bus changes its sign.
    np.testing.assert_allclose(runs.energy_j, nominal.energy_j, rtol=1e-4)


def test_the_controller_is_the_nominal_one():
    batch = cases.batch(cases.plant(), 2, 1)
    runs, nominal = batch.paths.simulate(cases.LIMITS), batch.nominal_paths.simulate(cases.LIMITS)
    np.testing.assert_array_equal(runs.duration_s, nominal.duration_s)
    assert np.median(np.abs(runs.energy_j / nominal.energy_j - 1.0)) > 0.01


def test_plants_are_further_from_the_entry_than_the_predictor_expects():
    plant = load_study_params().plant
    drives = [PRIOR_SPREAD[name] for name in ("coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2")]
    others = [PRIOR_SPREAD[name] for name in ("base_power_w", "drive_active_power_w", "rotor_inertia_kg_m2")]
    assert plant.inertia_spread > INERTIA_SPREAD
    assert plant.drive_spread > max(drives)
    assert plant.base_spread > max(others)
    assert plant.temperature_spread > STATE_SPREAD
    assert plant.noise > NOISE


def test_each_tree_has_its_own_temperature():
    plant = cases.plant()
    nominal = cases.batch(plant, 2, 1).nominal_paths
    tree = np.repeat([0, 1], nominal.motions // 2)
    both = PlantPaths(plant, nominal, tree, [0.7, 1.4]).simulate(cases.LIMITS).energy_j
    for place, factor in enumerate((0.7, 1.4)):
        alone = PlantPaths(plant, nominal, np.zeros_like(tree), [factor]).simulate(cases.LIMITS).energy_j
        np.testing.assert_allclose(both[tree == place], alone[tree == place], rtol=1e-12)
    rows = np.array([nominal.motions - 1, 0])
    some = PlantPaths(plant, nominal, tree, [0.7, 1.4]).subset(rows).simulate(cases.LIMITS).energy_j
    np.testing.assert_allclose(some, both[rows], rtol=1e-12)


def test_viscous_friction_thins_with_speed_and_is_whole_at_the_limit():
    joint = np.ones(1)
    common = dict.fromkeys(("gear_ratio", "rotor_inertia_kg_m2", "copper_w_per_nm2"), joint) | {
        "coulomb_nm": joint * 0.0,
        "viscous_nm_s_per_rad": joint * 5.0,
    }
    scalars = dict.fromkeys(
        ("base_power_w", "drive_active_power_w", "inverter_efficiency", "regeneration_efficiency"), 1.0
    ) | {"torque_use": 0.9, "torque_floor": 0.1, "filter_time_s": 0.05}
    drives = PlantDrives(**common, **scalars, velocity_limit_rad_s=2.0, shear_thinning=0.2)
    plain = DriveParameters(**common, **scalars)
    speed = np.array([[-2.0], [-0.5], [0.5], [2.0]])
    thin, straight = (d.friction_nm(np.sign(speed), speed, np.zeros_like(speed)) for d in (drives, plain))
    np.testing.assert_allclose(thin[[0, 3]], straight[[0, 3]])
    np.testing.assert_allclose(thin[[1, 2]] / straight[[1, 2]], 0.25**-0.2)


def test_noise_is_as_large_as_asked_for():
    batch = cases.batch(cases.plant(noise=0.02), 4, 1)
    found = cases.observe(batch, cases.LIMITS, np.random.default_rng(0))
    relative = found.energy_j / batch.paths.simulate(cases.LIMITS).energy_j - 1.0
    assert 0.015 < relative.std() < 0.025
