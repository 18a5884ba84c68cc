"""How probable rules are: against the exact probability of a linear rule, and which of several is taken."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from scipy import stats

from robojoule.calibration.timing_fit import Durations, best_rules, fit_rule, rule_scores
from robojoule.calibration.timing_rules import candidates
from tests.calibration.machines import closed_cycle, joint_controller, observed


@dataclass
class LinearRule:
    """Durations that are linear in the entries, so that probabilities are known exactly."""

    slopes: np.ndarray  # (R, P)
    mean: np.ndarray = field(default_factory=lambda: np.array([0.5, 0.2]))
    spread: np.ndarray = field(default_factory=lambda: np.array([0.3, 0.1]))
    exponent = None
    is_own = False

    def evaluate(self, x, motion, limits):
        return x @ self.slopes.T, np.broadcast_to(self.slopes, (len(x), *self.slopes.shape))

    def clipped(self, x):
        return x


def durations_of(seconds, limits, resolution_s=0.004):
    motion = np.arange(seconds.size) // 2
    return Durations.of(motion, np.tile(limits, seconds.size // 2)[None], seconds[None], resolution_s)


@pytest.fixture(scope="module")
def linear():
    slopes = np.stack([np.linspace(0.5, 2.0, 8), np.tile([1.0, 3.0], 4)], axis=1)
    rule = LinearRule(slopes)
    seconds = slopes @ np.array([0.6, 0.25]) + 0.001 * np.array([1, -1, 2, 0, -2, 1, 0, -1])
    return rule, durations_of(seconds, [1.0, 0.4])


def test_the_probability_is_that_of_all_durations_with_the_entries_integrated_out(linear):
    rule, durations = linear
    fit = fit_rule(rule, durations)
    noise = durations.deviation_s[0]
    covariance = np.diag(noise**2) + rule.slopes @ np.diag(rule.spread**2) @ rule.slopes.T
    exact = stats.multivariate_normal(rule.slopes @ rule.mean, covariance).logpdf(durations.duration_s[0])
    same_for_all_rules = np.log(noise).sum() + noise.size / 2.0 * np.log(2.0 * np.pi)
    assert -fit.improbability[0] - same_for_all_rules == pytest.approx(exact, abs=1e-6)
    assert fit.explained[0]


def test_a_rule_with_more_room_for_the_same_durations_is_less_probable(linear):
    rule, durations = linear
    wide = replace(rule, spread=30.0 * rule.spread)
    fits = [fit_rule(wide, durations), fit_rule(rule, durations)]
    assert best_rules(fits).tolist() == [1]
    scores = rule_scores(fits)[:, 0]
    assert scores[0] - scores[1] == pytest.approx(2.0 * np.log(30.0), rel=0.2)


def test_durations_that_no_rule_explains_are_judged_by_motions_left_out(linear):
    rule, durations = linear
    missed = replace(durations, duration_s=durations.duration_s * (1.0 + 0.2 * (np.arange(8) % 3 - 1)))
    fits = [fit_rule(rule, missed), fit_rule(replace(rule, spread=2.0 * rule.spread), missed)]
    assert not any(fit.explained[0] for fit in fits)
    assert (rule_scores(fits)[:, 0] == [fit.left_out_improbability[0] for fit in fits]).all()


def test_runs_at_one_speed_limit_are_judged_by_motions_left_out():
    paths = closed_cycle(moves=10)[0]
    runs = observed(paths, joint_controller(paths.robot), (1.0,))
    durations = Durations.of(runs.motion, runs.speed_limits[None], runs.duration_s[None], runs.resolution_s)
    fits = [fit_rule(candidate, durations) for candidate in candidates(paths, (0.0,))]
    assert (rule_scores(fits)[:, 0] == [fit.left_out_improbability[0] for fit in fits]).all()


def test_what_a_fit_leaves_free_is_what_its_entries_do_not_take(linear):
    rule, durations = linear
    loose = fit_rule(replace(rule, spread=1e3 * rule.spread), durations)
    tight = fit_rule(replace(rule, spread=1e-6 * rule.spread), durations)
    assert loose.freedom[0] == pytest.approx(1.0 - 2.0 / 8.0, abs=1e-3)
    assert tight.freedom[0] == pytest.approx(1.0, abs=1e-3)
