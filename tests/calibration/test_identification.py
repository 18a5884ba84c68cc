import json
import re
from dataclasses import replace

import numpy as np
import pytest

from robojoule.calibration.identification import identify
from robojoule.calibration.signals import prepare
from robojoule.errors import InputError
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.calibration.plant import ROBOT, Plant, as_log, judge, make_log


@pytest.fixture(scope="module")
def robot():
    return load_robot(ROBOT, Payload(10.0))


@pytest.fixture(scope="module")
def reference(robot):
    """A machine with load-dependent friction, wrong inertias and noise, and what its log tells."""
    plant = Plant(11)
    columns, _ = make_log(plant, 11, motions=60, jitter=0.4)
    return plant, as_log(columns, "measured.csv"), identify(as_log(columns, "measured.csv"), robot)


def save(result, tmp_path):
    path = tmp_path / "entry.json"
    path.write_text(json.dumps(result.robot_file().model_dump(mode="json")))
    return load_robot(path, Payload(10.0))


def values(result):
    return {parameter.name: parameter for parameter in result.parameters}


def truth(plant, robot):
    h = plant.hidden
    result = {
        "base_power_w": h["base"],
        "drive_active_power_w": h["active"],
        "inverter_efficiency": h["eta"],
        "regeneration_efficiency": h["rho"],
    }
    for j, name in enumerate(robot.joint_names):
        result[f"joints.{name}.coulomb_nm"] = h["coulomb"][j]
        result[f"joints.{name}.viscous_nm_s_per_rad"] = h["viscous"][j]
        result[f"joints.{name}.copper_w_per_nm2"] = h["copper"][j]
    return result


def test_power_and_energy_of_fresh_motions_hold_despite_unmodelled_effects(reference, tmp_path):
    plant, _, result = reference
    rmse, total, each = judge(plant, save(result, tmp_path), seed=2011)
    assert rmse <= 3.0
    assert abs(total) <= 2.0
    assert np.mean(np.abs(each)) <= 1.0
    assert np.mean(np.abs(each) <= 2.0) >= 0.9
    before, _, _ = judge(plant, load_robot(ROBOT, Payload(10.0)), seed=2011)
    assert rmse < before / 3.0


def test_hidden_parameters_lie_within_their_errors_where_nothing_is_unmodelled(robot):
    plant = Plant(12, inertia_error=0.0, load_friction=0.0, regeneration=0.5)
    columns, _ = make_log(plant, 12, motions=50)
    result = identify(as_log(columns), robot)
    hidden, found = truth(plant, robot), values(result)
    scores = []
    for name, parameter in found.items():
        if parameter.identified:
            scores.append(
                (parameter.value - hidden[name]) / np.hypot(parameter.standard_error, parameter.inertia_error)
            )
    assert len(scores) >= 18
    assert np.max(np.abs(scores)) < 4.0
    assert found["base_power_w"].value == pytest.approx(hidden["base_power_w"], rel=0.002)
    assert found["inverter_efficiency"].value == pytest.approx(hidden["inverter_efficiency"], rel=0.005)
    assert found["regeneration_efficiency"].value == pytest.approx(0.5, abs=0.05)
    for joint in robot.joint_names[:3]:
        key = f"joints.{joint}.viscous_nm_s_per_rad"
        assert found[key].value == pytest.approx(hidden[key], rel=0.06)


def test_standard_errors_grow_with_noise(robot):
    plant = Plant(13, inertia_error=0.0, load_friction=0.0)
    errors = []
    for noise in (0.02, 0.2):
        columns, _ = make_log(plant, 13, motions=20, noise=noise)
        errors.append(values(identify(as_log(columns), robot))["base_power_w"].standard_error)
    assert 5.0 < errors[1] / errors[0] < 20.0


def test_joints_that_never_move_keep_their_friction(robot):
    plant = Plant(14)
    columns, _ = make_log(plant, 14, motions=16, joints=[0])
    result = identify(as_log(columns), robot)
    found = values(result)
    for joint in robot.joint_names[1:]:
        for key in ("coulomb_nm", "viscous_nm_s_per_rad"):
            parameter = found[f"joints.{joint}.{key}"]
            assert not parameter.identified
            assert parameter.standard_error is None
            assert parameter.value == parameter.catalog_value
            assert parameter.confounded_with == ()
    assert found["joints.joint_1.viscous_nm_s_per_rad"].identified


def test_without_rests_base_and_active_power_cannot_be_told_apart(robot):
    plant = Plant(15)
    columns, _ = make_log(plant, 15, motions=40)
    log = as_log(columns)
    speed = np.abs(np.gradient(log.position_rad, log.time_s, axis=0) / robot.velocity_rad_s).max(axis=1)
    keep = speed > 0.01
    time = np.cumsum(np.where(keep, 0.004, 0.0))[keep]  # the rests are cut out, the motions joined
    moving = replace(log, time_s=time, position_rad=log.position_rad[keep], power_w=log.power_w[keep])
    result = identify(moving, robot)
    kept = {parameter.name: parameter.confounded_with for parameter in result.unidentified}
    both = {"base_power_w", "drive_active_power_w"}
    assert both & set(kept)
    (name,) = both & set(kept)
    assert both - {name} <= set(kept[name])


