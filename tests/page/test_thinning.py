"""Fewer numbers for the same picture: no point is missed by more than was allowed, and no rounding adds up."""

from itertools import pairwise

import numpy as np
import pytest

from robojoule.page.thinning import in_steps, needed_points


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("tolerance", [0.0, 0.1, 1.0])
def test_lines_between_points_that_stay_miss_none_by_more(seed, tolerance):
    draws = np.random.default_rng(seed)
    count = int(draws.integers(1, 60))
    x, y = np.sort(draws.integers(0, 40, count) / 3.0), draws.normal(size=count).cumsum()
    kept = needed_points(x, y, tolerance)
    assert (kept[0], kept[-1]) == (0, count - 1) and (np.diff(kept) > 0).all()
    for first, last in pairwise(kept):
        for point in range(first + 1, last):
            line = y[first] + (y[last] - y[first]) * (x[point] - x[first]) / (x[last] - x[first])
            assert abs(line - y[point]) <= tolerance + 1e-9


def test_a_parabola_needs_as_many_points_as_its_curvature_says():
    """Over a length l, a chord through two points of x^2 bows by l^2 / 4; bows on both sides allow twice that."""
    x = np.linspace(0.0, 10.0, 10_001)
    segments = len(needed_points(x, x**2, 0.01)) - 1
    assert 10.0 / (2.0 * np.sqrt(2.0 * 0.01)) <= segments <= 10.0 / (2.0 * np.sqrt(0.01)) + 1


def test_points_on_a_line_are_two():
    x = np.linspace(0.0, 1.0, 100)
    assert needed_points(x, 3.0 * x, 1e-9).tolist() == [0, 99]


def test_rounding_does_not_add_up():
    values = np.cumsum(np.full(1000, 0.0149))
    assert np.abs(np.cumsum(in_steps(values, 0.01)) * 0.01 - values).max() <= 0.005 + 1e-9
    assert in_steps([], 1.0) == []
