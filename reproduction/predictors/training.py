"""Fit the random forest and the neural network, and put the predictions of all predictors together."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from reproduction.config import TrainPredictorsParams
from reproduction.pools import worker_pool
from reproduction.predictors.array_predictor import Predictor
from reproduction.predictors.conversion import to_arrays
from reproduction.predictors.estimators import MODELS, fit, make_estimator
from reproduction.predictors.evaluation import outliers
from reproduction.predictors.profile_parameters import bounded, input_names, joint_count
from reproduction.tables import column_names, columns, read_table
from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.profile.parameters import TARGETS

SIMULATED = tuple(f"{target}_simulated" for target in TARGETS)


@dataclass(frozen=True)
class Training:
    """A fitted model.

    Attributes:
        model: Its name.
        estimator: The fitted estimator.
        predictor: The same as plain arrays.
        fit_s: Time of the fit, for the record only. [s]
    """

    model: str
    estimator: Any
    predictor: Predictor
    fit_s: float


def read_features(path: Path) -> pa.Table:
    """Features and targets of all motions, sorted by motion; only the columns that are needed.

    Raises:
        InputError: The file is missing or unreadable, a column is missing or garbled, or there is no training or no
            test motion.
    """
    inputs = input_names(joint_count(column_names(path, "build_features")) or 1)
    numbers = ["motion_id", "duration_fastest_s", "duration_slowest_s", *inputs, *TARGETS]
    table = read_table(path, "build_features", numbers=numbers, texts=["tree_id", "split"])
    if not {"train", "test"} <= set(table["split"].to_pylist()):
        raise InputError("there are no training or no test motions", file=path, key="split")
    return table.sort_by("motion_id")


def read_profile_predictions(path: Path, features: pa.Table) -> pa.Table:
    """What the profile predictor says of the held-out motions, with its outliers marked.

    Args:
        path: data/profile_predictions.parquet.
        features: Features of all motions, sorted by motion.

    Raises:
        InputError: The file is missing or unreadable, or its motions are not the held-out ones of the features.
    """
    texts = ["tree_id", "split", "model"]
    numbers = ["motion_id", *TARGETS, *SIMULATED]
    table = read_table(path, "train_profile_predictor", numbers=numbers, texts=texts)
    if not table["motion_id"].equals(held_out(features)["motion_id"].cast(table["motion_id"].type)):
        raise InputError("the held-out motions are not those of the features", file=path, key="motion_id")
    return _with_outliers(table.select(["motion_id", *texts, *TARGETS, *SIMULATED]))


def held_out(features: pa.Table) -> pa.Table:
    """Features of the motions that are not trained on."""
    return features.filter(pa.compute.not_equal(features["split"], "train"))


def fit_models(settings: TrainPredictorsParams, features: pa.Table) -> list[Training]:
    """Fit both models to the training motions.

    The networks are fitted in a process of their own: they and the forest take one processor each.

    Args:
        settings: Parameters of the models.
        features: Features of all motions.
    """
    inputs = input_names(joint_count(features.column_names))
    training = features.filter(pa.compute.equal(features["split"], "train"))
    frame, targets = training.select(inputs).to_pandas(), columns(training, TARGETS)
    with worker_pool(1) as pool:
        network = pool.submit(_fit, "neural_network", settings, frame, targets)
        fitted = {"random_forest": _fit("random_forest", settings, frame, targets), "neural_network": network.result()}
    return [
        Training(model, estimator, to_arrays(estimator, model, inputs, TARGETS), seconds)
        for model, (estimator, seconds) in ((model, fitted[model]) for model in MODELS)
    ]


def _fit(model: str, settings: TrainPredictorsParams, frame: Any, targets: Array) -> tuple[Any, float]:
    start = time.perf_counter()
    return fit(make_estimator(model, settings), frame, targets), time.perf_counter() - start


def predictions(training: Training, features: pa.Table) -> pa.Table:
    """Possible predictions beside the simulated values, one row per held-out motion.

    Args:
        training: The model.
        features: Features of all motions, sorted by motion.
    """
    motions = held_out(features)
    fastest, slowest = (motions[f"duration_{end}_s"].to_numpy() for end in ("fastest", "slowest"))
    raw = training.predictor.predict(columns(motions, training.predictor.inputs))
    values = bounded(raw, fastest, slowest)
    table = motions.select(["motion_id", "tree_id", "split"])
    table = table.append_column("model", pa.array([training.model] * len(values)))
    for place, target in enumerate(TARGETS):
        table = table.append_column(target, pa.array(values[:, place]))
    for name, target in zip(SIMULATED, TARGETS, strict=True):
        table = table.append_column(name, motions[target])
    return _with_outliers(table)


def _with_outliers(table: pa.Table) -> pa.Table:
    """Mark savings: -1 underpredicted, 1 overpredicted, 0 neither; fences drawn for each split on its own."""
    saving, simulated = (table[name].to_numpy() for name in (TARGETS[0], SIMULATED[0]))
    splits = np.array(table["split"].to_pylist())
    marks = np.zeros(len(saving), dtype=np.int8)
    for split in np.unique(splits):
        rows = splits == split
        marks[rows] = outliers(saving[rows], simulated[rows])
    return table.append_column("saving_outlier", pa.array(marks))
