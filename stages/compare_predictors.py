"""Nested cross-validation by tree of every predictor, recorded in MLflow."""

from __future__ import annotations

from reproduction.layout import Layout
from reproduction.study.comparison import compare_models
from reproduction.study.config import StudyParams, load_study_params
from reproduction.tables import table_of_rows, write_csv, write_parquet
from reproduction.tracking import study as tracking
from reproduction.tracking.store import STUDY, RecordError, connect
from stages.cli import run, say


def compare_predictors(params: StudyParams, layout: Layout) -> None:
    """Write the errors of all models and record one MLflow run per model."""
    progress = say("compare_predictors")
    mlflow = connect(layout, STUDY)  # before the comparison, which takes long
    found = compare_models(params, progress)
    write_csv(layout.study_tables_dir / "predictors.csv", found.rows)
    write_parquet(layout.study_data_dir / "predictors.parquet", table_of_rows(found.predictions))
    try:
        tracking.record(mlflow, layout, params, found)
    except RecordError as error:  # what was found is kept
        progress(str(error))


if __name__ == "__main__":
    run(compare_predictors, load_study_params, "studies/params.yaml")
