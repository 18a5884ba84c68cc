"""Nested cross-validation by tree of every predictor, recorded in MLflow."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stages._study import StudyLayout, run, say, write_parquet

if TYPE_CHECKING:
    from reproduction.study.config import StudyParams

NAME = "compare_predictors"


def compare_predictors(params: StudyParams, layout: StudyLayout) -> None:
    """Write the errors of all models and record one MLflow run a model."""
    from reproduction.study.comparison import compare_models
    from reproduction.tables import write_csv
    from reproduction.tracking import study as _tracking

    found = compare_models(params, say(NAME))
    write_csv(layout.tables_dir / "predictors.csv", found.rows)
    write_parquet(layout.data_dir / "predictors.parquet", found.predictions)
    _tracking.record(layout, params, found)


if __name__ == "__main__":
    run(NAME, compare_predictors)
