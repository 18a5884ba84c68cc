"""Nested cross-validation by tree of every predictor, recorded in MLflow."""

from __future__ import annotations

from concurrent.futures import Executor

from reproduction.layout import Layout
from reproduction.parts import Parts
from reproduction.study.comparison import Comparison, compare_models
from reproduction.study.config import StudyParams, load_study_params
from reproduction.tables import table_of_rows, write_csv, write_parquet
from reproduction.tracking import study as tracking
from reproduction.tracking.store import STUDY, RecordError, connect
from stages.cli import run, say


def compute(params: StudyParams, layout: Layout, executor: Executor | None = None) -> tuple[Parts, Comparison]:
    """Parts of the stage, computed by an executor or by processes here, and the comparison."""
    parts = Parts.of_stage("compare_predictors", layout, params.model_dump(mode="json"), executor=executor)
    return parts, compare_models(params, say("compare_predictors"), parts)


def compare_predictors(params: StudyParams, layout: Layout) -> None:
    """Write the errors of all models and record a run of the whole in MLflow, one for each model and each fold."""
    mlflow = connect(layout, STUDY)  # before the comparison, which takes long
    parts, found = compute(params, layout)
    write_csv(layout.study_tables_dir / "predictors.csv", found.rows)
    write_parquet(layout.study_data_dir / "predictors.parquet", table_of_rows(found.predictions))
    parts.forget()
    try:
        tracking.record(mlflow, layout, params, found)
    except RecordError as error:  # what was found is kept
        say("compare_predictors")(str(error))


if __name__ == "__main__":
    run(compare_predictors, load_study_params, "studies/params.yaml")
