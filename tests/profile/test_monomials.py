"""Sums of powers as energy profiles: slopes against differences, the duration at a price, what is refused."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.profile.monomials import MonomialProfile
from robojoule.profile.piecewise import PiecewiseLinearProfile

PROFILE = MonomialProfile(0.5, 4.0, ((-1.0, 300.0), (0.0, 20.0), (1.0, 200.0), (2.0, 3.0)))


def test_the_slope_is_that_of_the_energy():
    d = np.linspace(0.6, 3.9, 30)
    step = 1e-6
    difference = (PROFILE.value(d + step) - PROFILE.value(d - step)) / (2 * step)
    assert PROFILE.marginal_power_w(d) == pytest.approx(difference, rel=1e-6, abs=1e-4)


def test_the_least_energy_of_one_over_d_has_a_closed_form():
    simple = MonomialProfile(0.1, 10.0, ((-1.0, 450.0), (1.0, 200.0)))
    assert simple.duration_at(0.0) == pytest.approx((450.0 / 200.0) ** 0.5, rel=1e-12)
    assert simple.duration_at(-1e9) == 0.1
    assert simple.duration_at(1e9) == 10.0


@pytest.mark.parametrize(
    ("window", "terms", "problem"),
    [
        ((0.0, 1.0), ((0.0, 1.0),), "holds no duration"),
        ((2.0, 1.0), ((0.0, 1.0),), "holds no duration"),
        ((1.0, 2.0), (), "needs terms"),
        ((1.0, 2.0), ((0.0, float("nan")),), "needs terms"),
        ((1.0, 2.0), ((-1.0, -1.0), (0.0, 10.0)), "concave"),
        ((1.0, 2.0), ((0.5, 1.0),), "concave"),
        ((1.0, 2.0), ((100.0, 1.0),), "the degree 100 of a term is out of range; allowed: -20 to 20"),
        ((1e-5, 2.0), ((-20.0, 1.0),), "reaches 2e.106 J, or W of slope"),
        ((1.0, 5.0), ((20.0, 1.0),), "reaches .* J, or W of slope"),
        ((1.0, 2.0), ((0.0, -10.0), (1.0, 6.0)), "falls to -4 J"),
    ],
)
def test_what_is_not_convex_or_negative_is_refused(window, terms, problem):
    with pytest.raises(InputError, match=problem):
        MonomialProfile(*window, terms)


def test_a_piecewise_profile_answers_the_same_questions():
    d = np.linspace(0.5, 4.0, 4001)
    sampled = PiecewiseLinearProfile(d, PROFILE.value(d))
    for price in (-300.0, 0.0, 100.0):
        assert sampled.duration_at(price) == pytest.approx(PROFILE.duration_at(price), abs=2e-3)
    inside = np.array([0.7, 1.5, 3.0])
    assert sampled.marginal_power_w(inside) == pytest.approx(PROFILE.marginal_power_w(inside), rel=1e-2)
    assert PiecewiseLinearProfile([1.0], [5.0]).marginal_power_w(1.0) == 0.0