def test_measured_torques_sharpen_the_parameters(robot):
    plant = Plant(16, load_friction=0.0)
    columns, _ = make_log(plant, 16, motions=40, torques=True)
    with_torque = identify(as_log(columns), robot)
    assert with_torque.with_torque
    hidden, found = truth(plant, robot), values(with_torque)
    assert found["inverter_efficiency"].value == pytest.approx(hidden["inverter_efficiency"], rel=0.01)
    for joint in robot.joint_names[:3]:
        key = f"joints.{joint}.copper_w_per_nm2"  # half a per cent of the power: known to its error only
        assert found[key].value == pytest.approx(hidden[key], abs=4.0 * found[key].standard_error)


def test_outliers_do_little(reference, robot):
    _, log, result = reference
    power = log.power_w.copy()
    power[np.random.default_rng(0).choice(len(power), 60, replace=False)] *= 5.0
    spoilt = values(identify(replace(log, power_w=power), robot))
    for name in ("base_power_w", "inverter_efficiency", "joints.joint_2.viscous_nm_s_per_rad"):
        assert spoilt[name].value == pytest.approx(values(result)[name].value, rel=0.03)


def test_scores_are_those_of_held_out_windows(reference):
    _, log, result = reference
    use = result.window_held_out
    assert 0.1 < np.mean(use) < 0.5
    assert result.held_out.motions + result.training.motions == 60
    assert result.held_out.duration_s + result.training.duration_s == pytest.approx(np.ptp(log.time_s))
    assert result.held_out.r2 > 0.99
    assert result.held_out.rmse_w < result.held_out_catalog.rmse_w / 3.0
    plain = np.sqrt(np.mean((result.measured_w - result.modelled_w)[use] ** 2))
    assert result.held_out.rmse_w == pytest.approx(plain, rel=0.1)  # weighted by the windows' lengths


def test_held_out_power_has_no_influence(reference, robot):
    _, log, result = reference
    signals = prepare(log, robot)
    block = np.repeat(signals.window_block, np.diff(np.append(signals.window_start, len(log.time_s))))
    power = np.where(block % 4 == 3, 1.3 * log.power_w, log.power_w)
    again = identify(replace(log, power_w=power), robot)
    assert [p.value for p in again.parameters] == [p.value for p in result.parameters]


def test_the_robot_file_says_where_it_comes_from(reference, robot, tmp_path):
    _, _, result = reference
    identified = save(result, tmp_path)
    assert identified.name == f"{ROBOT}_identified"
    provenance = identified.file.drives.provenance
    assert provenance.startswith("identified from the log measured.csv")
    for parameter in result.unidentified:
        assert parameter.name in provenance
    groups, before = identified.file.provenance, robot.file.provenance
    assert groups["drives"].kind == "identified" and "measured.csv" in groups["drives"].note
    assert {**groups, "drives": before["drives"]} == before  # the log tells of nothing else
    np.testing.assert_array_equal(identified.drives.gear_ratio, robot.drives.gear_ratio)
    np.testing.assert_array_equal(identified.drives.rotor_inertia_kg_m2, robot.drives.rotor_inertia_kg_m2)
    assert identified.drives.base_power_w == pytest.approx(values(result)["base_power_w"].value, rel=1e-5)
    assert result.robot_file("cell_3_robot_1").name == "cell_3_robot_1"


BAD_POWER = {
    "kilowatts": (lambda p: p / 1000.0, "times what the catalog entry expects; it looks like kilowatts"),
    "milliwatts": (lambda p: p * 1000.0, "times what the catalog entry expects; allowed: watts"),
    "constant": (lambda p: np.full_like(p, 500.0), "the power never changes"),
    "negative": (lambda p: -p, "most of the power is zero or negative"),
    "dropouts": (lambda p: np.where(np.arange(len(p)) % 500 == 7, 0.0, p), "the meter dropped out"),
    "saturated": (lambda p: np.minimum(p, 1500.0), "samples stay at exactly 1500 W, the largest value"),
}


@pytest.mark.parametrize("case", BAD_POWER)
def test_bad_power_is_refused(reference, robot, case):
    _, log, _ = reference
    spoil, message = BAD_POWER[case]
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        identify(replace(log, power_w=spoil(log.power_w)), robot)
    assert str(caught.value).startswith("measured.csv, power_w: ")


def jump(position):
    position[3000:] += 0.1
    return position


def at_the_sensors_end(position):
    return np.minimum(position, np.quantile(position, 0.8, axis=0))


@pytest.mark.parametrize("spoil", [jump, at_the_sensors_end])
def test_positions_that_no_drive_could_follow_are_refused(reference, robot, spoil):
    _, log, _ = reference
    message = r"^measured.csv, q\d_rad: the motion at t = .* a position jumps or is saturated"
    with pytest.raises(InputError, match=message):
        identify(replace(log, position_rad=spoil(log.position_rad.copy())), robot)


BAD_TORQUE = {
    "motor side": (lambda t: t / 100.0, "times what the robot's inertia and the catalog's friction expect"),
    "wrong sign": (lambda t: -t, "times what the robot's inertia"),
    "saturated": (lambda t: np.clip(t, -60.0, 60.0), "the torque is saturated"),
}


@pytest.mark.parametrize("case", BAD_TORQUE)
def test_bad_torque_is_refused(robot, case):
    columns, _ = make_log(Plant(17), 17, motions=10, torques=True)
    log = as_log(columns)
    spoil, message = BAD_TORQUE[case]
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        identify(replace(log, torque_nm=spoil(log.torque_nm)), robot)
    assert "q1_torque_nm" in str(caught.value)
