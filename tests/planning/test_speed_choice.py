"""Speed limits chosen together on measured profiles, against brute force; what a plan states of itself."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy import stats

from robojoule.planning.speed_choice import (
    cautious_energies,
    choose_speeds,
    choose_with_excess,
    controller_limits,
    late_probability,
    saving_interval,
    trial_place,
)
from robojoule.profile.measured import measured_profiles
from tests.calibration.machines import closed_cycle, joint_controller, observed

LIMITS = np.array([0.3, 0.45, 0.6, 0.8, 1.0])
OVER_LIMITS = (
    "allowed",
    "duration_s",
    "duration_deviation_s",
    "lasting_deviation_s",
    "duration_gradient_s",
    "energy_j",
    "energy_deviation_j",
    "energy_gradient_j",
)


@pytest.fixture(scope="module")
def profiles():
    paths, _ = closed_cycle(moves=5)
    runs = observed(paths, joint_controller(paths.robot), (1.0, 0.3), noise=0.02, seed=1)
    return measured_profiles(paths, runs, LIMITS)


@pytest.mark.parametrize("slack", [1.0, 1.2, 1.6, 3.0])
def test_no_other_choice_costs_less(profiles, slack):
    rows = np.arange(5)
    budget = slack * profiles.duration_s[:, -1].sum()
    idle = profiles.idle_w.min()

    def cost(places):
        taken = profiles.duration_s[rows, places].sum()
        return profiles.energy_j[rows, places].sum() + idle * (budget - taken) if taken <= budget + 1e-9 else np.inf

    best = min(cost(np.array(one)) for one in product(range(5), repeat=5))
    found = choose_speeds(profiles, budget)
    assert cost(found) <= best + 1e-4 * abs(best)
    same, excess_j = choose_with_excess(profiles, budget)
    assert (same == found).all()
    assert cost(found) - best - 1e-9 * abs(best) <= excess_j <= 1e-4 * abs(best)
    careful, excess_j = choose_with_excess(doubtful(profiles), budget, cautious=True)
    assert cost(careful) - best - 1e-9 * abs(best) <= excess_j <= cost(careful) - best + 1e-4 * abs(best)
    if slack == 1.2:
        assert cost(careful) > best + 1.0  # caution costs something here, by the profiles


def doubtful(profiles):
    """Profiles whose energies are known the worse the slower, those of every other motion."""
    share = 0.5 * (np.arange(5) % 2)[:, None] * (1.0 - LIMITS)
    return replace(profiles, energy_deviation_j=share * profiles.energy_j)


def test_of_equal_choices_the_one_whose_duration_is_surer_is_taken(profiles):
    """Each speed limit twice, with a deviation of its own once: only that tells the two apart."""
    twice = {name: np.repeat(getattr(profiles, name), 2, axis=1) for name in OVER_LIMITS}
    deviation = np.tile([0.0, 0.004], (5, LIMITS.size))
    for first in (0, 1):
        found = choose_speeds(
            replace(
                profiles,
                **twice | {"lasting_deviation_s": np.roll(deviation, first, axis=1)},
                speed_limits=np.repeat(LIMITS, 2),
                last_pass=None,
            ),
            1.4 * profiles.duration_s[:, -1].sum(),
        )
        assert (found % 2 == first).all()


def test_too_little_time_gives_no_choice(profiles):
    assert choose_speeds(profiles, 0.99 * profiles.duration_s[:, -1].sum()) is None


def test_caution_counts_differences_to_full_speed_only(profiles):
    cautious = cautious_energies(profiles)
    assert cautious[:, -1] == pytest.approx(profiles.energy_j[:, -1])
    assert (cautious[:, :-1] > profiles.energy_j[:, :-1]).all()


def test_a_plan_that_is_the_program_as_given_saves_nothing_for_sure(profiles):
    given = np.full(5, 4)
    waits = np.zeros((5, 2))
    saving, low, high = saving_interval(profiles, given, given, (waits, waits), (0.0, 0.0))
    assert saving == pytest.approx(0.0, abs=1e-9)
    unexplained = np.hypot(0.5, 0.5 * 100.0 * profiles.held_out_error)  # by no figure of the model
    assert high - low == pytest.approx(2.0 * 1.6449 * unexplained, rel=1e-3)
    misled = replace(profiles, held_out_error=0.7)  # a rule that misses everything says no less than one 10 % off
    assert saving_interval(misled, given, given, (waits, waits), (0.0, 0.0))[2] == pytest.approx(
        1.6449 * 5.025, rel=1e-3
    )


def test_probabilities_of_being_late():
    for margin in (-0.01, 0.0, 0.004, 0.016, 0.1):
        tail = stats.t.sf((margin + 1e-4 * 5.0) / 0.01, 2, loc=-0.19, scale=0.67)
        assert late_probability(margin, 0.01, 5.0) == pytest.approx(tail, rel=1e-9)
    assert late_probability(0.01, 0.0, 5.0) == 0.0
    assert late_probability(-4e-4, 0.0, 5.0) == 0.0  # not noticed
    assert late_probability(-6e-4, 0.0, 5.0) == 1.0


def test_a_controller_takes_multiples_of_its_step_and_full_speed():
    assert controller_limits(0.01, 0.1)[[0, 1, -1]] == pytest.approx([0.1, 0.11, 1.0])
    assert controller_limits(0.3, 0.01) == pytest.approx([0.3, 0.6, 0.9, 1.0])


def test_the_second_trial_is_the_slowest_that_fits_and_no_faster_than_four_fifths():
    totals = np.array([10.0, 8.0, 6.0, 5.0, 4.5])
    assert trial_place(totals, 8.5, LIMITS) == 1
    assert LIMITS[trial_place(totals, 1.0, LIMITS)] == pytest.approx(0.8)
