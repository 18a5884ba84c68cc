"""The gate before the registry."""

import numpy as np

from reproduction.predictors.gate import passes_gate
from robojoule.profile.parameters import profile_parameters

TRUTH = np.array([[10.0, 1.0, 50.0], [30.0, 2.0, 70.0], [20.0, 3.0, 90.0]])


def test_better_than_the_mean_and_than_every_rival_passes():
    assert passes_gate(TRUTH + 0.1, TRUTH, TRUTH)
    assert passes_gate(TRUTH + 0.1, TRUTH, TRUTH, [TRUTH + 0.2])


def test_worse_than_the_mean_or_a_rival_in_one_target_fails():
    wrong = TRUTH + np.array([0.0, 5.0, 0.0])
    assert not passes_gate(wrong, TRUTH, TRUTH)
    assert not passes_gate(TRUTH + 0.1, TRUTH, TRUTH, [TRUTH + 0.2, TRUTH + np.array([9.0, 0.05, 9.0])])
    assert not passes_gate(np.full_like(TRUTH, np.nan), TRUTH, TRUTH)


def test_parameters_of_a_profile_are_its_saving_optimum_and_penalty():
    duration = np.array([[4.0, 2.0, 1.0], [0.0, 0.0, 0.0], [3.0, 2.0, 2.0]])
    energy = np.array([[9.0, 5.0, 7.0], [0.0, 0.0, 0.0], [8.0, 6.0, 6.0]])
    assert profile_parameters(duration, energy).tolist() == [[2.0, 2.0, 4.0], [0.0, 0.0, 0.0], [0.0, 2.0, 2.0]]
