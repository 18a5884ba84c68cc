import json

import numpy as np
import pytest

from robojoule.robots import catalog_path, list_robots, load_robot_file
from robojoule.robots.anchors import load_anchors
from robojoule.robots.effort import EffortRule, limits, needs
from robojoule.robots.scaling import JointNumbers, load_scaling, main, rebuilt_entries
from tests.robots.arms import arm_file


@pytest.fixture(scope="module")
def scaling():
    return load_scaling()


@pytest.fixture(scope="module")
def rebuilt():
    return rebuilt_entries()


def assert_equal_figures(found, expected, key):
    """Equal, floats up to one step of the last significant digit kept."""
    if isinstance(found, dict):
        assert list(found) == list(expected), key
        for name in found:
            assert_equal_figures(found[name], expected[name], f"{key}.{name}")
    elif isinstance(found, list):
        assert len(found) == len(expected), key
        for index, pair in enumerate(zip(found, expected, strict=True)):
            assert_equal_figures(*pair, f"{key}.{index}")
    elif isinstance(found, float):
        assert found == pytest.approx(expected, rel=1e-3, abs=1e-12), key
    else:
        assert found == expected, key


def test_committed_entries_are_what_the_laws_give(rebuilt):
    """If this fails because an anchor has changed: python -m robojoule.robots.scaling."""
    assert set(rebuilt) == set(list_robots()) - {load_anchors().fitted}
    for name, data in rebuilt.items():
        assert_equal_figures(data, json.loads(catalog_path(name).read_text()), name)


def test_check_mode_changes_nothing(capsys):
    before = {name: catalog_path(name).read_bytes() for name in list_robots()}
    main(["--check"])
    assert before == {name: catalog_path(name).read_bytes() for name in list_robots()}


def test_the_laws_give_the_anchor_back(scaling):
    """Scaling the reference robot to its own size changes nothing but the copper loss, which is handed on unfitted."""
    effort, velocity = limits(scaling.reference)
    drives = scaling.numbers(scaling.anchors.fitted, effort).drives(effort, velocity)
    for index, joint in enumerate(scaling.reference.moving_joints):
        own = scaling.reference.drives.joints[joint.name]
        for key, values in drives.items():
            if key != "copper_w_per_nm2":
                assert values[index] == pytest.approx(getattr(own, key), rel=1e-12)
    loss = drives["copper_w_per_nm2"] * (effort / drives["gear_ratio"]) ** 2
    assert loss / (effort * velocity) == pytest.approx(np.full(6, scaling.anchors.copper_share))
    installed = scaling.reference.installed_power_w
    assert scaling.base_power_w(installed, cobot=False) == pytest.approx(scaling.reference.drives.base_power_w)


def test_kr300_comes_out_at_its_own_size(scaling):
    """At the KR300's limits: its gears, rotors and Coulomb friction."""
    effort, velocity = scaling.kr300_limits
    drives = scaling.numbers("kuka_kr210_r2700_2", effort).drives(effort, velocity)
    kr300, friction = scaling.kr300, scaling.kr300.friction
    np.testing.assert_allclose(drives["gear_ratio"], kr300.gear_ratio, rtol=1e-9)
    np.testing.assert_allclose(drives["rotor_inertia_kg_m2"], kr300.rotor_inertia_kg_m2, rtol=1e-9)
    np.testing.assert_allclose(drives["coulomb_nm"], np.add(friction.coulomb_nm, friction.tanh_nm), rtol=1e-9)
    assert np.all(drives["viscous_nm_s_per_rad"] < friction.viscous_nm_s_per_rad)  # less than the line beyond its range


def test_kr300_limits_are_near_its_data_sheet(scaling):
    """Interpolated speeds against the data sheet's 105, 101, 107, 140, 113, 180 deg/s."""
    speeds = np.degrees(scaling.kr300_limits[1])
    np.testing.assert_allclose(speeds, [105, 101, 107, 140, 113, 180], rtol=0.25)


