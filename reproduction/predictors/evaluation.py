"""How good predictions are: errors (Table 5.1), order of suitability within a tree, outliers (Figure 5.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array
from robojoule.profile.parameters import TARGETS

QUANTILES = {"p25": 0.25, "p50": 0.5, "p75": 0.75, "max": 1.0}


@dataclass(frozen=True)
class ErrorRow:
    """A row of Table 5.1.

    Attributes:
        target: One of `TARGETS`.
        error: `abs` (in the target's unit) or `rel_percent` (of the simulated value).
        p25, p50, p75, max, mean: Quantiles and mean of the error.
        motions: Motions behind them.
        zeros_left_out: Motions left out of the relative error because their simulated value is zero.
    """

    target: str
    error: str
    p25: float
    p50: float
    p75: float
    max: float
    mean: float
    motions: int
    zeros_left_out: int


def error_rows(predicted: Array, simulated: Array) -> list[ErrorRow]:
    """Absolute and relative errors of every target.

    Args:
        predicted: Columns in the order of `TARGETS`, shape (N, 3), N > 0.
        simulated: The same, simulated.
    """
    rows = []
    for place, target in enumerate(TARGETS):
        absolute = np.abs(predicted[:, place] - simulated[:, place])
        counted = simulated[:, place] != 0
        relative = 100.0 * absolute[counted] / np.abs(simulated[counted, place])
        rows.append(_row(target, "abs", absolute, 0))
        rows.append(_row(target, "rel_percent", relative, int((~counted).sum())))
    return rows


def _row(target: str, error: str, values: Array, left_out: int) -> ErrorRow:
    if not len(values):
        nothing = float("nan")
        return ErrorRow(target, error, nothing, nothing, nothing, nothing, nothing, 0, left_out)
    p25, p50, p75, largest = (float(value) for value in np.quantile(values, list(QUANTILES.values())))
    return ErrorRow(target, error, p25, p50, p75, largest, float(values.mean()), len(values), left_out)


@dataclass(frozen=True)
class OrderRow:
    """How well the predicted order of suitability follows the simulated one, over trees.

    Attributes:
        measure: `spearman` or `kendall` (tau-b) correlation of predicted with simulated steepness within a tree.
        trees: Trees behind it; a tree in which all simulated or all predicted steepnesses are equal has no order.
        mean, min, p25, p50, p75: Mean, least and quartiles over the trees.
    """

    measure: str
    trees: int
    mean: float
    min: float
    p25: float
    p50: float
    p75: float


def order_rows(predicted: Array, simulated: Array, tree_ids: Sequence[str]) -> list[OrderRow]:
    """Rank correlations of predicted with simulated steepness within every tree.

    Args:
        predicted: Predicted steepness, shape (N,). [J/s]
        simulated: Simulated steepness, shape (N,). [J/s]
        tree_ids: Tree of every motion, N of them.
    """
    from scipy import stats

    trees, place = np.unique(np.asarray(tree_ids), return_inverse=True)
    values: dict[str, list[float]] = {"spearman": [], "kendall": []}
    for tree in range(len(trees)):
        guess, truth = predicted[place == tree], simulated[place == tree]
        if np.ptp(guess) == 0 or np.ptp(truth) == 0:
            continue
        values["spearman"].append(float(stats.spearmanr(guess, truth).statistic))
        values["kendall"].append(float(stats.kendalltau(guess, truth).statistic))
    rows = []
    for measure, found in values.items():
        if found:
            least, p25, p50, p75 = (float(value) for value in np.quantile(found, [0.0, 0.25, 0.5, 0.75]))
            rows.append(OrderRow(measure, len(found), float(np.mean(found)), least, p25, p50, p75))
        else:
            nothing = float("nan")
            rows.append(OrderRow(measure, 0, nothing, nothing, nothing, nothing, nothing))
    return rows


def outliers(predicted: Array, simulated: Array) -> NDArray[np.int8]:
    """Mark the energy savings that are far off (Figure 5.1).

    The residual, predicted minus simulated, is an outlier outside Tukey's fences: more than 1.5 interquartile ranges
    below its lower or above its upper quartile.

    Args:
        predicted: Predicted energy saving, shape (N,), N > 0. [J]
        simulated: Simulated energy saving, shape (N,). [J]

    Returns:
        -1 underpredicted (a good motion taken for a bad one), 1 overpredicted, 0 neither; shape (N,).
    """
    residual = predicted - simulated
    lower, upper = np.quantile(residual, [0.25, 0.75])
    fence = 1.5 * (upper - lower)
    marks = np.zeros(len(residual), dtype=np.int8)
    marks[residual > upper + fence] = 1
    marks[residual < lower - fence] = -1
    return marks


def beats_mean(predicted: Array, simulated: Array, training: Array) -> bool:
    """Whether the predictions of every target have a smaller mean error than the training data's mean.

    Args:
        predicted: Predictions of held-out motions, shape (N, 3).
        simulated: Their simulated values, shape (N, 3).
        training: Simulated values of the training motions, shape (K, 3).
    """
    errors = np.abs(predicted - simulated).mean(axis=0)
    baseline = np.abs(training.mean(axis=0) - simulated).mean(axis=0)
    return bool((errors < baseline).all())


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
