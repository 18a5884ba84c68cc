"""What physics leaves over: a ridge regression of the relative residual on the elasticities of the energy.

Where physics says that energy hangs on a joint's friction, a wrong form of friction shows: the features are the
elasticities of the energy (dE/E over dp/p) of friction, copper and load friction, joint by joint, those of friction
also times the logarithm of the joint's peak speed over its limit, and the share of base power. Smooth in the speed
limit, so that the predicted profile stays so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array

PENALTIES = (1e-3, 1e-2, 1e-1, 1.0, 10.0)
_FOLDS = 5
_LEAST_GAIN = 0.002  # relative gain of the mean squared error for which a correction is worth its risk
_FEWEST_TREES = 10


@dataclass(frozen=True)
class Residual:
    """Correction factor 1 + (f - mean) / scale . weights.

    Attributes:
        mean: Mean of each feature, shape (k,).
        scale: Its scale, shape (k,).
        weights: Shape (k,); zeros: no correction.
        gain: Share of the cross-validated squared residual that it takes away. [-]
    """

    mean: Array
    scale: Array
    weights: Array
    gain: float

    def factor(self, features: Array) -> Array:
        """Correction factor of the energy, shape (..., k) -> (...)."""
        if not self.weights.any():
            return np.ones(features.shape[:-1])
        return np.asarray(1.0 + (features - self.mean) / self.scale @ self.weights)


def fit_residual(features: Array, relative: Array, tree: NDArray[np.intp]) -> Residual:
    """Fit a correction, or none where cross-validation by tree does not ask for one.

    Args:
        features: Shape (R, k).
        relative: Measured over predicted energy, less 1, shape (R,). [-]
        tree: Tree of each run, shape (R,).
    """
    mean, scale = features.mean(axis=0), features.std(axis=0) + 1e-6
    none = Residual(mean, scale, np.zeros(features.shape[1]), 0.0)
    trees = np.unique(tree)
    if len(trees) < _FEWEST_TREES:
        return none
    limit = 4.0 * 1.4826 * float(np.median(np.abs(relative))) + 1e-9
    clipped = np.clip(relative, -limit, limit)
    design = (features - mean) / scale
    fold = np.searchsorted(trees, tree) % _FOLDS
    errors = {}
    for penalty in PENALTIES:
        predicted = np.zeros_like(clipped)
        for held in range(_FOLDS):
            weights = _ridge(design[fold != held], clipped[fold != held], penalty)
            predicted[fold == held] = design[fold == held] @ weights
        errors[penalty] = float(((clipped - predicted) ** 2).mean())
    best = min(errors, key=lambda penalty: errors[penalty])
    gain = 1.0 - errors[best] / float((clipped**2).mean())
    return Residual(mean, scale, _ridge(design, clipped, best), gain) if gain > _LEAST_GAIN else none


def _ridge(design: Array, target: Array, penalty: float) -> Array:
    normal = design.T @ design + penalty * len(design) * np.eye(design.shape[1]) * 1e-1
    return np.asarray(np.linalg.solve(normal, design.T @ target))


def residual_features(elasticity: dict[str, Array], peak_speed: Array) -> Array:
    """Features of runs.

    Args:
        elasticity: Elasticities "base" (..., 1), "coulomb", "viscous", "copper", "load_friction" (..., n). [-]
        peak_speed: Peak joint speeds over their limits, shape (..., n). [-]
    """
    pace = np.log(np.maximum(peak_speed, 1e-3))
    return np.concatenate(
        [
            elasticity["base"],
            elasticity["coulomb"],
            elasticity["viscous"],
            elasticity["viscous"] * pace,
            elasticity["copper"],
            elasticity["load_friction"],
        ],
        axis=-1,
    )
