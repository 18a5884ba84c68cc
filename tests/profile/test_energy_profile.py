"""Profiles of single motions as users see them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.energy_profile import PARTS, simulated_profile, torque_warning
from tests.core_cases import HOME_DEG, kr16

START, END = np.radians(HOME_DEG), np.radians([60.0, -60.0, 90.0, 0.0, 30.0, 0.0])


@pytest.fixture(scope="module")
def profile():
    return simulated_profile(kr16(), START, END, 19)


def test_runs_are_those_of_the_simulation(profile):
    runs = MotionPaths(kr16(), START, END).simulate(profile.speed_limits)
    assert profile.durations_s.tolist() == runs.duration_s[0].tolist()
    assert profile.energies_j == pytest.approx(runs.energy_j[0], rel=1e-12)
    assert (np.diff(profile.durations_s) < -1e-9).all()
    assert profile.speed_limits[0] == 0.1
    every = MotionPaths(kr16(), START, END).simulate(np.linspace(0.1, 1.0, 19))
    assert profile.durations_s[-1] == every.duration_s.min()
    assert profile.peak_torque_ratio == every.peak_torque_ratio.max()


def test_parts_add_up(profile):
    assert tuple(profile.parts_j) == PARTS
    assert np.sum(list(profile.parts_j.values()), axis=0) == pytest.approx(profile.energies_j, rel=1e-9)


def test_the_optimum_is_the_run_with_the_least_energy(profile):
    best = int(np.argmin(profile.energies_j))
    assert profile.optimal_duration_s == profile.durations_s[best]
    assert profile.optimal_speed_limit_percent == pytest.approx(100.0 * profile.speed_limits[best])
    assert profile.energy_saving_j == pytest.approx(profile.energies_j[-1] - profile.energies_j[best])


def test_plain_data_is_ready_for_json(profile):
    data = json.loads(json.dumps(profile.to_dict(), allow_nan=False))
    assert data["duration_s"] == profile.durations_s.tolist()
    assert data["optimal_speed_limit_percent"] in data["speed_limit_percent"]
    assert data["warnings"] == []
    assert repr(profile).startswith("EnergyProfile('kuka_kr16_r2010_2': runs=")
    with pytest.raises(ValueError, match="read-only"):
        profile.energies_j[0] = 0.0


def test_torques_beyond_a_limit_are_said():
    beyond = replace(simulated_profile(kr16(), START, END, 2), peak_torque_ratio=1.234)
    assert beyond.warnings == (torque_warning(1.234),)
    assert "reaches 123.4 % of its peak limit: lighten" in beyond.warnings[0]
    hot = replace(beyond, rms_torque_ratio=1.1)
    assert "root mean square of 110.0 % of its continuous limit" in hot.warnings[1]


BAD = {
    "too few": (END, 1, "points: 1 is not a valid number of points; allowed: a whole number from 2 to 1000"),
    "too many": (END, 1001, "points: 1001 is not a valid number of points"),
    "not whole": (END, 2.5, "points: 2.5 is not a valid number of points"),
    "no motion": (START, 5, "start and end are the same: there is no motion"),
}


@pytest.mark.parametrize("end, points, message", BAD.values(), ids=BAD.keys())
def test_bad_input_is_one_sentence(end, points, message):
    with pytest.raises(InputError, match=message):
        simulated_profile(kr16(), START, end, points)
