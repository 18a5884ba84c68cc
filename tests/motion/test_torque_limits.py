"""Torque limits against brute force over limits and velocities."""

import numpy as np
import pytest

from robojoule.motion.torque_limits import TorqueLimits, first_reached

SHAPE = (60, 12)


@pytest.fixture(scope="module")
def limits():
    rng = np.random.default_rng(6)
    return TorqueLimits(
        inertia=rng.uniform(0.5, 30.0, SHAPE),
        standing=rng.normal(0.0, 120.0, SHAPE),
        viscous=rng.normal(0.0, 40.0, SHAPE),
        centrifugal=rng.normal(0.0, 40.0, SHAPE),
        usable=np.full(SHAPE, 270.0),
        floor=np.full(SHAPE, 45.0),
    )


def allowed(limits: TorqueLimits, motion: int, velocity: float) -> float:
    """The definition, limit by limit."""
    accelerations = []
    for k in range(SHAPE[1]):
        inertia, standing, viscous, centrifugal, usable, floor = (
            getattr(limits, name)[motion, k]
            for name in ("inertia", "standing", "viscous", "centrifugal", "usable", "floor")
        )
        steady = max(abs(standing), abs(standing + viscous * velocity + centrifugal * velocity**2))
        accelerations.append(max(usable - steady, floor) / inertia)
    return min(accelerations)


def test_acceleration_is_that_of_the_tightest_limit(limits):
    velocity = np.linspace(0.0, 2.0, SHAPE[0])
    expected = [allowed(limits, motion, v) for motion, v in enumerate(velocity)]
    assert limits.acceleration(velocity) == pytest.approx(expected, rel=1e-13)


def test_slope_is_the_derivative(limits):
    velocity, step = np.linspace(0.05, 2.0, SHAPE[0]), 1e-7
    acceleration, slope = limits.acceleration_and_slope(velocity)
    before, after = limits.acceleration(velocity - step), limits.acceleration(velocity + step)
    assert acceleration == pytest.approx(limits.acceleration(velocity), rel=1e-13)
    smooth = np.abs((after - acceleration) - (acceleration - before)) < 1e-9  # not where the tightest limit changes
    assert smooth.mean() > 0.9
    assert slope[smooth] == pytest.approx(((after - before) / (2 * step))[smooth], abs=1e-5)
    assert np.any(slope[smooth] < 0) and np.any(slope[smooth] == 0)


@pytest.mark.parametrize(("low", "high"), [(0.0, 2.0), (0.7, 0.9), (1.3, 1.3)])
def test_binding_limits_allow_the_same_between_the_velocities(limits, low, high):
    few = limits.binding(*limits.steady_bounds(np.full(SHAPE[0], low), np.full(SHAPE[0], high)))
    assert few.inertia.shape[1] < SHAPE[1]
    for velocity in np.linspace(low, high, 23):
        v = np.full(SHAPE[0], velocity)
        assert np.array_equal(few.acceleration(v), limits.acceleration(v))
        for found, expected in zip(few.acceleration_and_slope(v), limits.acceleration_and_slope(v), strict=True):
            assert np.array_equal(found, expected)


def test_first_reached_is_the_least_crossing(limits):
    room = np.full(SHAPE, 170.0)
    found = first_reached(limits, room)
    velocity = np.linspace(0.0, 5.0, 5001)[:, None, None]
    beyond = np.abs(limits.standing + limits.viscous * velocity + limits.centrifugal * velocity**2) >= room
    first = np.where(beyond.any(axis=0), velocity[beyond.argmax(axis=0), 0, 0], np.inf)
    late = ~beyond[0]
    assert np.all(np.isinf(found[~late]))
    crossed = late & np.isfinite(first)
    assert crossed.sum() > 100
    assert np.all((found[crossed] <= first[crossed]) & (found[crossed] >= first[crossed] - 0.001 - 1e-12))
    assert np.all(found[late & ~np.isfinite(first)] > 4.9)
