"""Logs of 25 Hz and with dropped packets, of few motions, and of power on the bus of the arm."""

from dataclasses import replace

import numpy as np
import pytest

import robojoule as rj
from robojoule.calibration.identification import identify, wider_for_few
from robojoule.calibration.interpolation import FINE_STEP_S, interpolated, is_sparse
from robojoule.calibration.log import MeasuredLog, read_log
from robojoule.errors import InputError
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload, Robot
from tests.calibration.plant import ROBOT, Plant, trajectory


@pytest.fixture(scope="module")
def robot():
    return load_robot(ROBOT, Payload(10.0))


def recorded(seed, motions, *, rate_hz=25.0, name=ROBOT, payload_kg=10.0, noise=0.01, power=lambda watts: watts):
    """A log with velocities, and the plant that it was made by: powers averaged over each sample's time."""
    plant = Plant(seed, inertia_error=0.0, load_friction=0.0, name=name)
    fine = round(500.0 / rate_hz)
    time, q, qd, qdd, _ = trajectory(seed, motions, rate_hz=500.0, name=name, payload_kg=payload_kg)
    watts = power(plant.torque_and_power(q, qd, qdd, payload_kg)[1])
    averaged = np.convolve(watts, np.ones(fine) / fine, mode="same")
    rng = np.random.default_rng(seed)
    keep = np.arange(0, len(time), fine)
    noisy = averaged[keep] * (1.0 + noise * rng.standard_normal(len(keep)))
    return MeasuredLog("log", time[keep], q[keep], noisy, velocity_rad_s=qd[keep]), plant


def test_cubics_through_positions_and_velocities_are_exact():
    time = np.array([0.0, 0.04, 0.08, 0.20, 0.21, 0.25])
    position = (1.0 + 2.0 * time - 3.0 * time**2 + 4.0 * time**3)[:, None]
    velocity = (2.0 - 6.0 * time + 12.0 * time**2)[:, None]
    log = interpolated(MeasuredLog("log", time, position, 5.0 + time, velocity_rad_s=velocity))
    t = log.time_s
    np.testing.assert_allclose(log.position_rad[:, 0], 1.0 + 2.0 * t - 3.0 * t**2 + 4.0 * t**3, atol=1e-13)
    np.testing.assert_allclose(log.velocity_rad_s[:, 0], 2.0 - 6.0 * t + 12.0 * t**2, atol=1e-12)
    assert np.isin(time, t).all()
    assert np.diff(t).max() <= max(FINE_STEP_S, 0.01) + 1e-12
    assert np.trapezoid(log.power_w, t) == pytest.approx(np.trapezoid(5.0 + time, time), rel=1e-14)


def test_speed_limits_hold_from_sample_to_sample():
    time, limit = np.array([0.0, 0.04, 0.08]), np.array([1.0, 0.5, 0.5])
    log = MeasuredLog("log", time, time[:, None], time, velocity_rad_s=np.ones((3, 1)), speed_limit=limit)
    fine = interpolated(log)
    assert fine.speed_limit.shape == fine.time_s.shape
    assert (fine.speed_limit == np.where(fine.time_s < 0.04 - 1e-9, 1.0, 0.5)).all()


def test_dense_logs_and_those_without_velocities_stay_as_they_are(robot):
    log, _ = recorded(1, 3, rate_hz=250.0)
    assert not is_sparse(log)
    assert not is_sparse(replace(log, time_s=log.time_s * 20.0, velocity_rad_s=None))
    gap = np.r_[0:200, 215 : len(log.time_s)]
    assert is_sparse(
        MeasuredLog("log", log.time_s[gap], log.position_rad[gap], log.power_w[gap], log.velocity_rad_s[gap])
    )


def test_a_log_of_25_hz_tells_the_power_of_the_machine(robot):
    log, plant = recorded(3, 60)
    found = identify(log, robot)
    assert abs(found.held_out.energy_error_percent) < 2.0
    assert found.held_out.r2 > 0.9
    assert any("40 ms apart" in warning for warning in found.warnings)
    base = next(p for p in found.parameters if p.name == "base_power_w")
    assert base.value == pytest.approx(plant.hidden["base"], rel=0.05)


def test_dropped_packets_hardly_change_what_is_found(robot):
    log, _ = recorded(4, 40, rate_hz=125.0)
    keep = np.full(len(log.time_s), True)
    for first in np.random.default_rng(0).integers(50, len(log.time_s) - 50, 30):
        keep[first : first + 5] = False  # 48 ms without a sample
    dropped = MeasuredLog("log", *(a[keep] for a in (log.time_s, log.position_rad, log.power_w, log.velocity_rad_s)))
    whole, parts = identify(log, robot), identify(dropped, robot)
    assert parts.held_out.r2 > whole.held_out.r2 - 0.03
    assert parts.interpolated_step_s == pytest.approx(0.008)


def test_coarse_logs_need_velocities(robot, tmp_path):
    log, _ = recorded(5, 6)
    lines = ["time_s," + ",".join(f"q{j}_rad" for j in range(1, 7)) + ",power_w"]
    lines += [
        ",".join(f"{value:.9g}" for value in (t, *q, p))
        for t, q, p in zip(log.time_s, log.position_rad, log.power_w, strict=True)
    ]
    (tmp_path / "log.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"0\.04 s apart; allowed: at most 0\.02 s, or 0\.05 s with velocities"):
        read_log(tmp_path / "log.csv", robot)


def test_few_motions_give_wider_errors_instead_of_a_refusal(robot):
    errors = {}
    for motions in (3, 30):
        found = identify(recorded(6, motions, rate_hz=250.0)[0], robot)
        errors[motions] = next(p.standard_error for p in found.parameters if p.name == "base_power_w")
        assert any("only 3 motions" in warning for warning in found.warnings) == (motions == 3)
    assert errors[3] > 3.0 * errors[30]
    assert wider_for_few(2) == pytest.approx(12.706 / 1.960, rel=1e-3)  # Student's t, tables
    assert wider_for_few(1000) == pytest.approx(1.0, abs=2e-3)


def test_power_of_the_arm_gives_the_same_machine_at_the_mains():
    """Identified on the bus, the robot file says what the mains deliver."""
    name, payload = "ur_ur10e", Payload(10.0)
    robot = load_robot(name, payload)
    supply = robot.supply
    power = lambda watts: (watts - supply.controller_power_w) * supply.efficiency  # noqa: E731
    mains, _ = recorded(7, 40, rate_hz=250.0, name=name)
    arm, _ = recorded(7, 40, rate_hz=250.0, name=name, power=power)
    at_mains, at_arm = identify(mains, robot), identify(arm, robot, power_side="arm")
    for found in (at_mains, at_arm):
        assert found.held_out.r2 > 0.97
    assert at_mains.robot_file().drives.supply is None  # the plant's efficiency is above that of the assumed supply
    files = [Robot(found.robot_file(), payload).drives for found in (at_mains, at_arm)]
    assert files[0].base_power_w == pytest.approx(files[1].base_power_w, rel=0.02)
    assert files[1].base_power_w > at_arm.robot.drives.base_power_w + supply.controller_power_w


def test_a_robot_whose_supply_is_unknown_cannot_be_seen_from_its_arm(robot):
    log, _ = recorded(8, 8, rate_hz=125.0)
    with pytest.raises(InputError, match=r"drives\.supply: kuka_kr16_r2010_2 does not say what lies between"):
        rj.identify(log, robot, power_side="arm")
    with pytest.raises(InputError, match="power_side: 'motor' is not a side of the power; allowed: mains, arm"):
        rj.identify(log, robot, power_side="motor")