def test_ur10e_keeps_its_identified_friction():
    file = load_robot_file("ur_ur10e")
    joints = [file.drives.joints[joint.name] for joint in file.moving_joints]
    assert [joint.coulomb_nm for joint in joints] == [12.5, 13.3, 5.0, 2.0, 2.7, 2.3]
    assert [joint.viscous_nm_s_per_rad for joint in joints] == [21.3, 20.2, 10.4, 3.6, 2.5, 3.0]


def test_beyond_the_anchors_numbers_are_held(scaling):
    """No extrapolation: a tenth of the reference robot's efforts gives its numbers, ten times the KR300's gives its."""
    small = scaling.numbers("kuka_kr4_r600", limits(scaling.reference)[0] / 10)
    large = scaling.numbers("kuka_kr500_r2800_2", scaling.kr300_limits[0] * 10)
    np.testing.assert_allclose(small.spin_up_s, scaling.reference_numbers.spin_up_s)
    np.testing.assert_allclose(large.spin_up_s, scaling.kr300_numbers.spin_up_s)


def test_numbers_and_drives_are_inverse():
    rng = np.random.default_rng(0)
    effort, velocity = rng.uniform(10, 1000, 6), rng.uniform(1, 10, 6)
    keys = ("gear_ratio", "rotor_inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2")
    drives = {key: rng.uniform(0.1, 10, 6) for key in keys}
    back = JointNumbers.of(effort, velocity, drives).drives(effort, velocity)
    for key, values in drives.items():
        np.testing.assert_allclose(back[key], values, rtol=1e-12)


def test_similar_machines_have_equal_numbers():
    """The idea of the laws, by dimension: a machine twice as long, eight times as heavy, turning half as fast."""
    effort, velocity, gear = np.array([100.0]), np.array([4.0]), np.array([50.0])
    small = {"gear_ratio": gear, "coulomb_nm": effort * 0.02, "viscous_nm_s_per_rad": effort * 0.1 / velocity}
    small |= {"rotor_inertia_kg_m2": np.array([1e-4]), "copper_w_per_nm2": np.array([4.0])}
    twice = JointNumbers.of(effort, velocity, small).drives(16 * effort, velocity / 2)
    assert twice["gear_ratio"] == pytest.approx(2 * gear)
    assert twice["coulomb_nm"] / (16 * effort) == pytest.approx(0.02)
    motor_torque = (16 * effort / twice["gear_ratio"]) / (effort / gear)
    loss = twice["copper_w_per_nm2"] * (16 * effort / twice["gear_ratio"]) ** 2
    assert loss / (4.0 * (effort / gear) ** 2) == pytest.approx(motor_torque)


def test_effort_rule_meets_arms_that_it_was_not_made_from(scaling):
    """Leave one out: every published effort limit of an arm within a factor of 2.5, half of them within 1.35."""
    ratios = []
    for name, file in scaling.files.items():
        if file.provenance["effort"].kind != "published" or name in scaling.anchors.cobots.names:
            continue
        rule = scaling.effort_rule(cobot=False, without=name)
        ratios.append(rule.effort_nm(file) / limits(file)[0])
    off = np.abs(np.log(ratios))
    assert np.exp(off.max()) < 2.5
    assert np.exp(np.median(off)) < 1.35


def test_effort_rule_gives_its_own_arm_back():
    file = load_robot_file("kuka_kr16_r2010_2")
    np.testing.assert_allclose(EffortRule.of(file, counterbalanced=False).effort_nm(file), limits(file)[0], rtol=1e-9)


def test_needs_of_one_rod():
    """A rod about a vertical axis needs no holding torque; its inertia is m l^2 / 3 and the payload's."""
    gravity, inertia = needs(arm_file(1))
    assert gravity == pytest.approx([0.0], abs=1e-12)
    radius = (3 * 1.0 / (4 * np.pi * 2700)) ** (1 / 3)
    assert inertia == pytest.approx([4.0 * 0.25 / 3 + 1.0 * 0.6**2 + 0.4 * radius**2], rel=1e-9)


def test_placeholders_are_marked_as_scaled():
    for name in list_robots():
        kind = load_robot_file(name).provenance["effort"].kind
        assert kind == ("scaled" if name.startswith("fanuc_") else "published")
