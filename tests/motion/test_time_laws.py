"""Time laws: closed form against Ruckig, synchronisation, limits, hard cases."""

import numpy as np
import pytest
from ruckig import InputParameter, Result, Ruckig, Synchronization, Trajectory

from robojoule.motion.time_laws import (
    PHASES,
    duration_at_peak_s,
    path_law,
    ramp_time_s,
    reachable_velocity,
    rest_to_rest_law,
)

CASES = {
    "cruise": (1.0, 0.5, 4.0, 50.0),
    "triangle": (1.0, 50.0, 4.0, 50.0),
    "jerk only": (0.01, 50.0, 400.0, 50.0),
    "tiny": (1e-6, 3.0, 20.0, 400.0),
    "slow": (2.0, 0.01, 20.0, 400.0),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_law_runs_from_rest_to_rest_within_its_limits(case):
    length, velocity, acceleration, jerk = case
    law = path_law(length, velocity, acceleration, jerk)
    times = np.linspace(0.0, law.total_s, 2001)
    s, s1, s2, s3 = law.at(times)
    assert s[0] == 0.0
    assert s[-1] == pytest.approx(1.0, abs=1e-9)
    assert s1[[0, -1]] == pytest.approx(0.0, abs=1e-7 * s1.max())
    assert np.all(np.diff(s) >= -1e-12)
    assert s1.max() <= velocity * (1 + 1e-9)
    assert np.abs(s2).max() <= acceleration * (1 + 1e-9)
    assert np.abs(s3).max() <= jerk * (1 + 1e-9)
    assert len(law.duration_s) == PHASES


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_derivatives_are_consistent(case):
    law = path_law(*case)
    starts = np.concatenate([[0.0], np.cumsum(law.duration_s)[:-1]])
    present = law.duration_s > 0
    middle, step = (starts + law.duration_s / 2)[present], 1e-3 * law.duration_s[present]
    before, at, after = (law.at(middle + k * step) for k in (-1, 0, 1))
    for lower, higher, scale in ((0, 1, law.velocity.max()), (1, 2, law.acceleration.max()), (2, 3, law.jerk.max())):
        difference = (after[lower] - before[lower]) / (2 * step)
        assert difference == pytest.approx(at[higher], abs=1e-5 * scale)


@pytest.mark.parametrize("filter_time_s", [0.01, 0.08, 0.5])
def test_closed_form_equals_ruckig(filter_time_s):
    rng = np.random.default_rng(3)
    for _ in range(200):
        acceleration = 10 ** rng.uniform(-1, 2)
        top = float(reachable_velocity(acceleration, filter_time_s))
        velocity = top * rng.uniform(0.02, 1.0)
        expected = path_law(1.0, velocity, acceleration, acceleration / filter_time_s).total_s
        assert float(duration_at_peak_s(velocity, acceleration, filter_time_s)) == pytest.approx(expected, abs=1e-9)


def test_laws_in_closed_form_equal_ruckigs():
    rng = np.random.default_rng(8)
    acceleration = 10 ** rng.uniform(-1, 2, (40, 5))
    velocity = reachable_velocity(acceleration, 0.08) * rng.uniform(0.02, 1.0, (40, 5))
    laws = rest_to_rest_law(velocity, acceleration, 0.08)
    for run in np.ndindex(40, 5):
        law = laws.of(run[0]).of(run[1])
        expected = path_law(1.3, velocity[run], acceleration[run], acceleration[run] / 0.08)
        assert law.total_s == pytest.approx(expected.total_s, abs=1e-9)
        times = np.linspace(0.0, min(law.total_s, expected.total_s), 50)
        scales = (1.0, velocity[run], acceleration[run])
        for found, exact, scale in zip(law.at(times), expected.at(times), scales, strict=False):
            assert found == pytest.approx(exact, abs=1e-8 * scale)


def test_reachable_velocity_is_where_the_cruise_vanishes():
    accelerations = np.array([0.1, 1.0, 20.0, 300.0])
    top = reachable_velocity(accelerations, 0.05)
    assert top * ramp_time_s(top, accelerations, 0.05) == pytest.approx(1.0, abs=1e-12)
    assert np.isinf(duration_at_peak_s(top * 1.001, accelerations, 0.05)).all()


def test_one_path_coordinate_equals_six_phase_synchronised_joints():
    """Ruckig's own synchronisation of six joints keeps the straight line; one coordinate gives the same law."""
    delta = np.array([0.7, -0.3, 1.1, 0.05, -0.9, 0.2])
    velocity, acceleration, jerk = 1.3, 6.0, 90.0
    problem = InputParameter(6)
    problem.target_position = delta
    problem.max_velocity = np.abs(delta) * velocity
    problem.max_acceleration = np.abs(delta) * acceleration
    problem.max_jerk = np.abs(delta) * jerk
    problem.synchronization = Synchronization.Phase
    trajectory = Trajectory(6)
    assert Ruckig(6).calculate(problem, trajectory) == Result.Working
    law = path_law(float(np.abs(delta).max()), velocity, acceleration, jerk)
    assert law.total_s == pytest.approx(trajectory.duration, abs=1e-9)
    for time in np.linspace(0.0, law.total_s, 50):
        position, speed, acc = trajectory.at_time(time)
        s, s1, s2, _ = law.at([time])
        assert np.array(position) == pytest.approx(s[0] * delta, abs=1e-9)
        assert np.array(speed) == pytest.approx(s1[0] * delta, abs=1e-8)
        assert np.array(acc) == pytest.approx(s2[0] * delta, abs=1e-6)
