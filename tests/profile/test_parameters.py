"""Saving, optimal duration and penalty: of whole tables, and the same for one profile."""

import numpy as np
import pytest

from robojoule.profile.parameters import optimal_run, profile_parameters, steepness
from robojoule.profile.sampled import sampled_profile

# Slowest run first, as by rising speed limit; in the second motion two runs are equally good, in the third the last two
# speed limits give the same run and the fastest one is the best.
DURATIONS_S = np.array([[4.0, 2.0, 1.5, 1.0], [4.0, 2.0, 1.5, 1.0], [4.0, 2.0, 1.0, 1.0]])
ENERGIES_J = np.array([[90.0, 30.0, 40.0, 70.0], [90.0, 30.0, 30.0, 70.0], [90.0, 50.0, 40.0, 40.0]])


def test_the_best_run_is_the_fastest_of_several():
    assert optimal_run(DURATIONS_S, ENERGIES_J).tolist() == [1, 2, 2]


def test_parameters_are_energies_against_the_best_run():
    assert profile_parameters(DURATIONS_S, ENERGIES_J).tolist() == [
        [40.0, 2.0, 60.0],
        [40.0, 1.5, 60.0],
        [0.0, 1.0, 50.0],
    ]


def test_the_order_of_the_runs_does_not_matter():
    turned = profile_parameters(DURATIONS_S[:, ::-1], ENERGIES_J[:, ::-1])
    np.testing.assert_array_equal(turned, profile_parameters(DURATIONS_S, ENERGIES_J))


def test_one_profile_has_the_parameters_of_the_table():
    for d, e, expected in zip(DURATIONS_S, ENERGIES_J, profile_parameters(DURATIONS_S, ENERGIES_J), strict=True):
        profile = sampled_profile(d, e, [0.1, 0.2, 0.5, 1.0])
        assert (profile.saving_j, profile.durations_s[profile.optimum], profile.penalty_j) == tuple(expected)
        assert profile.steepness_j_per_s == steepness(expected[np.newaxis], d.min(keepdims=True))[0]


def test_steepness_is_saving_a_second_and_zero_without_either():
    rows = np.array([[30.0, 1.5, 0.0], [30.0, 1.0, 0.0], [0.0, 2.0, 0.0], [-3.0, 2.0, 0.0]])
    assert steepness(rows, np.ones(4)).tolist() == [60.0, 0.0, 0.0, 0.0]


def test_further_runs_join_a_profile():
    first = sampled_profile([4.0, 1.0], [90.0, 70.0], [0.1, 1.0])
    joined = first.joined([2.0, 1.0 + 1e-8], [30.0, 71.0], [0.2, 0.9], 1e-6)
    assert joined.durations_s.tolist() == pytest.approx([1.0, 2.0, 4.0])
    assert joined.energies_j.tolist() == [70.0, 30.0, 90.0]


def test_parameters_of_a_profile_are_its_saving_optimum_and_penalty():
    duration = np.array([[4.0, 2.0, 1.0], [0.0, 0.0, 0.0], [3.0, 2.0, 2.0]])
    energy = np.array([[9.0, 5.0, 7.0], [0.0, 0.0, 0.0], [8.0, 6.0, 6.0]])
    assert profile_parameters(duration, energy).tolist() == [[2.0, 2.0, 4.0], [0.0, 0.0, 0.0], [0.0, 2.0, 2.0]]
