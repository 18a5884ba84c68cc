"""Friction from torques alone, of a machine whose friction is known."""

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv

import robojoule as rj
from robojoule.calibration.friction import robust_fit
from robojoule.calibration.log import MeasuredLog
from robojoule.errors import InputError
from robojoule.motion.dynamics import inverse_dynamics
from tests.calibration.plant import ROBOT, Plant, make_log


@pytest.fixture(scope="module")
def plant():
    return Plant(31, load_friction=0.0, inertia_error=0.0)


@pytest.fixture(scope="module")
def columns(plant):
    found, _ = make_log(plant, 31, motions=60, torques=True)
    return {name: values for name, values in found.items() if name != "power_w"}


@pytest.fixture(scope="module")
def found(columns, tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "torques.csv"
    csv.write_csv(pa.table(columns), path)
    return rj.identify_friction(path, rj.load_robot(ROBOT, payload_kg=10))


def test_friction_is_that_of_the_machine(plant, found):
    for joint, coulomb, viscous in zip(found.joints, plant.hidden["coulomb"], plant.hidden["viscous"], strict=True):
        assert joint.identified, joint.joint
        assert abs(joint.coulomb_nm - coulomb) < max(0.1 * coulomb, 5.0 * joint.coulomb_error_nm), joint.joint
        margin = max(0.25 * viscous, 5.0 * joint.viscous_error_nm_s_per_rad)
        assert abs(joint.viscous_nm_s_per_rad - viscous) < margin, joint.joint
        assert joint.r2 > 0.95


def test_what_power_alone_tells_stays_as_it_was_and_is_named(found):
    before, after = rj.load_robot(ROBOT).file.drives, found.robot_file().drives
    assert after.base_power_w == before.base_power_w
    assert {name: joint.copper_w_per_nm2 for name, joint in after.joints.items()} == {
        name: joint.copper_w_per_nm2 for name, joint in before.joints.items()
    }
    assert "copper loss, base power" in found.warnings[0]
    assert "copper loss, base power and efficiencies as before" in after.provenance
    assert rj.Robot(found.robot_file()).takes_programs_of(ROBOT)


def test_a_wrong_torque_constant_shows_in_the_scale(columns):
    torque = np.stack([columns[f"q{joint}_torque_nm"] for joint in range(1, 7)], axis=1)
    torque[:, 1] *= 1.5
    position = np.stack([columns[f"q{joint}_rad"] for joint in range(1, 7)], axis=1)
    time = np.asarray(columns["time_s"])
    log = MeasuredLog("log", time, position, np.full(time.shape, np.nan), torque_nm=torque, has_power=False)
    found = rj.identify_friction(log, rj.load_robot(ROBOT, payload_kg=10))
    assert found.joints[1].torque_scale == pytest.approx(1.5, abs=0.1)
    assert any("by the factors given" in warning and "joint_2" in warning for warning in found.warnings)


def test_a_log_with_neither_is_refused(columns, tmp_path):
    path = tmp_path / "positions.csv"
    csv.write_csv(pa.table({name: v for name, v in columns.items() if "torque" not in name}), path)
    with pytest.raises(InputError, match="neither power nor torques"):
        rj.identify_friction(path, rj.load_robot(ROBOT))


@pytest.mark.parametrize("motions", [1, 2, 4, 50])
def test_errors_from_few_motions_do_not_vanish(motions):
    """Over many draws of noise, figures miss the truth by as much as their errors say, or less."""
    rng = np.random.default_rng(0)
    windows, draws = 200, 60
    direction = np.where(np.arange(windows) % 2, 1.0, -1.0)
    speed = direction * rng.uniform(0.2, 1.0, windows)
    basis = np.stack([rng.normal(0.0, 30.0, windows), direction, speed, np.ones(windows)], axis=1)
    true = np.array([1.0, 20.0, 5.0, 0.0])
    motion = np.arange(windows) * motions // windows
    missed = []
    for _ in range(draws):
        found, error = robust_fit(basis, basis @ true + rng.normal(0.0, 5.0, windows), motion)
        missed.append((found - true) / error)
    assert np.sqrt(np.mean(np.square(missed), axis=0)) == pytest.approx(1.0, abs=0.35)


def test_an_arm_that_never_stops_does_not_tell_friction_in_noise():
    """One motion of 11 s in 30 Nm of noise: what is told is not surer than it is true."""
    robot = rj.load_robot(ROBOT, payload_kg=10)
    time, phase = np.arange(0.0, 11.0, 0.004), np.arange(6)
    size, pace = np.array([0.8, 0.3, 0.4, 0.6, 0.5, 0.7]), np.array([1.1, 0.9, 1.3, 1.7, 1.5, 1.9])
    angle = np.outer(time, pace) + phase
    q, qd, qdd = robot.home_rad + size * np.sin(angle), size * pace * np.cos(angle), -size * pace**2 * np.sin(angle)
    drives = robot.drives
    friction = drives.coulomb_nm * np.sign(qd) + drives.viscous_nm_s_per_rad * qd
    torque = inverse_dynamics(robot, q, qd, qdd) + drives.reflected_inertia_kg_m2 * qdd + friction
    torque += np.random.default_rng(0).normal(0.0, 30.0, q.shape)
    log = MeasuredLog("log", time, q, np.full(time.shape, np.nan), qd, torque_nm=torque, has_power=False)
    found = rj.identify_friction(log, robot)
    for joint, coulomb, viscous in zip(found.joints, drives.coulomb_nm, drives.viscous_nm_s_per_rad, strict=True):
        if joint.identified:
            assert abs(joint.coulomb_nm - coulomb) < 3.0 * joint.coulomb_error_nm
            assert abs(joint.viscous_nm_s_per_rad - viscous) < 3.0 * joint.viscous_error_nm_s_per_rad
    assert not all(joint.identified for joint in found.joints)
