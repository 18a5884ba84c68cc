"""Tables of the studies: errors of profile parameters."""

from __future__ import annotations

import numpy as np

from reproduction.predictors.evaluation import error_rows
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.profile.parameters import TARGETS


def parameter_rows(predicted: Array, truth: Array, key: Row) -> list[Row]:
    """Relative errors of the three parameters: one row per target.

    Args:
        predicted: Shape (M, 3).
        truth: Shape (M, 3).
        key: Leading columns.
    """
    moving = truth[:, 1] > 0.0
    rows = []
    for found in error_rows(predicted[moving], truth[moving]):
        if found.error == "rel_percent":
            figures = {name: round(getattr(found, name), 4) for name in ("p25", "p50", "p75", "max", "mean")}
            rows.append(
                key
                | {"target": found.target}
                | {f"rel_{name}_percent": value for name, value in figures.items()}
                | {"motions": found.motions, "zeros_left_out": found.zeros_left_out}
            )
    return sorted(rows, key=lambda row: TARGETS.index(str(row["target"])))


def median_rows(errors: list[Row]) -> list[Row]:
    """Medians and quartiles over robots of each robot's median error: one row per model, grid and target."""
    keys = list(dict.fromkeys((row["model"], row["grid"], row["target"]) for row in errors))
    rows: list[Row] = []
    for key in keys:
        found = [row for row in errors if (row["model"], row["grid"], row["target"]) == key]
        medians = np.array([float(str(row["rel_p50_percent"])) for row in found])
        low, middle, high = np.quantile(medians, [0.25, 0.5, 0.75])
        rows.append(
            dict(zip(("model", "grid", "target"), key, strict=True))
            | {
                "rel_p50_median_percent": round(float(middle), 4),
                "rel_p50_p25_percent": round(float(low), 4),
                "rel_p50_p75_percent": round(float(high), 4),
                "robots": len(found),
            }
        )
    return rows
