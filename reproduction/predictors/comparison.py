"""All predictors compared on held-out motions: Table 5.1, the order of suitability, the headline figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np
import pyarrow as pa

from reproduction.predictors.evaluation import error_rows, order_rows
from reproduction.predictors.training import SIMULATED, Training, predictions
from reproduction.tables import Row, columns
from robojoule.arrays import Array
from robojoule.profile.parameters import TARGETS, steepness

Rows = list[Row]
Metrics = dict[str, dict[str, dict[str, float]]]
"""target (or "suitability", "interval") -> model -> figure."""


@dataclass(frozen=True)
class Comparison:
    """All predictors side by side.

    Attributes:
        features: Features of all motions, sorted by motion.
        trainings: The models of three parameters.
        predictions: Predictions of held-out motions by all models: `data/predictions.parquet`.
        errors: Rows of `table_5_1.csv`, on the test trees.
        order: Rows of `suitability.csv`, on test and experiment trees.
        metrics: Headline figures.
    """

    features: pa.Table
    trainings: Sequence[Training]
    predictions: pa.Table
    errors: Rows
    order: Rows
    metrics: Metrics


def compare(
    features: pa.Table, trainings: Sequence[Training], profiles: pa.Table, profile_metrics: Metrics
) -> Comparison:
    """Let the models predict the held-out motions, and compare them with each other and with the profile predictor.

    Args:
        features: Features of all motions, sorted by motion.
        trainings: The models of three parameters.
        profiles: What the profile predictor says.
        profile_metrics: Headline figures that it alone has.
    """
    tables = [predictions(training, features) for training in trainings]
    found = pa.concat_tables([*tables, profiles.cast(tables[0].schema)])
    errors: Rows = []
    order: Rows = []
    metrics: Metrics = {name: {} for name in (*TARGETS, "suitability")}
    for model in dict.fromkeys(found["model"].to_pylist()):
        of_model = found.filter(pa.compute.equal(found["model"], model))
        for split in ("test", "experiment"):
            part = of_model.filter(pa.compute.equal(of_model["split"], split))
            if not len(part):
                continue
            predicted, simulated = columns(part, TARGETS), columns(part, SIMULATED)
            fastest = _of_motions(features, part, "duration_fastest_s")
            marks = part["saving_outlier"].to_numpy()
            ranks = order_rows(
                steepness(predicted, fastest), steepness(simulated, fastest), part["tree_id"].to_pylist()
            )
            counts = {"underpredicted": int((marks < 0).sum()), "overpredicted": int((marks > 0).sum())}
            order += [{"split": split, "model": model} | _rounded(asdict(row)) | counts for row in ranks]
            if split == "test":
                metrics["suitability"][model] = _finite({f"{row.measure}_mean": row.mean for row in ranks}) | counts
                errors += _errors(model, predicted, simulated, metrics)
    errors.sort(key=lambda row: TARGETS.index(str(row["target"])))
    return Comparison(features, trainings, found, errors, order, metrics | profile_metrics)


def _errors(model: str, predicted: Array, simulated: Array, metrics: Metrics) -> Rows:
    """Rows of Table 5.1 for one model; its headline figures go into the metrics."""
    rows: Rows = []
    for row in error_rows(predicted, simulated):
        figures = asdict(row)
        rows.append({"target": row.target, "model": model} | _rounded(figures))
        prefix, suffix = ("rel", "_percent") if row.error == "rel_percent" else ("abs", "")
        target = metrics[row.target].setdefault(model, {})
        target |= _finite({f"{prefix}_{q}{suffix}": figures[q] for q in ("p25", "p50", "p75", "max", "mean")})
        if row.error == "rel_percent":
            target["zeros_left_out"] = row.zeros_left_out
    return rows


def _of_motions(features: pa.Table, part: pa.Table, column: str) -> Array:
    """A column of the features, which are sorted by motion, for the motions of `part`."""
    rows = np.searchsorted(features["motion_id"].to_numpy(), part["motion_id"].to_numpy())
    return np.asarray(features[column].to_numpy()[rows])


def _rounded(row: Mapping[str, object]) -> dict[str, object]:
    """Floats with six decimals, empty where there is no figure."""
    return {
        key: ("" if math.isnan(value) else round(value, 6)) if isinstance(value, float) else value
        for key, value in row.items()
    }


def _finite(figures: Mapping[str, float]) -> dict[str, float]:
    return {key: round(value, 6) for key, value in figures.items() if math.isfinite(value)}
