import numpy as np
import pytest

from robojoule.calibration.signals import choose_smoothing, local_cubic, prepare
from robojoule.errors import InputError
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.calibration.plant import ROBOT, Plant, as_log, make_log


@pytest.fixture(scope="module")
def robot():
    return load_robot(ROBOT, Payload(10.0))


def test_a_cubic_is_differentiated_exactly_whatever_the_spacing():
    time = np.cumsum(np.random.default_rng(1).uniform(0.001, 0.009, 300))
    values = np.stack([1.0 + 2.0 * time - time**2 + 0.5 * time**3, np.full(300, 3.0)], axis=1)
    position, velocity, acceleration = local_cubic(time, values, 0.05)
    np.testing.assert_allclose(position, values, atol=1e-9)
    np.testing.assert_allclose(velocity[:, 0], 2.0 - 2.0 * time + 1.5 * time**2, atol=1e-8)
    np.testing.assert_allclose(acceleration[:, 0], -2.0 + 3.0 * time, atol=1e-5)
    np.testing.assert_allclose(acceleration[:, 1], 0.0, atol=1e-8)


def test_more_noise_asks_for_longer_smoothing():
    time = np.arange(5000) * 0.004
    clean = np.sin(3.0 * time)[:, None]
    noise = np.random.default_rng(2).standard_normal((5000, 1))
    chosen = [choose_smoothing(time, clean + size * noise) for size in (0.0, 1e-5, 1e-4, 1e-3)]
    assert chosen == sorted(chosen)
    assert chosen[0] == pytest.approx(0.016)  # five samples
    assert chosen[-1] > 0.08


def test_windows_keep_the_energy_and_blocks_are_motions(robot):
    columns, _ = make_log(Plant(3), 3, motions=12, jitter=0.4)
    signals = prepare(as_log(columns), robot)
    assert signals.blocks == 12
    energy = np.trapezoid(columns["power_w"], columns["time_s"])
    assert signals.average(signals.power_w) @ signals.window_s == pytest.approx(energy, rel=1e-12)
    assert np.all(np.diff(signals.window_block) >= 0)
    assert set(signals.window_block[signals.held_out]) == {3, 7, 11}


def test_a_log_without_stops_is_cut_into_stretches_of_time(robot):
    time = np.arange(15000) * 0.004
    position = robot.home_rad + 0.3 * np.sin(0.2 + 2.0 * time)[:, None] * np.ones(6)
    position[:, 0] += 0.3 * np.cos(2.0 * time)
    columns = {"time_s": time, "power_w": 500.0 + np.sin(time)}
    columns |= {f"q{j + 1}_rad": position[:, j] for j in range(6)}
    signals = prepare(as_log(columns), robot)
    assert signals.blocks == 10


def test_a_payload_column_takes_precedence(robot):
    columns, _ = make_log(Plant(4), 4, motions=10)
    log = as_log(columns)
    half = np.where(np.arange(len(log.time_s)) < len(log.time_s) // 2, 10.0, 0.0)
    mixed = prepare(type(log)(log.source, log.time_s, log.position_rad, log.power_w, payload_kg=half), robot).load_nm
    full, bare = prepare(log, robot).load_nm, prepare(log, load_robot(ROBOT)).load_nm
    np.testing.assert_allclose(mixed[half > 0], full[half > 0], atol=1e-9)
    np.testing.assert_allclose(mixed[half == 0], bare[half == 0], atol=1e-9)


def test_contradictions_and_bad_lengths_are_refused(robot):
    columns, _ = make_log(Plant(5), 5, motions=10)
    log = as_log(columns)
    velocity = 57.3 * np.gradient(log.position_rad, log.time_s, axis=0)
    wrong = type(log)(log.source, log.time_s, log.position_rad, log.power_w, velocity_rad_s=velocity)
    with pytest.raises(InputError, match=r"q1_velocity_rad_s: the velocity is 57.* times the derivative"):
        prepare(wrong, robot)
    clipped = type(log)(
        log.source, log.time_s, log.position_rad, log.power_w, velocity_rad_s=np.clip(velocity / 57.3, -0.7, 0.7)
    )
    with pytest.raises(InputError, match=r"q\d_velocity_rad_s: the velocity is .* saturated|times the derivative"):
        prepare(clipped, robot)
    late = type(log)(
        log.source, log.time_s, log.position_rad, log.power_w, velocity_rad_s=np.roll(velocity / 57.3, 20, axis=0)
    )
    with pytest.raises(InputError, match=r"q1_velocity_rad_s: the velocity is off .* late or saturated; allowed"):
        prepare(late, robot)
    fine = type(log)(log.source, log.time_s, log.position_rad, log.power_w, velocity_rad_s=velocity / 57.3)
    np.testing.assert_allclose(prepare(fine, robot).velocity_rad_s, prepare(log, robot).velocity_rad_s, atol=0.1)
    with pytest.raises(InputError, match=r"window_s: 0 is out of range; allowed: 0\.001 to 1 s"):
        prepare(log, robot, window_s=0.0)
    with pytest.raises(InputError, match="smoothing_s: 2 is out of range"):
        prepare(log, robot, smoothing_s=2.0)
    short, _ = make_log(Plant(5), 5, motions=1)
    with pytest.raises(InputError, match="the log holds only 1 motion; allowed: at least 2"):
        prepare(as_log(short), robot)
