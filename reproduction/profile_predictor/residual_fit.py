"""Fit what physics leaves over: a ridge regression, used only where cross-validation by tree finds a gain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array
from robojoule.profile.residual import Residual

PENALTIES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0)  # of the squared weights, per run
_FOLDS = 5
_LEAST_GAIN = 0.002  # relative gain of the mean squared error for which a correction is worth its risk
_FEWEST_TREES = 10


def fit_residual(features: Array, relative: Array, tree: NDArray[np.intp]) -> Residual:
    """Fit a correction, or none where cross-validation by tree does not ask for one.

    Args:
        features: Shape (R, k).
        relative: Observed over predicted energy, less 1, shape (R,). [-]
        tree: Tree of each run, shape (R,).
    """
    from sklearn.linear_model import Ridge
    from sklearn.model_selection import GridSearchCV, GroupKFold

    mean, scale = features.mean(axis=0), features.std(axis=0) + 1e-6
    none = Residual(mean, scale, np.zeros(features.shape[1]), 0.0)
    if len(np.unique(tree)) < _FEWEST_TREES:
        return none
    limit = 4.0 * 1.4826 * float(np.median(np.abs(relative))) + 1e-9
    clipped = np.clip(relative, -limit, limit)
    search = GridSearchCV(
        Ridge(fit_intercept=False, solver="cholesky"),
        {"alpha": [penalty * len(relative) for penalty in PENALTIES]},
        scoring="neg_mean_squared_error",
        cv=GroupKFold(_FOLDS),
    )
    search.fit((features - mean) / scale, clipped, groups=tree)
    gain = 1.0 + float(search.best_score_) / float((clipped**2).mean())
    return Residual(mean, scale, np.array(search.best_estimator_.coef_), gain) if gain > _LEAST_GAIN else none
