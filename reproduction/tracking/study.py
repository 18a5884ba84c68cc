"""The record of the comparison in MLflow: a run of the whole, and one below it for each model."""

from __future__ import annotations

from typing import Any

from reproduction.layout import Layout
from reproduction.study.comparison import Comparison
from reproduction.study.config import StudyParams
from reproduction.tracking.store import config_hash, git_commit, recording


def record(mlflow: Any, layout: Layout, params: StudyParams, found: Comparison) -> None:
    """Record errors, parameters and the hyperparameters that each outer fold chose.

    Args:
        mlflow: MLflow, connected to the store.
        layout: Folder of the project; its table of the comparison is written.
        params: Parameters of the studies.
        found: The comparison.

    Raises:
        RecordError: The store failed.
    """
    settings = params.compare_predictors.model_dump(mode="json") | params.plant.model_dump(mode="json")
    tags = {
        "git_commit": git_commit(layout.root),
        "config_hash": config_hash(params.compare_predictors),
        "dvc_stage": "compare_predictors",
    }
    with recording(layout), mlflow.start_run(run_name="nested cross-validation", tags=tags):
        mlflow.log_params(settings)
        mlflow.log_artifact(str(layout.study_tables_dir / "predictors.csv"), "tables")
        for model in dict.fromkeys(str(row["model"]) for row in found.rows):
            with mlflow.start_run(run_name=model, tags=tags | {"model": model}, nested=True):
                mlflow.log_params({"model": model} | settings)
                if chosen := found.chosen.get(model):
                    mlflow.log_dict({"outer_folds": chosen}, "chosen.json")
                mlflow.log_metrics(found.metrics.get(model, {}))
                for row in found.rows:
                    if row["model"] == model:
                        figures = {k: float(str(v)) for k, v in row.items() if k.startswith("rel_")}
                        mlflow.log_metrics({f"{row['target']}.{name}": value for name, value in figures.items()})
