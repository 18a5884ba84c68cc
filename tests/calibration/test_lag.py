"""A meter that lags: found from the shape of the power, and put right."""

import numpy as np
import pytest

import robojoule as rj
from robojoule.calibration.lag import meter_lag, without_lag
from robojoule.calibration.log import MeasuredLog
from tests.calibration.plant import ROBOT, Plant, make_log


@pytest.fixture(scope="module")
def columns():
    return make_log(Plant(21), 21, motions=30)[0]


def log_of(columns, lag_s=0.0):
    time = np.asarray(columns["time_s"])
    position = np.stack([columns[f"q{joint}_rad"] for joint in range(1, 7)], axis=1)
    return MeasuredLog("log", time, position, np.interp(time - lag_s, time, columns["power_w"]))


@pytest.mark.parametrize("lag_s", [-0.02, 0.012, 0.04, 0.2])
def test_the_lag_is_found_and_taken_away(columns, lag_s):
    robot = rj.load_robot(ROBOT, payload_kg=10)
    late = log_of(columns, lag_s)
    found = meter_lag(late, robot)
    assert found.lag_s == pytest.approx(lag_s, abs=0.003)
    assert found.r2 > found.r2_without
    put_right = without_lag(late, found.lag_s)
    truth = np.interp(put_right.time_s, columns["time_s"], columns["power_w"])
    error = np.abs(put_right.power_w - truth)
    assert np.median(error) < 0.01 * np.median(truth)


def test_a_meter_that_does_not_lag_is_left_alone(columns):
    log = log_of(columns)
    assert meter_lag(log, rj.load_robot(ROBOT, payload_kg=10)).lag_s == 0.0
    assert without_lag(log, 0.0) is log


def test_identification_holds_with_a_late_meter_and_says_so(columns):
    robot = rj.load_robot(ROBOT, payload_kg=10)
    punctual, late = (rj.identify(log_of(columns, lag), robot) for lag in (0.0, 0.06))
    assert late.held_out.r2 > punctual.held_out.r2 - 0.005
    assert any("later than the positions" in warning for warning in late.warnings)
    assert not any("later than the positions" in warning for warning in punctual.warnings)


def test_a_meter_that_is_ahead_is_said_to_be(columns):
    found = rj.identify(log_of(columns, -0.04), rj.load_robot(ROBOT, payload_kg=10))
    assert any("the power comes 40 ms earlier than the positions" in warning for warning in found.warnings)


@pytest.mark.parametrize("lag_s", [0.5, 0.8, -2.0])
def test_a_lag_that_is_not_told_is_not_put_right(columns, lag_s):
    """Beyond half a second there is no lag that explains the power: the best of the others says nothing."""
    robot = rj.load_robot(ROBOT, payload_kg=10)
    late = log_of(columns, lag_s)
    assert meter_lag(late, robot).lag_s == 0.0
    found = rj.identify(late, robot)
    assert not any("than the positions" in warning for warning in found.warnings)
    assert "poor fit" in found.warnings[0]
