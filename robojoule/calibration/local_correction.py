"""What a fitted model leaves over of a motion's measured runs, carried to its other speed limits.

Per motion, the logarithm of measured over modelled is a Gaussian process over the logarithm of the speed limit p, with
covariance s^2 exp(-|ln p - ln p'| / 1.5): near a measured run its error is known, far from all runs it is not. The
amplitude s is what the residuals of all motions show beyond their noise, so a model that explains the runs is left as
it is.
"""

from __future__ import annotations

import numpy as np

from robojoule.arrays import Array, Index

LENGTH = 1.5  # of the covariance over ln p
LEAST_AMPLITUDE = 1e-3


def amplitude_of(residuals: Array, deviations: Array, inflation: float = 1.0) -> float:
    """Amplitude that residuals show beyond their noise.

    Args:
        residuals: Logarithms of measured over modelled, shape (R,). [-]
        deviations: Their noise, shape (R,). [-]
        inflation: Reciprocal of the share of freedom that the fit has left to the residuals. [-]
    """
    beyond = float(np.mean(residuals**2) * inflation - np.mean(deviations**2))
    return max(float(np.sqrt(max(beyond, 0.0))), LEAST_AMPLITUDE)


def correction(
    motion: Index, limits: Array, residuals: Array, deviations: Array, grid: Array, motions: int, amplitude: float
) -> tuple[Array, Array]:
    """Corrections of all motions at speed limits.

    Args:
        motion: Motion of each run, shape (R,).
        limits: Speed limit of each run, shape (R,). [-]
        residuals: Logarithms of measured over modelled, shape (R,). [-]
        deviations: Their noise, shape (R,). [-]
        grid: Speed limits asked for, shape (S,). [-]
        motions: Number M of motions.
        amplitude: Standard deviation of the process. [-]

    Returns:
        Mean logarithm and standard deviation of the correction, each of shape (M, S). [-]
    """
    mean, deviation = np.zeros((motions, grid.size)), np.full((motions, grid.size), amplitude)
    for one in np.unique(motion):
        rows = np.flatnonzero(motion == one)
        known = _covariance(limits[rows], limits[rows], amplitude) + np.diag(deviations[rows] ** 2)
        across = _covariance(grid, limits[rows], amplitude)
        gain = np.linalg.solve(known, across.T).T
        mean[one] = gain @ residuals[rows]
        deviation[one] = np.sqrt(np.maximum(amplitude**2 - np.einsum("sr,sr->s", gain, across), 0.0))
    return mean, deviation


def _covariance(left: Array, right: Array, amplitude: float) -> Array:
    return np.asarray(amplitude**2 * np.exp(-np.abs(np.log(left)[:, None] - np.log(right)) / LENGTH))
