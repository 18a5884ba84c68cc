"""Metrics of single stages put together."""

from __future__ import annotations

from pathlib import Path
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
