"""What a fitted model leaves over of a motion's measured runs, carried to its other speed limits.

Per motion, the logarithm of measured over modelled is a Gaussian process over the logarithm of the speed limit p, with
covariance s^2 exp(-|ln p - ln p'| / 1.5): near a measured run its error is known, far from all runs it is not. The
amplitude s is what the residuals of all motions show beyond their noise, so a model that explains the runs is left as
it is.

Part of that noise is none: what a duration differs by from a smooth curve, because the controller counts in cycles, is
the same whenever the motion runs at this speed limit. Runs of a single pass do not tell it from what differs from cycle
to cycle, so the correction does not contain it; but it leaves speed limits that were not run less sure than those that
were (`open_deviation`).
"""

from __future__ import annotations

import numpy as np

from robojoule.arrays import Array, Index

LENGTH = 1.5  # of the covariance over ln p
LEAST_AMPLITUDE = 1e-3
LEAST_FREEDOM = 0.2
LEAST_RESOLUTION = 1e-6


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


def lasting_amplitude(residuals: Array, resolution: Array, freedom: float, most: float) -> float:
    """What durations differ by from the model in the same way each time: what stamps surely do not explain. [-]

    Args:
        residuals: Logarithms of measured over modelled, shape (R,). [-]
        resolution: Their noise from the resolution of stamps alone, shape (R,). [-]
        freedom: Share of freedom that the fit has left to the residuals. [-]
        most: What noise counts beside the stamps: more belongs to the correction along speed limits. [-]
    """
    free = max(freedom, LEAST_FREEDOM)
    by_chance = 1.0 + 2.0 * np.sqrt(2.0 / (free * residuals.size))  # a mean square and two of its deviations
    beyond = float(np.mean(residuals**2)) / free - by_chance * float(np.mean(resolution**2))
    return min(float(np.sqrt(max(beyond, 0.0))), most)


def open_deviation(at: tuple[Index, Index], resolution: Array, amplitude: float, shape: tuple[int, int]) -> Array:
    """Deviations of what lasts, which runs tell as far as their stamps do, shape (M, S). [-]

    Args:
        at: Motion and place of the speed limit of each run, each of shape (R,).
        resolution: Noise of the runs from the resolution of stamps alone, shape (R,). [-]
        amplitude: Standard deviation of what lasts, see `lasting_amplitude`. [-]
        shape: Numbers M of motions and S of speed limits.
    """
    if amplitude == 0.0:
        return np.zeros(shape)
    precision = np.full(shape, amplitude**-2.0)
    np.add.at(precision, at, np.maximum(resolution, LEAST_RESOLUTION) ** -2.0)
    return np.asarray(precision**-0.5)


def _covariance(left: Array, right: Array, amplitude: float) -> Array:
    return np.asarray(amplitude**2 * np.exp(-np.abs(np.log(left)[:, None] - np.log(right)) / LENGTH))
