"""From fitted scikit-learn estimators to predictors of plain arrays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction.predictors.array_predictor import Forest, Network, Predictor

if TYPE_CHECKING:
    from sklearn.pipeline import Pipeline


def to_arrays(estimator: Pipeline, model: str, inputs: Iterable[str], targets: Iterable[str]) -> Predictor:
    """Turn a fitted estimator into plain arrays.

    Args:
        estimator: Fitted estimator from `reproduction.predictors.estimators`.
        model: Its name.
        inputs: Names of its inputs, in order.
        targets: Names of its outputs, in order.

    Returns:
        Predictor whose predictions equal the estimator's but for rounding.
    """
    scaler, regressor = estimator.named_steps["scale"], estimator.named_steps["regress"]
    members: tuple[Forest | Network, ...]
    if hasattr(regressor, "estimators_"):
        members = tuple(_forest(forest) for forest in regressor.estimators_)
    else:
        outputs = regressor.transformer_
        members = tuple(_network(network, outputs) for network in regressor.regressor_.estimators_)
    return Predictor(model, tuple(inputs), tuple(targets), np.array(scaler.mean_), np.array(scaler.scale_), members)


def _forest(forest: Any) -> Forest:
    trees = [member.tree_ for member in forest.estimators_]
    roots = np.cumsum([0, *(tree.node_count for tree in trees[:-1])])
    inner = [tree.feature >= 0 for tree in trees]
    for tree, rows in zip(trees, inner, strict=True):
        if (tree.children_left[rows] != np.flatnonzero(rows) + 1).any():
            raise ValueError("a tree's left children do not follow their parents")
    return Forest(
        roots=roots.astype(np.int32),
        feature=np.concatenate([np.maximum(tree.feature, -1) for tree in trees]).astype(np.int16),
        value=np.concatenate(
            [np.where(rows, tree.threshold, tree.value[:, 0, 0]) for tree, rows in zip(trees, inner, strict=True)]
        ),
        right=np.concatenate(
            [
                np.where(rows, tree.children_right + root, 0)
                for tree, rows, root in zip(trees, inner, roots, strict=True)
            ]
        ).astype(np.int32),
    )


def _network(network: Any, outputs: Any) -> Network:
    return Network(
        weights=tuple(np.array(weight) for weight in network.coefs_),
        biases=tuple(np.array(bias) for bias in network.intercepts_),
        activation=network.activation,
        mean=np.array(outputs.mean_),
        scale=np.array(outputs.scale_),
    )
