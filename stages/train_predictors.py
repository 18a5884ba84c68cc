"""Predictors of energy profiles: the thesis's random forest and neural network, and the one of whole profiles."""

from __future__ import annotations

import json
import math
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from reproduction.claims.predictors import predictor_claims
from reproduction.config import Params, TrainPredictorsParams
from reproduction.predictors import evaluation
from reproduction.predictors.conversion import to_arrays
from reproduction.predictors.estimators import MODELS, fit, make_estimator
from reproduction.predictors.predictor_file import save_predictor
from reproduction.predictors.profile_parameters import TARGETS, bounded, input_names
from reproduction.tables import Row, columns, read_table, write_csv
from reproduction.tracking import store as _tracking
from robojoule.documents import atomic_path, write_text
from robojoule.errors import InputError
from robojoule.profile.parameters import steepness
from stages._cli import run
from stages._profile_predictor import (
    HELD_OUT,
    MODEL,
    ProfileTraining,
    read_simulated,
    record_profile_predictor,
    train_profile_predictor,
)
from stages.layout import Layout

Rows = list[Row]


@dataclass(frozen=True)
class Training:
    """A fitted model.

    Attributes:
        model: Its name.
        estimator: The fitted estimator.
        fit_s: Time of the fit, for the record only. [s]
    """

    model: str
    estimator: Any
    fit_s: float


def train_predictors(params: Params, layout: Layout) -> None:
    """Train on the training trees, predict the test and experiment motions, and record each training in MLflow."""
    features = _read_features(params, layout)
    trainings, profiles, predictions = fit_models(params, layout, features)
    metrics = write_tables(layout, features, predictions, profiles.interval)
    record = _tracking.Recorder(layout, params)
    for training in trainings:
        print(f"train_predictors: {training.model}, recorded in MLflow", flush=True)
        record.training(training.model, training.estimator, features, predictions, metrics, training.fit_s)
    test = predictions.filter(pa.compute.equal(predictions["split"], "test"))
    rivals = [columns(test.filter(pa.compute.equal(test["model"], model)), TARGETS) for model in MODELS]
    released = record_profile_predictor(record, profiles, metrics, rivals)
    print(f"train_predictors: {MODEL}, {'registered' if released else 'refused by its gate'}", flush=True)


def fit_models(params: Params, layout: Layout, features: pa.Table) -> tuple[list[Training], ProfileTraining, pa.Table]:
    """Fit every model on the training motions, export it, and predict all other motions.

    The networks are fitted in a process of their own: they and the forest take one processor each.

    Returns:
        The fitted models of three parameters, the predictor of profiles, and the predictions as written.

    Raises:
        InputError: The features, motions or runs cannot be trained on.
    """
    splits = np.array(features["split"].to_pylist())
    inputs = columns(features, names := _input_names(params), layout.features)
    targets = columns(features, TARGETS, layout.features)
    training, held_out = splits == "train", splits != "train"
    if not training.any() or not (splits == "test").any():
        raise InputError("there are no training or no test motions", file=layout.features, key="split")
    simulated = read_simulated(params, layout)
    judged = np.sort(np.concatenate([simulated[split].motion_id for split in HELD_OUT]))
    if not np.array_equal(features["motion_id"].to_numpy()[held_out], judged):
        raise InputError("the held-out motions are not those of the features", file=layout.motions, key="motion_id")
    frame = features.filter(pa.array(training)).select(names).to_pandas()
    print(f"train_predictors: {', '.join((*MODELS, MODEL))}; {len(frame)} motions", flush=True)
    # Spawned, not forked: a copy of a process with threads may hang.
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        network = pool.submit(_fit, "neural_network", params.train_predictors, frame, targets[training])
        forest = _fit("random_forest", params.train_predictors, frame, targets[training])
        profiles = train_profile_predictor(layout, simulated)
        trainings = [forest, network.result()]

    tables = []
    for one in trainings:
        arrays = to_arrays(one.estimator, one.model, names, TARGETS)
        save_predictor(arrays, layout.models_dir / one.model)
        tables.append(_predictions(features.filter(pa.array(held_out)), one.model, arrays.predict(inputs[held_out])))
    tables.append(_with_outliers(profiles.predictions).cast(tables[0].schema))
    predictions = pa.concat_tables(tables)
    with atomic_path(layout.predictions) as path:
        pq.write_table(predictions, path, compression="zstd")
    return trainings, profiles, predictions


def _fit(model: str, params: TrainPredictorsParams, frame: Any, targets: np.ndarray) -> Training:
    start = time.perf_counter()
    estimator = fit(make_estimator(model, params), frame, targets)
    return Training(model, estimator, time.perf_counter() - start)


def write_tables(
    layout: Layout, features: pa.Table, predictions: pa.Table, interval: dict[str, float]
) -> _tracking.Metrics:
    """Write Table 5.1, the order of suitability, the claims and the metrics; return the metrics."""
    errors, order, metrics = _evaluate(predictions, features)
    metrics["interval"] = {MODEL: interval}
    write_csv(layout.tables_dir / "table_5_1.csv", errors)
    write_csv(layout.tables_dir / "suitability.csv", order)
    write_csv(
        layout.tables_dir / "claims_predictors.csv", [claim.row() for claim in predictor_claims(predictions, metrics)]
    )
    write_text(layout.metrics_dir / "predictors.json", json.dumps(metrics, indent=2, allow_nan=False) + "\n")
    return metrics


