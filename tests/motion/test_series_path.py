"""Series against polynomials of the same curve, and their derivatives against differences."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from robojoule.motion.dynamics import LIMIT_NODES, node_counts, path_torques
from robojoule.motion.path import CurvedPath
from robojoule.motion.series_path import SeriesPath
from tests.core_cases import kr16

S = np.linspace(0.0, 1.0, 9)
ROWS = np.array([2, 0])


@pytest.fixture(scope="module")
def both():
    rng = np.random.default_rng(2)
    curves = np.cumsum(np.abs(rng.normal(0.0, 0.05, (3, 6, 7))), axis=2) * np.array([1.0, 1, 1, 1, 0.5, 0.3, 0.1])
    back = np.zeros_like(curves)
    for row in np.ndindex(3, 6):
        series = chebyshev.chebinterpolate(lambda x, c=curves[row]: np.polyval(c[::-1], (x + 1.0) / 2.0), 6)
        back[row] = series
    return CurvedPath(curves), SeriesPath(back)


def test_a_series_is_the_polynomial_of_the_same_curve(both):
    polynomial, series = both
    for name in ("start_rad", "delta_rad", "travel_rad"):
        np.testing.assert_allclose(getattr(series, name), getattr(polynomial, name), atol=1e-13)
    np.testing.assert_allclose(series.steepest_rad, polynomial.steepest_rad, rtol=1e-9)
    assert series.degree == polynomial.degree
    for name in ("positions_rad", "slopes_rad", "curvatures_rad"):
        one, other = (getattr(path, name)(ROWS, S) for path in both)
        np.testing.assert_allclose(other, one, atol=1e-11)
    for name in ("slope_series_rad", "curvature_series_rad"):
        np.testing.assert_allclose(getattr(series, name)(ROWS), getattr(polynomial, name)(ROWS), atol=1e-11)
    at = np.array([[0.1, 0.7], [0.3, 0.9]])
    np.testing.assert_allclose(series.slopes_rad(ROWS, at), polynomial.slopes_rad(ROWS, at), atol=1e-11)
    np.testing.assert_allclose(series.of(ROWS).delta_rad, polynomial.delta_rad[ROWS], atol=1e-13)


def test_torques_along_it_are_those_of_the_polynomial(both):
    one, other = (path_torques(kr16(), path) for path in both)
    np.testing.assert_allclose(other.values, one.values, atol=1e-8)


def test_paths_of_a_high_degree_get_enough_nodes():
    """The factors of the torques take nodes for each degree: short ladders have none left for the path itself."""
    counts = node_counts(kr16(), np.full((1, 6), 0.02), degree=20)
    assert counts[0] > 2 * 19 + 1
    assert node_counts(kr16(), np.full((1, 6), 0.02), degree=1)[0] < LIMIT_NODES
