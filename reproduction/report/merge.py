"""Metrics of single stages put together."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean
from typing import Any

from robojoule.documents import read_document
from robojoule.errors import InputError

METRIC_GROUPS = ("energy_model", "predictors", "plans")


def merged_metrics(metrics_dir: Path) -> dict[str, Any]:
    """Content of `<group>.json` under its group, for every group of which there is a file.

    Raises:
        InputError: A file cannot be read or is not a JSON object.
    """
    merged = {}
    for group in METRIC_GROUPS:
        path = metrics_dir / f"{group}.json"
        if path.exists():
            merged[group] = read_document(path)
            if not isinstance(merged[group], dict):
                raise InputError("metrics must be one JSON object", file=path)
    return merged


HEADLINES = {"krc_": "krc_polynomial", "thesis_": "predicted_three_segment", "": "robojoule_predicted"}


def headline(metrics: dict[str, Any]) -> dict[str, float]:
    """The few figures by which runs are compared at a glance: `dvc metrics show` has them in 80 columns.

    Args:
        metrics: Merged metrics.

    Returns:
        Median relative error of the forest's energy saving; gaps to the optimum of the KRC's polynomial profiles, the
        thesis's predicted profiles and robojoule's; what the last save. Plans are means over the cycle times. All in
        percent, which their names leave out for the 80 columns; figures of which the metrics know nothing are left out.
    """
    found: dict[str, float] = {}
    forest = metrics.get("predictors", {}).get("energy_saving_j", {}).get("random_forest", {})
    if "rel_p50_percent" in forest:
        found["forest_error"] = forest["rel_p50_percent"]
    for name, method in HEADLINES.items():
        plans = [one for one in metrics.get("plans", {}).get(method, {}).values() if isinstance(one, dict)]
        if plans:
            found[f"{name}gap"] = fmean(one["gap_to_optimum_percent"] for one in plans)
            found[f"{name}saving"] = fmean(one["saving_percent"] for one in plans)
    kept = ("forest_error", *(f"{name}gap" for name in HEADLINES), "saving")
    return {name: round(found[name], 3) for name in kept if name in found}