def _input_names(params: Params) -> tuple[str, ...]:
    """The inputs for as many joints as the robot has."""
    return input_names(params.robot.robot().joint_count)


def _read_features(params: Params, layout: Layout) -> pa.Table:
    """The columns that are needed, sorted by motion."""
    return read_table(
        layout.features,
        "build_features",
        numbers=["motion_id", "duration_fastest_s", "duration_slowest_s", *_input_names(params), *TARGETS],
        texts=["tree_id", "split"],
    ).sort_by("motion_id")


def _predictions(features: pa.Table, model: str, raw: np.ndarray) -> pa.Table:
    """Possible predictions beside the measured values, one row a held-out motion."""
    fastest, slowest = (features[f"duration_{end}_s"].to_numpy() for end in ("fastest", "slowest"))
    values = bounded(raw, fastest, slowest)
    table = features.select(["motion_id", "tree_id", "split"]).append_column("model", pa.array([model] * len(values)))
    for place, target in enumerate(TARGETS):
        table = table.append_column(target, pa.array(values[:, place]))
    for target in TARGETS:
        table = table.append_column(f"{target}_measured", features[target])
    return _with_outliers(table)


def _with_outliers(predictions: pa.Table) -> pa.Table:
    """Mark savings: -1 underpredicted, 1 overpredicted, 0 neither; fences drawn for each split on its own."""
    saving, measured = (predictions[f"energy_saving_j{end}"].to_numpy() for end in ("", "_measured"))
    splits = np.array(predictions["split"].to_pylist())
    marks = np.zeros(len(saving), dtype=np.int8)
    for split in np.unique(splits):
        rows = splits == split
        marks[rows] = evaluation.outliers(saving[rows], measured[rows])
    return predictions.append_column("saving_outlier", pa.array(marks))


def _evaluate(predictions: pa.Table, features: pa.Table) -> tuple[Rows, Rows, _tracking.Metrics]:
    """Table 5.1 on the test trees, the order of suitability on test and experiment trees, and the headline figures."""
    errors: Rows = []
    order: Rows = []
    metrics: _tracking.Metrics = {target: {} for target in TARGETS} | {"suitability": {}}
    models = np.array(predictions["model"].to_pylist())
    for model in dict.fromkeys(models.tolist()):
        ours = predictions.filter(pa.array(models == model))
        splits = np.array(ours["split"].to_pylist())
        for split in ("test", "experiment"):
            part = ours.filter(pa.array(splits == split))
            if not len(part):
                continue
            predicted = columns(part, TARGETS)
            measured = columns(part, tuple(f"{target}_measured" for target in TARGETS))
            fastest = _of_motions(features, part, "duration_fastest_s")
            marks = part["saving_outlier"].to_numpy()
            found = evaluation.order_rows(
                steepness(predicted, fastest),
                steepness(measured, fastest),
                part["tree_id"].to_pylist(),
            )
            counts = {"underpredicted": int((marks < 0).sum()), "overpredicted": int((marks > 0).sum())}
            order += [{"split": split, "model": model} | _rounded(asdict(row)) | counts for row in found]
            if split != "test":
                continue
            metrics["suitability"][model] = _finite({f"{row.measure}_mean": row.mean for row in found}) | counts
            for row in evaluation.error_rows(predicted, measured):
                figures = asdict(row)
                errors.append({"target": row.target, "model": model} | _rounded(figures))
                prefix, suffix = ("rel", "_percent") if row.error == "rel_percent" else ("abs", "")
                target = metrics[row.target].setdefault(model, {})
                target |= _finite({f"{prefix}_{q}{suffix}": figures[q] for q in ("p25", "p50", "p75", "max", "mean")})
                if row.error == "rel_percent":
                    target["zeros_left_out"] = row.zeros_left_out
    errors.sort(key=lambda row: TARGETS.index(str(row["target"])))
    return errors, order, metrics


def _of_motions(features: pa.Table, part: pa.Table, column: str) -> np.ndarray:
    """A column of the features for the motions of `part`; features are sorted by motion."""
    return features[column].to_numpy()[np.searchsorted(features["motion_id"].to_numpy(), part["motion_id"].to_numpy())]


def _rounded(row: dict[str, object]) -> dict[str, object]:
    """Floats with six decimals, empty where there is no figure."""
    return {
        key: ("" if math.isnan(value) else round(value, 6)) if isinstance(value, float) else value
        for key, value in row.items()
    }


def _finite(figures: dict[str, float]) -> dict[str, float]:
    return {key: round(value, 6) for key, value in figures.items() if math.isfinite(value)}


def main() -> None:
    """Run the stage from the command line."""
    run(train_predictors)


if __name__ == "__main__":
    main()
