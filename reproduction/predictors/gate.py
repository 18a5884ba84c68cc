"""The gate that a predictor has to pass on held-out trees before it is registered."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reproduction.predictors.evaluation import beats_mean
from robojoule.arrays import Array


def passes_gate(predicted: Array, simulated: Array, training: Array, rivals: Sequence[Array] = ()) -> bool:
    """Whether predictions of held-out motions are better than the baseline and than every rival.

    Better: a smaller mean absolute error of every target (saving, optimal duration, penalty).

    Args:
        predicted: Predictions of held-out motions by the model that was read back, shape (N, 3).
        simulated: Their simulated values, shape (N, 3).
        training: Simulated values of the training motions, whose mean is the baseline, shape (K, 3).
        rivals: Predictions of the same motions by registered models, each of shape (N, 3).
    """
    if not np.isfinite(predicted).all() or not beats_mean(predicted, simulated, training):
        return False
    errors = np.abs(predicted - simulated).mean(axis=0)
    return all(bool((errors < np.abs(rival - simulated).mean(axis=0)).all()) for rival in rivals)
