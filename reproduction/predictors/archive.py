"""Predictors as files: `NAME.json` says what they are, `NAME.npz` holds their arrays; both have stable bytes."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from reproduction.predictors.portable import Forest, Network, Predictor
from robojoule.arrays import Array
from robojoule.documents import Document, write_document
from robojoule.documents import load as load_document
from robojoule.profile.array_file import Arrays, read_arrays, write_arrays

if TYPE_CHECKING:
    from sklearn.pipeline import Pipeline


class PredictorFile(Document):
    """`NAME.json` of a predictor."""

    format: Literal["robojoule-predictor"] = "robojoule-predictor"
    format_version: Literal[1] = 1
    model: str = Field(min_length=1, description="Kind of model.")
    inputs: tuple[str, ...] = Field(min_length=1, description="Inputs, in order.")
    targets: tuple[str, ...] = Field(min_length=1, description="Outputs, in order.")
    member: Literal["forest", "network"] = Field(description="What the members are: a forest a target, or networks.")
    members: int = Field(ge=1, le=1000, description="How many members.")
    layers: int = Field(default=0, ge=0, le=100, description="Layers of every network.")
    activation: str = Field(default="", description="Function between a network's layers.")


def portable(estimator: Pipeline, model: str, inputs: Iterable[str], targets: Iterable[str]) -> Predictor:
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


def export(predictor: Predictor, path: str | Path) -> None:
    """Write a predictor as `path` with the suffixes `.json` and `.npz`.

    The same predictor gives the same bytes.
    """
    path = Path(path)
    arrays: Arrays = {"input_mean": predictor.input_mean, "input_scale": predictor.input_scale}
    layers, activation = 0, ""
    kind: Literal["forest", "network"] = "forest"
    for number, member in enumerate(predictor.members):
        if isinstance(member, Forest):
            arrays |= {f"{number}_{name}": getattr(member, name) for name in ("roots", "feature", "value", "right")}
        else:
            layers, activation = len(member.weights), member.activation
            kind = "network"
            arrays |= {f"{number}_mean": member.mean, f"{number}_scale": member.scale}
            arrays |= {f"{number}_weights_{layer}": weight for layer, weight in enumerate(member.weights)}
            arrays |= {f"{number}_biases_{layer}": bias for layer, bias in enumerate(member.biases)}
    write_arrays(path.with_suffix(".npz"), arrays)
    description = PredictorFile(
        model=predictor.model,
        inputs=predictor.inputs,
        targets=predictor.targets,
        member=kind,
        members=len(predictor.members),
        layers=layers,
        activation=activation,
    )
    write_document(path.with_suffix(".json"), description.model_dump(mode="json"))


def load(path: str | Path) -> Predictor:
    """Read a predictor written by `export`; no code of the file runs.

    Args:
        path: The file, with suffix `.json`, `.npz` or none.

    Raises:
        InputError: A file is missing, truncated or does not hold a predictor.
    """
    path = Path(path)
    described = load_document(PredictorFile, path.with_suffix(".json"))
    return read_arrays(path.with_suffix(".npz"), partial(_assemble, described))


def _assemble(described: PredictorFile, arrays: Arrays) -> Predictor:
    inputs = len(described.inputs)
    numbers = range(described.members)
    mean, scale = _vector(arrays["input_mean"], inputs), _vector(arrays["input_scale"], inputs)
    members: tuple[Forest | Network, ...]
    if described.member == "forest":
        if described.members != len(described.targets):
            raise ValueError("there must be one forest a target")
        members = tuple(
            Forest(*(arrays[f"{number}_{name}"] for name in ("roots", "feature", "value", "right")))
            for number in numbers
        )
    else:
        members = tuple(
            Network(
                weights=tuple(arrays[f"{number}_weights_{layer}"] for layer in range(described.layers)),
                biases=tuple(arrays[f"{number}_biases_{layer}"] for layer in range(described.layers)),
                activation=described.activation,
                mean=_vector(arrays[f"{number}_mean"], len(described.targets)),
                scale=_vector(arrays[f"{number}_scale"], len(described.targets)),
            )
            for number in numbers
        )
    for member in members:
        member.check(inputs)
    return Predictor(described.model, described.inputs, described.targets, mean, scale, members)


def _vector(array: Array, length: int) -> Array:
    if array.shape != (length,):
        raise ValueError(f"an array has shape {array.shape} instead of ({length},)")
    return array
