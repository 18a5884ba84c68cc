"""Friction from torques alone, of a machine whose friction is known."""

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv

import robojoule as rj
from robojoule.calibration.log import MeasuredLog
from robojoule.errors import InputError
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
    assert any("another multiple" in warning and "joint_2" in warning for warning in found.warnings)


def test_a_log_with_neither_is_refused(columns, tmp_path):
    path = tmp_path / "positions.csv"
    csv.write_csv(pa.table({name: v for name, v in columns.items() if "torque" not in name}), path)
    with pytest.raises(InputError, match="neither power nor torques"):
        rj.identify_friction(path, rj.load_robot(ROBOT))
