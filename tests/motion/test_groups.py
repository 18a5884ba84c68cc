"""Motions that run at one speed limit, and motions with payloads that differ."""

from dataclasses import fields

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.motion.groups import Load, LoadedMotions, TiedMotions
from robojoule.motion.simulation import MotionPaths, MotionRuns
from robojoule.robots.robot import Payload
from tests.core_cases import SPEED_LIMITS, kr16, random_motions

LARGEST = ("peak_power_w", "peak_torque_ratio")


@pytest.fixture(scope="module")
def lines():
    return MotionPaths(kr16(), *random_motions(kr16(), 6))


@pytest.fixture(scope="module")
def tied(lines):
    return TiedMotions(lines, np.array([0, 1, 0, 3, 1, 0]))


def test_tied_motions_are_the_sum_of_their_runs(lines, tied):
    limits = np.linspace(0.2, 0.9, 6)[:, None]
    runs = tied.simulate(limits)
    each = lines.simulate(limits[tied.owner])
    for field in fields(MotionRuns):
        if field.name != "speed_limit":
            total = np.max if field.name in LARGEST else np.sum
            first = total(getattr(each, field.name)[[0, 2, 5]], axis=0)
            assert getattr(runs, field.name)[0] == pytest.approx(first, rel=1e-12)
    assert tied.moving.tolist() == [True, True, False, True, False, False]
    assert (runs.energy_j[[2, 4, 5]] == 0.0).all()
    assert runs.duration_s == pytest.approx(tied.durations(limits))
    assert np.array_equal(tied.idle_power_end_w, lines.idle_power_end_w)


def test_speed_limits_of_tied_motions(tied):
    wanted = tied.durations([0.4])[:, 0]
    found = tied.speed_limits_for_durations(wanted)
    assert found[tied.moving] == pytest.approx(0.4, rel=1e-6)
    fastest = tied.durations(tied.fastest_speed_limits()[:, None])[:, 0]
    assert fastest == pytest.approx(tied.minimum_durations(), rel=1e-12)
    with pytest.raises(InputError, match="motion 1 cannot take"):
        tied.speed_limits_for_durations(0.5 * wanted)


def test_some_of_tied_motions(tied):
    whole, part = tied.simulate(SPEED_LIMITS), tied.subset(np.array([3, 0])).simulate(SPEED_LIMITS)
    assert part.energy_j == pytest.approx(whole.energy_j[[3, 0]], rel=1e-12)


@pytest.fixture(scope="module")
def loaded(lines):
    start, end = lines.start_rad, lines.start_rad + lines.delta_rad
    heavy, light = kr16().carrying(Payload(15.0, (0.1, 0.0, 0.2))), kr16()
    parts = ((light, [0, 1, 4]), (heavy, [2, 3, 5]))
    loads = [Load(np.array(rows), np.array(rows), MotionPaths(robot, start[rows], end[rows])) for robot, rows in parts]
    return LoadedMotions(loads, np.array([5, 0, 1, 2, 3, 4]))


def test_motions_with_other_payloads_are_those_of_other_robots(lines, loaded):
    runs = loaded.simulate(SPEED_LIMITS)
    assert np.array_equal(runs.energy_j[[0, 1, 4]], lines.simulate(SPEED_LIMITS).energy_j[[0, 1, 4]])
    start, end = lines.start_rad, lines.start_rad + lines.delta_rad
    heavy = kr16().carrying(Payload(15.0, (0.1, 0.0, 0.2)))
    other = MotionPaths(heavy, start[[2, 3, 5]], end[[2, 3, 5]])
    assert np.array_equal(runs.duration_s[[2, 3, 5]], other.simulate(SPEED_LIMITS).duration_s)
    assert loaded.durations(SPEED_LIMITS) == pytest.approx(runs.duration_s, rel=1e-12)
    assert np.array_equal(loaded.simulate_moves(np.tile(SPEED_LIMITS, (6, 1))).energy_j, runs.energy_j)
    part = loaded.subset(np.array([3, 4])).simulate(SPEED_LIMITS)
    assert np.array_equal(part.energy_j, runs.energy_j[[3, 4]])


def test_a_stop_is_held_with_what_was_brought_there(loaded):
    assert np.array_equal(loaded.idle_power_start_w, loaded.idle_power_end_w[loaded.before])
    start, end = loaded.standing_torque_nm
    assert np.array_equal(start, end[loaded.before])


def test_a_robot_carries_another_payload_within_its_rating():
    loaded = kr16(3.0).carrying(Payload(10.0))
    start, end = random_motions(loaded, 5)
    one, other = (MotionPaths(robot, start, end).simulate([0.5]).energy_j for robot in (loaded, kr16(10.0)))
    assert np.array_equal(one, other)
    with pytest.raises(InputError, match="a payload of 40 kg is more than kuka_kr16_r2010_2 is rated for"):
        loaded.carrying(Payload(40.0))
