"""Straight paths through joint space."""

import numpy as np
import pytest

from robojoule.motion.dynamics import chebyshev_basis
from robojoule.motion.path import Path, StraightPath
from tests.core_cases import kr16, random_motions

ROWS = np.array([3, 0, 4])


@pytest.fixture(scope="module")
def ends():
    return random_motions(kr16(), 6)


@pytest.fixture(scope="module")
def path(ends):
    return StraightPath.between(*ends)


def test_ends_are_those_given(ends, path):
    at = path.positions_rad(slice(None), np.array([0.0, 1.0]))
    assert np.array_equal(at[:, :, 0].T, ends[0])
    assert at[:, :, 1].swapaxes(0, 1) == pytest.approx(ends[1], abs=1e-15)
    single = StraightPath.between(ends[0][0], ends[1][0])
    assert single.start_rad.shape == (1, 6)


def test_slopes_are_derivatives_of_positions(path):
    s, step = np.array([0.1, 0.5, 0.8]), 1e-6
    before, after = (path.positions_rad(ROWS, s + k * step) for k in (-1, 1))
    slopes = np.broadcast_to(path.slopes_rad(ROWS, s), (3, 6, 3))
    assert slopes.swapaxes(0, 1) == pytest.approx((after - before) / (2 * step), abs=1e-8)
    series = path.slope_series_rad(ROWS)
    assert series @ chebyshev_basis(s, series.shape[2]).T == pytest.approx(slopes, abs=1e-15)


def test_travel_and_steepest_slope_bound_the_path(path: Path):
    s = np.linspace(0.0, 1.0, 50)
    at = path.positions_rad(slice(None), s)
    assert np.abs(np.diff(at, axis=2)).sum(axis=2).swapaxes(0, 1) == pytest.approx(path.travel_rad, abs=1e-12)
    slopes = np.abs(np.broadcast_to(path.slopes_rad(slice(None), s), (6, 6, 50)))
    assert slopes.max(axis=2) == pytest.approx(path.steepest_rad)
