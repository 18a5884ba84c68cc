"""The record of the comparison in MLflow: a run of the whole, below it one for each model, below that each fold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from reproduction.layout import Layout
from reproduction.study.comparison import Comparison
from reproduction.study.config import StudyParams
from reproduction.tables import Row
from reproduction.tracking.store import config_hash, figures_of, log_data, of_the_code, recording


def record(mlflow: Any, layout: Layout, params: StudyParams, found: Comparison) -> None:
    """Record parameters and errors, those of each outer fold too, and the hyperparameters that it chose.

    Args:
        mlflow: MLflow, connected to the store.
        layout: Folder of the project; its table of the comparison is written.
        params: Parameters of the studies.
        found: The comparison.

    Raises:
        RecordError: The store failed.
    """
    settings = params.compare_predictors.model_dump(mode="json") | params.plant.model_dump(mode="json")
    own = {"config_hash": config_hash(params.compare_predictors), "dvc_stage": "compare_predictors"}
    tags = own | of_the_code(layout, "studies/dvc.lock")
    with recording(layout), mlflow.start_run(run_name="nested cross-validation", tags=tags):
        mlflow.log_params(settings)
        log_data(mlflow, layout.study_data_dir / "predictors.parquet")  # the motions, and what each model says of them
        mlflow.log_artifact(str(layout.study_tables_dir / "predictors.csv"), "tables")
        for model in dict.fromkeys(str(row["model"]) for row in found.rows):
            with mlflow.start_run(run_name=model, tags=tags | {"model": model}, nested=True):
                mlflow.log_params({"model": model} | settings)
                interval = figures_of(model, {"interval": found.metrics})
                mlflow.log_metrics(interval | _figures(found.rows, model=model))
                for number in range(1, params.compare_predictors.outer_folds + 1):
                    own = {"model": model, "fold": str(number)}
                    with mlflow.start_run(run_name=f"{model}, fold {number}", tags=tags | own, nested=True):
                        mlflow.log_params(own)
                        if chosen := found.chosen.get(model):
                            mlflow.log_params(chosen[number - 1])
                        mlflow.log_metrics(_figures(found.fold_rows, model=model, fold=number))


def _figures(rows: Sequence[Row], **key: object) -> dict[str, float]:
    """Errors of the rows with a key, named as in reports/metrics.json."""
    return {
        f"predictors.{row['target']}.{row['model']}.{name}": float(str(value))
        for row in rows
        if key.items() <= row.items()
        for name, value in row.items()
        if name.startswith("rel_")
    }
