from dataclasses import replace

import numpy as np
import pytest

from robojoule.calibration.log_model import evaluate, log_parameters
from robojoule.calibration.signals import prepare
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload
from tests.calibration.plant import ROBOT, Plant, as_log, make_log


@pytest.fixture(scope="module")
def prepared():
    robot = load_robot(ROBOT, Payload(10.0))
    columns, truth = make_log(
        Plant(6, inertia_error=0.0, load_friction=0.0, regeneration=0.4),
        6,
        12,
        noise=0.0,
        encoder_rad=0.0,
        rate_hz=1000.0,
    )
    return log_parameters(robot), prepare(as_log(columns), robot), truth


def hidden_x(plant):
    h = plant.hidden
    return np.concatenate([[h["base"], h["active"], 1 / h["eta"], h["rho"]], h["coulomb"], h["viscous"], h["copper"]])


def test_the_model_is_the_plant_where_nothing_is_unmodelled(prepared):
    vector, signals, truth = prepared
    x = hidden_x(Plant(6, inertia_error=0.0, load_friction=0.0, regeneration=0.4))
    error = signals.average(evaluate(vector, signals, x).power_w - truth)
    assert np.sqrt(np.mean(error**2)) < 0.004 * truth.mean()  # what differentiation leaves


@pytest.mark.parametrize("measured", [False, True])
def test_derivatives_agree_with_finite_differences(prepared, measured):
    vector, signals, _ = prepared
    signals = replace(signals, torque_nm=1.05 * signals.load_nm)  # any torque will do
    x = vector.start.copy()
    x[3] = 0.3
    exact = evaluate(vector, signals, x, use_measured_torque=measured).jacobian
    for index, size in enumerate(vector.scale):
        step = np.zeros(len(x))
        step[index] = 1e-6 * size
        plus = evaluate(vector, signals, x + step, use_measured_torque=measured).window_power_w
        minus = evaluate(vector, signals, x - step, use_measured_torque=measured).window_power_w
        numeric = (plus - minus) / (2e-6 * size)
        # An instant may cross between the regimes of the bus within the step: the kink costs a trifle.
        np.testing.assert_allclose(exact[:, index], numeric, atol=1e-4 * max(np.abs(numeric).max(), 1e-6))
