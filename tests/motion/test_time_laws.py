"""Time laws: closed form against Ruckig, synchronisation, limits, hard cases."""

import numpy as np
import pytest

from robojoule.motion.time_laws import (
    PHASES,
    duration_at_peak_s,
    path_law,
    ramp_time_s,
    reachable_velocity,
)

# id: velocity, acceleration, filter time, length in radians
CASES = {
    "cruise": (0.5, 4.0, 0.08, 1.0),
    "just a cruise": (0.5, 4.0, 0.5 / 4.0, 1.0),  # the plateau vanishes
    "beyond reach": (50.0, 4.0, 0.08, 1.0),
    "beyond reach, jerk only": (50.0, 400.0, 8.0, 0.01),
    "tiny": (3.0, 20.0, 0.05, 1e-6),
    "slow": (0.01, 20.0, 0.05, 2.0),
    "very slow": (1e-4, 0.1, 0.3, 3.0),
    "stiff": (2.0, 900.0, 0.002, 1.5),
}
ENGINES = ("ruckig", "closed_form")


@pytest.fixture(params=ENGINES)
def engine(request):
    if request.param == "ruckig":
        pytest.importorskip("ruckig")
    return request.param


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_law_runs_from_rest_to_rest_within_its_limits(case, engine):
    velocity, acceleration, filter_time_s, length = case
    law = path_law(velocity, acceleration, filter_time_s, length_rad=length, engine=engine)
    times = np.linspace(0.0, law.total_s, 2001)
    s, s1, s2, s3 = law.at(times)
    assert s[0] == 0.0
    assert s[-1] == pytest.approx(1.0, abs=1e-9)
    assert s1[[0, -1]] == pytest.approx(0.0, abs=1e-7 * s1.max())
    assert np.all(np.diff(s) >= -1e-12)
    assert s1.max() <= velocity * (1 + 1e-9)
    assert np.abs(s2).max() <= acceleration * (1 + 1e-9)
    assert np.abs(s3).max() <= acceleration / filter_time_s * (1 + 1e-9)
    assert law.duration_s.shape == (PHASES,)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_derivatives_are_consistent(case, engine):
    *limits, length = case
    law = path_law(*limits, length_rad=length, engine=engine)
    starts = np.concatenate([[0.0], np.cumsum(law.duration_s)[:-1]])
    present = law.duration_s > 1e-9 * law.total_s
    middle, step = (starts + law.duration_s / 2)[present], 1e-3 * law.duration_s[present]
    before, at, after = (law.at(middle + k * step) for k in (-1, 0, 1))
    for lower, higher, scale in ((0, 1, law.velocity.max()), (1, 2, law.acceleration.max()), (2, 3, law.jerk.max())):
        difference = (after[lower] - before[lower]) / (2 * step)
        assert difference == pytest.approx(at[higher], abs=1e-5 * scale)


def assert_same_law(found, expected):
    """Equal to 1e-9 of the largest value, in duration and all along."""
    assert found.total_s == pytest.approx(expected.total_s, abs=1e-9)
    times = np.linspace(0.0, min(found.total_s, expected.total_s), 200)
    scales = (1.0, expected.velocity.max(), np.abs(expected.acceleration).max())
    for one, other, scale in zip(found.at(times), expected.at(times), scales, strict=False):
        assert one == pytest.approx(other, abs=1e-9 * scale)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_engines_agree_in_hard_cases(case):
    pytest.importorskip("ruckig")
    *limits, length = case
    assert_same_law(*(path_law(*limits, length_rad=length, engine=engine) for engine in ENGINES))


@pytest.mark.parametrize("filter_time_s", [0.01, 0.08, 0.5])
def test_engines_agree_on_many_laws_at_once(filter_time_s):
    pytest.importorskip("ruckig")
    rng = np.random.default_rng(8)
    acceleration = 10 ** rng.uniform(-1, 2, (40, 5))
    velocity = reachable_velocity(acceleration, filter_time_s) * rng.uniform(0.02, 1.2, (40, 5))
    laws, expected = (
        path_law(velocity, acceleration, filter_time_s, length_rad=1.3, engine=engine) for engine in ENGINES[::-1]
    )
    for run in np.ndindex(40, 5):
        assert_same_law(laws.of(run[0]).of(run[1]), expected.of(run[0]).of(run[1]))
    durations = duration_at_peak_s(
        np.minimum(velocity, reachable_velocity(acceleration, filter_time_s)), acceleration, filter_time_s
    )
    assert durations == pytest.approx(expected.duration_s.sum(axis=-1), abs=1e-9)


def test_one_law_comes_from_ruckig_and_many_from_the_closed_form():
    pytest.importorskip("ruckig")
    limits = (0.7, 5.0, 0.1)
    chosen = path_law(*limits, length_rad=0.9)
    assert np.array_equal(chosen.duration_s, path_law(*limits, length_rad=0.9, engine="ruckig").duration_s)
    many = path_law(np.full(3, 0.7), np.full(3, 5.0), 0.1)
    closed = path_law(*limits, engine="closed_form")
    assert np.array_equal(many.duration_s, np.tile(closed.duration_s, (3, 1)))


def test_reachable_velocity_is_where_the_cruise_vanishes():
    accelerations = np.array([0.1, 1.0, 20.0, 300.0])
    top = reachable_velocity(accelerations, 0.05)
    assert top * ramp_time_s(top, accelerations, 0.05) == pytest.approx(1.0, abs=1e-12)
    assert np.isinf(duration_at_peak_s(top * 1.001, accelerations, 0.05)).all()


def test_one_path_coordinate_equals_six_phase_synchronised_joints():
    """Ruckig's own synchronisation of six joints keeps the straight line; one coordinate gives the same law."""
    ruckig = pytest.importorskip("ruckig")
    delta = np.array([0.7, -0.3, 1.1, 0.05, -0.9, 0.2])
    velocity, acceleration, filter_time_s = 1.3, 6.0, 1.0 / 15.0
    problem = ruckig.InputParameter(6)
    problem.target_position = delta
    problem.max_velocity = np.abs(delta) * velocity
    problem.max_acceleration = np.abs(delta) * acceleration
    problem.max_jerk = np.abs(delta) * acceleration / filter_time_s
    problem.synchronization = ruckig.Synchronization.Phase
    trajectory = ruckig.Trajectory(6)
    assert ruckig.Ruckig(6).calculate(problem, trajectory) == ruckig.Result.Working
    law = path_law(velocity, acceleration, filter_time_s, length_rad=float(np.abs(delta).max()))
    assert law.total_s == pytest.approx(trajectory.duration, abs=1e-9)
    for time in np.linspace(0.0, law.total_s, 50):
        position, speed, acc = trajectory.at_time(time)
        s, s1, s2, _ = law.at([time])
        assert np.array(position) == pytest.approx(s[0] * delta, abs=1e-9)
        assert np.array(speed) == pytest.approx(s1[0] * delta, abs=1e-8)
        assert np.array(acc) == pytest.approx(s2[0] * delta, abs=1e-6)
