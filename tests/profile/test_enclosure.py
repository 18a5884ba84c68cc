"""Enclosures: the curve lies between both profiles, whatever its shape."""

import numpy as np
import pytest

from robojoule.profile.enclosure import Enclosure, enclose
from robojoule.profile.piecewise import PiecewiseLinearProfile


@pytest.mark.parametrize("seed", range(5))
def test_convex_curves_are_enclosed(seed):
    rng = np.random.default_rng(seed)
    a, b, c = rng.uniform(50, 500), rng.uniform(0, 100), rng.uniform(100, 500)
    d = np.sort(rng.uniform(0.3, 2.0, 9))
    pair = enclose(PiecewiseLinearProfile(d, a / d + b + c * d))
    grid = np.linspace(d[0], d[-1], 2001)
    true = a / grid + b + c * grid
    assert (pair.above.value(grid) >= true - 1e-9).all()
    assert (pair.below.value(grid) <= true + 1e-9).all()
    assert pair.below.is_convex
    apart = pair.above.value(grid) - pair.below.value(grid)
    for segment in range(8):
        inside = (grid >= d[segment]) & (grid <= d[segment + 1])
        assert apart[inside].max() <= pair.difference_j[segment] + 1e-9


def test_concave_curves_are_enclosed_the_other_way_round():
    d = np.linspace(1.0, 2.0, 7)
    pair = enclose(PiecewiseLinearProfile(d, 100.0 - 50.0 * (d - 1.6) ** 2))
    grid = np.linspace(1.0, 2.0, 1001)
    true = 100.0 - 50.0 * (grid - 1.6) ** 2
    assert (pair.above.value(grid) >= true - 1e-9).all()
    assert (pair.below.value(grid) <= true + 1e-9).all()
    assert pair.below.value(d) == pytest.approx(100.0 - 50.0 * (d - 1.6) ** 2)  # the runs themselves


def test_a_curve_with_a_bump_keeps_it():
    d = np.linspace(0.0, 2.0 * np.pi, 41)
    pair = enclose(PiecewiseLinearProfile(d, 10.0 + np.sin(d)))
    grid = np.linspace(0.0, 2.0 * np.pi, 3001)
    assert (pair.above.value(grid) >= 10.0 + np.sin(grid) - 1e-4).all()
    assert (pair.below.value(grid) <= 10.0 + np.sin(grid) + 1e-4).all()
    assert not pair.above.is_convex
    assert (pair.above.value(grid) - pair.below.value(grid)).max() < 0.02


def test_one_segment_says_nothing_about_the_bend():
    pair = enclose(PiecewiseLinearProfile([1.0, 2.0], [5.0, 4.0]))
    assert pair.difference_j.tolist() == [np.inf]
    assert pair.widest_s.tolist() == [1.5]
    still = enclose(PiecewiseLinearProfile([0.0], [0.0]))
    assert still.difference_j.size == 0


@pytest.mark.parametrize(
    "function",
    [
        lambda d: 300.0 / d + 100.0 + 400.0 * d,
        lambda d: 500.0 - 200.0 * np.sqrt(np.maximum(d - 0.5, 0.0)) + 300.0 * d,
        lambda d: 300.0 / d + 40.0 * np.sin(3.0 * d) + 400.0 * d,
        lambda d: 200.0 * d,
    ],
    ids=["convex", "steep without end", "wavy", "straight"],
)
@pytest.mark.parametrize("count", [12, 60])
def test_curves_of_every_kind_are_enclosed(function, count):
    d = 0.5 + 2.5 * np.linspace(0.0, 1.0, count) ** 2
    samples = PiecewiseLinearProfile(d, function(d))
    pair = enclose(samples)
    fine = np.linspace(0.5, 3.0, 5001)
    lower, upper = pair.below.value(fine), pair.above.value(fine)
    assert (lower <= function(fine) + 1e-9).all()
    # Where the curvature changes its sign between two runs the curve may rise above both chords.
    assert (upper >= function(fine) * (1.0 - 0.2 / count**2) - 1e-9).all()
    assert lower.min() > function(fine).min() - 0.25 * np.ptp(function(fine))
    assert pair.fastest_j == function(d)[0]
    if samples.is_convex:
        assert pair.below.is_convex


def test_an_exact_profile_is_its_own_bound():
    line = PiecewiseLinearProfile([1.0, 2.0, 4.0], [5.0, 7.0, 8.0])
    pair = Enclosure.exact(line)
    assert pair.above is line and pair.below is line
    assert pair.fastest_j == 5.0
    assert pair.difference_j.tolist() == [0.0, 0.0]
