"""The record of the comparison in MLflow: one run a model, in the store of the pipeline."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from reproduction.tracking import store as pipeline
from stages.layout import Layout

if TYPE_CHECKING:
    from reproduction.study.comparison import Comparison
    from reproduction.study.config import StudyParams
    from stages._study import StudyLayout

EXPERIMENT = "robojoule-study"


def record(layout: StudyLayout, params: StudyParams, found: Comparison) -> None:
    """Record errors, parameters and chosen hyperparameters of every model."""
    store = Layout(layout.root)
    mlflow = pipeline._mlflow()
    mlflow.set_tracking_uri(pipeline.store_uri(store))
    mlflow.set_registry_uri(pipeline.store_uri(store))
    if mlflow.get_experiment_by_name(EXPERIMENT) is None:
        artifacts = layout.root.resolve() / "mlartifacts"
        mlflow.create_experiment(EXPERIMENT, artifact_location=artifacts.as_uri())
    mlflow.set_experiment(EXPERIMENT)
    settings = params.compare_predictors.model_dump(mode="json") | params.plant.model_dump(mode="json")
    tags = {"git_commit": pipeline.git_commit(layout.root), "dvc_stage": "compare_predictors"}
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
            mlflow.log_artifact(str(layout.tables_dir / "predictors.csv"), "tables")
