"""The record of the comparison in MLflow: one run per model, in the store of the pipeline."""

from __future__ import annotations

import json

from reproduction.layout import Layout
from reproduction.study.comparison import Comparison
from reproduction.study.config import StudyParams
from reproduction.tracking.store import connect, git_commit

EXPERIMENT = "robojoule-study"


def record(layout: Layout, params: StudyParams, found: Comparison) -> None:
    """Record errors, parameters and chosen hyperparameters of every model."""
    mlflow = connect(layout, EXPERIMENT)
    settings = params.compare_predictors.model_dump(mode="json") | params.plant.model_dump(mode="json")
    tags = {"git_commit": git_commit(layout.root), "dvc_stage": "compare_predictors"}
    for model in dict.fromkeys(str(row["model"]) for row in found.rows):
        with mlflow.start_run(run_name=model, tags=tags | {"model": model}):
            mlflow.log_params({"model": model} | settings)
            if found.chosen.get(model):
                mlflow.log_params({"chosen": json.dumps(found.chosen[model])[:500]})
            mlflow.log_metrics(found.metrics.get(model, {}))
            for row in found.rows:
                if row["model"] == model:
                    figures = {k: float(str(v)) for k, v in row.items() if k.startswith("rel_")}
                    mlflow.log_metrics({f"{row['target']}.{name}": value for name, value in figures.items()})
            mlflow.log_artifact(str(layout.study_tables_dir / "predictors.csv"), "tables")
