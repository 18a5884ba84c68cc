"""Torque limits against brute force over limits and velocities."""

from dataclasses import fields

import numpy as np
import pytest

from robojoule.motion.torque_limits import TorqueLimits

SHAPE = (60, 12)


@pytest.fixture(scope="module")
def limits():
    rng = np.random.default_rng(6)
    return TorqueLimits(
        inertia=rng.uniform(0.5, 30.0, SHAPE),
        standing=rng.normal(0.0, 120.0, SHAPE),
        viscous=rng.normal(0.0, 40.0, SHAPE),
        centrifugal=rng.normal(0.0, 40.0, SHAPE),
        peak=np.full(SHAPE, 300.0),
        usable=np.full(SHAPE, 270.0),
        floor=np.full(SHAPE, 45.0),
    )


def allowed(limits: TorqueLimits, motion: int, velocity: float) -> float:
    """The definition, limit by limit."""
    accelerations = []
    for k in range(SHAPE[1]):
        inertia, standing, viscous, centrifugal, peak, usable, floor = (
            getattr(limits, field.name)[motion, k] for field in fields(TorqueLimits)
        )
        steady = max(abs(standing), abs(standing + viscous * velocity + centrifugal * velocity**2))
        accelerations.append(max(usable - steady, min(floor, max(peak - steady, 0.0))) / inertia)
    return min(accelerations)


def test_acceleration_is_that_of_the_tightest_limit(limits):
    velocity = np.linspace(0.0, 2.0, SHAPE[0])
    expected = [allowed(limits, motion, v) for motion, v in enumerate(velocity)]
    assert limits.acceleration(velocity) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(("low", "high"), [(0.0, 2.0), (0.7, 0.9), (1.3, 1.3)])
def test_binding_limits_allow_the_same_between_the_velocities(limits, low, high):
    few = limits.binding(*limits.steady_bounds(np.full(SHAPE[0], low), np.full(SHAPE[0], high)))
    assert few.inertia.shape[1] < SHAPE[1]
    for velocity in np.linspace(low, high, 23):
        v = np.full(SHAPE[0], velocity)
        assert np.array_equal(few.acceleration(v), limits.acceleration(v))


def test_what_is_left_falls_to_zero_at_the_peak_without_a_step(limits):
    one = TorqueLimits(*(np.array([[value]]) for value in (2.0, 0.0, 1.0, 0.0, 300.0, 270.0, 45.0)))
    torque = np.linspace(0.0, 320.0, 3201)
    left = 2.0 * np.array([one.acceleration(np.array([value]))[0] for value in torque])
    assert left[torque == 100.0] == 170.0 and left[torque == 240.0] == 45.0 and left[torque == 290.0] == 10.0
    assert np.all(left[torque >= 300.0] == 0.0)
    assert np.abs(np.diff(left)).max() <= 0.1 + 1e-9
