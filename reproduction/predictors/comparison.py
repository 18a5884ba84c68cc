"""All predictors compared on held-out motions: Table 5.1, the order of suitability, the headline figures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict

import numpy as np
import pyarrow as pa

from reproduction.predictors.evaluation import error_rows, order_rows
from reproduction.predictors.training import MEASURED
from reproduction.tables import columns
from robojoule.arrays import Array
from robojoule.profile.parameters import TARGETS, steepness

Rows = list[dict[str, object]]
Metrics = dict[str, dict[str, dict[str, float]]]
"""target (or "suitability", "interval") -> model -> figure."""


def compare(predictions: pa.Table, features: pa.Table) -> tuple[Rows, Rows, Metrics]:
    """Errors on the test trees, the order of suitability on test and experiment trees, headline figures of both.

    Args:
        predictions: Predictions of all models.
        features: Features of all motions, sorted by motion.

    Returns:
        Rows of `table_5_1.csv`, rows of `suitability.csv`, and the metrics.
    """
    errors: Rows = []
    order: Rows = []
    metrics: Metrics = {name: {} for name in (*TARGETS, "suitability")}
    for model in dict.fromkeys(predictions["model"].to_pylist()):
        of_model = predictions.filter(pa.compute.equal(predictions["model"], model))
        for split in ("test", "experiment"):
            part = of_model.filter(pa.compute.equal(of_model["split"], split))
            if not len(part):
                continue
            predicted, simulated = columns(part, TARGETS), columns(part, MEASURED)
            fastest = _of_motions(features, part, "duration_fastest_s")
            marks = part["saving_outlier"].to_numpy()
            found = order_rows(
                steepness(predicted, fastest), steepness(simulated, fastest), part["tree_id"].to_pylist()
            )
            counts = {"underpredicted": int((marks < 0).sum()), "overpredicted": int((marks > 0).sum())}
            order += [{"split": split, "model": model} | _rounded(asdict(row)) | counts for row in found]
            if split == "test":
                metrics["suitability"][model] = _finite({f"{row.measure}_mean": row.mean for row in found}) | counts
                errors += _errors(model, predicted, simulated, metrics)
    errors.sort(key=lambda row: TARGETS.index(str(row["target"])))
    return errors, order, metrics


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
