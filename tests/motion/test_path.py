"""Straight paths through joint space."""

import numpy as np
import pytest

from robojoule.motion.dynamics import chebyshev_basis
from robojoule.motion.path import CurvedPath, Path, StraightPath
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


def test_curves_are_derived_from_their_positions():
    rng = np.random.default_rng(2)
    curve = CurvedPath(np.concatenate([rng.normal(size=(6, 3, 1)), rng.uniform(0.1, 1.0, (6, 3, 4))], axis=2))
    s, step = np.array([0.2, 0.5, 0.8]), 1e-5
    before, at, after = (curve.positions_rad(ROWS, s + k * step).swapaxes(0, 1) for k in (-1, 0, 1))
    assert curve.slopes_rad(ROWS, s) == pytest.approx((after - before) / (2 * step), abs=1e-7)
    assert curve.curvatures_rad(ROWS, s) == pytest.approx((after - 2 * at + before) / step**2, abs=1e-4)
    for values, series in (
        (curve.slopes_rad(ROWS, s), curve.slope_series_rad(ROWS)),
        (curve.curvatures_rad(ROWS, s), curve.curvature_series_rad(ROWS)),
    ):
        assert series @ chebyshev_basis(s, series.shape[2]).T == pytest.approx(values, abs=1e-13)
    test_travel_and_steepest_slope_bound_the_path(_wide(curve))


def _wide(curve):
    """The same for six joints."""
    return CurvedPath(np.tile(curve.coefficients_rad, (1, 2, 1)))
