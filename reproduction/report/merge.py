"""Claims and metrics of single stages put together."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from reproduction.claims.claim import CLAIM_COLUMNS, verdict
from reproduction.report.results import Results, Rows
from robojoule.documents import read_document
from robojoule.errors import InputError

CLAIM_TABLES = ("claims_features", "claims_predictors", "claims_plans")
METRIC_GROUPS = ("energy_model", "predictors", "plans")


def merged_claims(results: Results) -> Rows:
    """Rows of all claim tables that exist, in the order of the thesis's chapters; `held` is true, false or empty.

    Raises:
        InputError: A table lacks a column, or says neither true nor false nor nothing in `held`.
    """
    rows: Rows = []
    for name in CLAIM_TABLES:
        path = results.files.tables_dir / f"{name}.csv"
        for row in results.table(name) or []:
            missing = [column for column in CLAIM_COLUMNS if row.get(column) is None]
            if missing:
                raise InputError(f"column '{missing[0]}' is missing", file=path, key=row.get("claim"))
            if row["held"] not in map(verdict, (True, False, None)):
                raise InputError(
                    f"'{row['held']}' is not a verdict", file=path, key="held", allowed="true, false, empty"
                )
            rows.append({column: row[column] for column in CLAIM_COLUMNS})
    return rows


def merged_metrics(metrics_dir: Path) -> dict[str, Any]:
    """Content of `<group>.json` under its group, for every group of which there is a file.

    Raises:
        InputError: A file cannot be read or is no JSON object.
    """
    merged = {}
    for group in METRIC_GROUPS:
        path = metrics_dir / f"{group}.json"
        if path.exists():
            merged[group] = read_document(path)
            if not isinstance(merged[group], dict):
                raise InputError("metrics must be one JSON object", file=path)
    return merged
