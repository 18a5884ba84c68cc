"""Integrals over the phases of a run, exact for smooth integrands and accurate across the kink of a positive part.

Within a phase of constant jerk every power is a smooth function of time, so Gauss-Legendre quadrature converges
spectrally. The DC bus brings one kink: only its positive part is drawn from the mains. Its integral is taken from the
polynomial through the same Gauss nodes: the polynomial is integrated exactly over small cells, and only in a cell where
it changes sign is it taken as linear. That costs a fixed small matrix product instead of further dynamics calls.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from robojoule.drive import Array

CELLS = 32


@dataclass(frozen=True)
class PhaseQuadrature:
    """Quadrature on the unit interval.

    Attributes:
        nodes: Gauss-Legendre nodes, shape (N,). [-]
        weights: Their weights, shape (N,). [-]
        cell_ends: From values at the nodes to the interpolating polynomial at the cell ends, shape (N, CELLS + 1).
        cell_integrals: From values at the nodes to its integrals over the cells, shape (N, CELLS).
    """

    nodes: Array
    weights: Array
    cell_ends: Array
    cell_integrals: Array

    def integral(self, values: Array) -> Array:
        """Integral over the unit interval of values at the nodes, shape (..., N) -> (...)."""
        return np.asarray(values @ self.weights)

    def positive_part(self, values: Array) -> Array:
        """Integral of max(values, 0) over the unit interval, shape (..., N) -> (...)."""
        flat = values.reshape(-1, values.shape[-1])
        total = self.integral(flat)
        result = np.maximum(total, 0.0)
        ends = flat @ self.cell_ends
        mixed = np.flatnonzero((ends.min(axis=1) < 0.0) & (ends.max(axis=1) > 0.0))
        if mixed.size:
            left, right = ends[mixed, :-1], ends[mixed, 1:]
            magnitude = np.abs(flat[mixed] @ self.cell_integrals)
            crossing = left * right < 0.0
            spread = np.where(crossing, np.abs(left) + np.abs(right), 1.0)
            magnitude = np.where(crossing, (left**2 + right**2) / (2.0 * CELLS * spread), magnitude)
            result[mixed] = (total[mixed] + magnitude.sum(axis=1)) / 2.0
        return np.asarray(result.reshape(values.shape[:-1]))


@lru_cache(maxsize=32)
def phase_quadrature(nodes: int) -> PhaseQuadrature:
    """Build the quadrature with a number of nodes."""
    x, w = legendre.leggauss(nodes)
    # Discrete Legendre transform: coefficients of the interpolating polynomial from values at the nodes.
    order = np.arange(nodes)
    to_coefficients = (legendre.legvander(x, nodes - 1) * w[:, None]) * (order + 0.5)
    ends = np.linspace(-1.0, 1.0, CELLS + 1)
    antiderivatives = np.stack([legendre.legval(ends, legendre.legint(np.eye(nodes)[k], lbnd=-1)) for k in order])
    return PhaseQuadrature(
        nodes=(x + 1.0) / 2.0,
        weights=w / 2.0,
        cell_ends=to_coefficients @ legendre.legvander(ends, nodes - 1).T,
        cell_integrals=np.asarray(to_coefficients @ np.diff(antiderivatives, axis=1) / 2.0, dtype=np.float64),
    )
