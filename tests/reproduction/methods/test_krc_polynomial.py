"""The original plug-in: its profiling runs, the polynomial through them, its chords."""

import numpy as np
import pytest

from reproduction.methods.krc_polynomial import KrcPolynomial, polynomial_costs, profiling_speed_limits
from reproduction.methods.method import Variant
from reproduction.methods.polynomial_profile import fit_polynomial
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.chain import chain_plans
from robojoule.profile.sampled import sampled_profiles
from tests.core_cases import kr16
from tests.planning.trees import busy_tree, tree

SLOWEST = 0.15


@pytest.fixture(scope="module")
def batch():
    return TreeBatch(kr16(), [tree(), busy_tree()], 0.1)


def test_profiling_runs_are_distinct_and_equidistant(batch):
    moving = batch.paths.moving
    by_speed = profiling_speed_limits(batch, "speed", SLOWEST)
    assert np.diff(by_speed, n=2, axis=1) == pytest.approx(0.0, abs=1e-12)
    durations = batch.paths.durations(by_speed)[moving]
    assert (np.diff(durations, axis=1) < -1e-6).all()
    by_duration = batch.paths.durations(profiling_speed_limits(batch, "duration", SLOWEST))
    assert np.diff(by_duration, n=2, axis=1) == pytest.approx(0.0, abs=1e-7)
    assert by_duration[:, 0] == pytest.approx(batch.d_min_s, abs=1e-9)
    slowest_s = batch.paths.durations([SLOWEST])[:, 0]
    assert by_duration[:, -1] == pytest.approx(slowest_s, abs=1e-9)
    with pytest.raises(InputError, match="unknown spacing 'energy'; allowed: speed, duration"):
        profiling_speed_limits(batch, "energy", SLOWEST)


def test_polynomial_costs_cover_the_whole_range_even_without_length(batch):
    limits = profiling_speed_limits(batch, "speed", SLOWEST)
    runs = batch.paths.simulate(limits)
    profiles = sampled_profiles(runs.duration_s, runs.energy_j, limits)
    costs = polynomial_costs(profiles, 4, np.full(11, 1.0), np.full(11, 2.0))
    for v, cost in enumerate(costs):
        assert cost.profile.segments == (4 if batch.paths.moving[v] else 0)
        assert cost.profile.d_min_s == pytest.approx(batch.d_min_s[v])
        assert cost.profile.d_max_s == pytest.approx(batch.paths.durations([SLOWEST])[v, 0])
        assert (cost.idle_prior_w, cost.idle_post_w) == (1.0, 2.0)


def test_both_planners_find_the_same_energy(batch):
    times = batch.least_cycles_s[:, None] * np.array([1.1, 1.6])
    by_model = KrcPolynomial(4, "speed", batch.idle_post_w, SLOWEST)
    by_chain = KrcPolynomial(4, "speed", batch.idle_post_w, SLOWEST, chain_plans)
    assert by_model.variant == Variant("krc_polynomial", 4, "speed")
    assert by_model.variant.name == "krc_polynomial_4"
    for one, other in zip(by_model.plan(batch, times).plans, by_chain.plan(batch, times).plans, strict=True):
        assert [plan.energy_j for plan in one] == pytest.approx([plan.energy_j for plan in other], rel=1e-9)


class TestPolynomial:
    TRUE = np.array([5.0, 300.0, 120.0, 410.0])

    def energy(self, d):
        return self.TRUE[0] / d**2 + self.TRUE[1] / d + self.TRUE[2] + self.TRUE[3] * d

    @pytest.mark.parametrize("scale", [1.0, 0.02, 40.0], ids=["seconds", "short", "long"])
    def test_a_polynomial_is_found_again(self, scale):
        d = scale * np.array([0.6, 0.8, 1.1, 1.9, 3.7])
        profile = fit_polynomial(d, self.energy(d))
        assert profile.value(d) == pytest.approx(self.energy(d), rel=1e-10)
        assert profile.coefficients == pytest.approx(self.TRUE, rel=1e-5)

    def test_least_squares_leave_a_residual_orthogonal_to_the_powers(self):
        d = np.array([0.6, 0.8, 1.1, 1.9, 3.7])
        e = np.array([1000.0, 900.0, 950.0, 1200.0, 1500.0])
        residual = fit_polynomial(d, e).value(d) - e
        assert np.abs(residual).max() > 1.0
        for power in (-2, -1, 0, 1):
            assert residual @ d**power == pytest.approx(0.0, abs=1e-6)

    def test_chords_meet_the_polynomial_at_equidistant_durations(self):
        d = np.array([0.6, 0.8, 1.1, 1.9, 3.6])
        chords = fit_polynomial(d, self.energy(d)).chords(4)
        assert chords.durations_s == pytest.approx([0.6, 1.35, 2.1, 2.85, 3.6])
        assert chords.energies_j == pytest.approx(self.energy(chords.durations_s))

    def test_too_few_runs_are_refused(self):
        with pytest.raises(ValueError, match="four distinct"):
            fit_polynomial([1.0, 2.0, 3.0, 3.0], [1.0, 2.0, 3.0, 3.0])
        with pytest.raises(ValueError, match="positive"):
            fit_polynomial([0.0, 1.0, 2.0, 3.0], [1.0, 2.0, 3.0, 3.0])
