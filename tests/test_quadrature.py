"""Quadrature against analytic integrals, smooth and kinked."""

import numpy as np
import pytest

from robojoule.quadrature import phase_quadrature


@pytest.mark.parametrize("nodes", [8, 12, 25])
def test_smooth_integrals_are_exact(nodes):
    rule = phase_quadrature(nodes)
    for power in range(nodes):
        assert rule.integral(rule.nodes**power) == pytest.approx(1.0 / (power + 1), abs=1e-14)


@pytest.mark.parametrize("nodes", [8, 12, 25])
@pytest.mark.parametrize("root", [0.0, 0.003, 0.31, 0.5, 0.77, 0.999, 1.0])
def test_positive_part_of_a_line(nodes, root):
    rule = phase_quadrature(nodes)
    assert float(rule.positive_part(rule.nodes - root)) == pytest.approx((1 - root) ** 2 / 2, abs=1e-12)
    assert float(rule.positive_part(root - rule.nodes)) == pytest.approx(root**2 / 2, abs=1e-12)


def test_positive_part_of_a_wave():
    rule = phase_quadrature(25)
    values = np.stack([np.sin(2 * np.pi * rule.nodes), np.sin(3 * np.pi * rule.nodes), 2.0 + rule.nodes])
    assert rule.positive_part(values) == pytest.approx([1 / np.pi, 4 / (3 * np.pi), 2.5], abs=2e-4)


def test_shapes_are_kept():
    rule = phase_quadrature(8)
    values = np.ones((3, 4, 2, 8)) * np.linspace(-1, 1, 8)
    assert rule.positive_part(values).shape == (3, 4, 2)
