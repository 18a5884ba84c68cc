"""Quadrature against analytic integrals, smooth and kinked, and against the time law itself."""

import numpy as np
import pytest

from robojoule.motion.quadrature import lobatto, run_quadrature
from robojoule.motion.time_laws import path_law


@pytest.fixture(scope="module")
def law():
    """Runs with and without cruise and plateau, shape (2, 3)."""
    velocity = np.array([[0.1, 1.0, 1.5], [0.4, 1.2, 2.0]])
    return path_law(velocity, np.array([[20.0, 5.0, 30.0], [1.0, 12.0, 60.0]]), 0.1)


def instants(law, quadrature):
    """Times of the nodes, from the law's own phases."""
    starts = np.cumsum(law.duration_s, axis=-1) - law.duration_s
    return quadrature._polynomials(starts, law.duration_s)


@pytest.mark.parametrize("nodes", [3, 8, 12, 25])
def test_polynomials_are_integrated_and_derived_exactly(nodes):
    x, integrals, slopes = lobatto(nodes)
    assert x[[0, -1]] == pytest.approx([0.0, 1.0], abs=1e-15)
    assert np.all(np.diff(x) > 0)
    for power in range(nodes):
        assert integrals @ x**power == pytest.approx(x ** (power + 1) / (power + 1), abs=1e-13)
        assert slopes @ x**power == pytest.approx(power * x ** max(power - 1, 0), abs=1e-9)
    for power in range(nodes, 2 * nodes - 2):  # the weights are exact up to degree 2 N - 3
        assert integrals[-1] @ x**power == pytest.approx(1.0 / (power + 1), abs=1e-13)


@pytest.mark.parametrize("nodes", [13, 29])
def test_states_are_those_of_the_law(law, nodes):
    quadrature = run_quadrature(nodes)
    states, times = quadrature.states(law), instants(law, quadrature)
    for run in np.ndindex(2, 3):
        one = law.of(run[0]).of(run[1])
        for found, expected in zip(states, one.at(times[run]), strict=False):
            assert found[run] == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


def test_integrals_over_a_run(law):
    quadrature = run_quadrature(13)
    position, velocity, acceleration = quadrature.states(law)
    weights = quadrature.weights(law)
    assert weights.sum(axis=-1) == pytest.approx(law.duration_s.sum(axis=-1), rel=1e-13)
    assert (velocity * weights).sum(axis=-1) == pytest.approx(np.ones((2, 3)), abs=1e-9)
    assert (acceleration * weights).sum(axis=-1) == pytest.approx(np.zeros((2, 3)), abs=1e-9)
    assert (position * weights).sum(axis=-1) == pytest.approx(law.duration_s.sum(axis=-1) / 2.0, rel=1e-9)


def test_positive_part_of_lines_in_time(law):
    """Lines that change sign anywhere, also within the shortest phases and at their ends."""
    quadrature = run_quadrature(13)
    times, total = instants(law, quadrature), law.duration_s.sum(axis=-1)
    for share in np.append(np.linspace(0.0, 1.0, 41), 0.003):
        root = share * total
        rising, falling = times - root[..., None], root[..., None] - times
        assert quadrature.positive_part(rising, law) == pytest.approx((total - root) ** 2 / 2.0, abs=1e-12)
        assert quadrature.positive_part(falling, law) == pytest.approx(root**2 / 2.0, abs=1e-12)


def test_positive_part_of_waves(law):
    quadrature = run_quadrature(29)
    times, total = instants(law, quadrature), law.duration_s.sum(axis=-1)
    turns = 2.0 * np.pi * times / total[..., None]
    assert quadrature.positive_part(np.sin(turns), law) == pytest.approx(total / np.pi, rel=1e-4)
    assert quadrature.positive_part(-np.sin(turns), law) == pytest.approx(total / np.pi, rel=1e-4)
    assert quadrature.positive_part(2.0 + np.sin(turns), law) == pytest.approx(2.0 * total, rel=1e-9)
    assert np.all(quadrature.positive_part(-2.0 - np.sin(turns), law) == 0.0)


def test_positive_part_where_a_narrow_dip_turns_between_two_nodes(law):
    """Parabolas with one root just before a node and one well behind it: the secant there points at the extremum."""
    quadrature = run_quadrature(13)
    times, total = instants(law, quadrature), law.duration_s.sum(axis=-1)
    widths = np.diff(times, axis=-1)
    for node in range(1, quadrature.count - 1):
        first = times[..., node] - 0.05 * widths[..., node - 1]
        last = times[..., node] + 0.8 * widths[..., node]
        values = (times - first[..., None]) * (times - last[..., None])
        seen = widths[..., node - 1] > 1e-6  # else the root is on the node
        dip = (last - first) ** 3 / 6.0
        whole = total**3 / 3.0 - (first + last) * total**2 / 2.0 + first * last * total
        for sign, expected in ((1.0, whole + dip), (-1.0, dip)):
            error = np.abs(quadrature.positive_part(sign * values, law) - expected)[seen]
            assert error.max(initial=0.0) <= 1e-3 * dip.max() + 1e-9


@pytest.mark.parametrize("power", range(4))
def test_polynomials_over_the_times_of_positive_lines(law, power):
    """Lines that change sign anywhere, and integrals of powers of time while they are positive."""
    quadrature = run_quadrature(13)
    times, total = instants(law, quadrature), law.duration_s.sum(axis=-1)
    for share in np.append(np.linspace(0.0, 1.0, 41), 0.003):
        root = share * total
        before, whole = (x ** (power + 1) / (power + 1) for x in (root, total))
        for values, expected in ((times - root[..., None], whole - before), (root[..., None] - times, before)):
            found = (quadrature.positive_weights(values, law) * times**power).sum(axis=-1)
            assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_positive_weights_are_the_derivatives_of_the_positive_part(law):
    """Rough values with many changes of sign, against central differences; and Euler's theorem."""
    quadrature = run_quadrature(13)
    values = np.random.default_rng(0).standard_normal((2, 3, quadrature.count))
    weights = quadrature.positive_weights(values, law)
    assert (weights * values).sum(axis=-1) == pytest.approx(quadrature.positive_part(values, law), rel=1e-9)
    for node in range(quadrature.count):
        step = 1e-6 * (np.arange(quadrature.count) == node)
        above, below = (quadrature.positive_part(values + change, law) for change in (step, -step))
        assert weights[..., node] == pytest.approx((above - below) / 2e-6, abs=1e-6)
