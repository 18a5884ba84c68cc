"""The record of the profile predictor in MLflow; it is registered only if it passes its gate."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from reproduction.config import Params
from reproduction.layout import Layout
from reproduction.predictors.comparison import Metrics
from reproduction.predictors.estimators import MODELS
from reproduction.predictors.evaluation import passes_gate
from reproduction.predictors.training import SIMULATED
from reproduction.profile_predictor.training import MODEL
from reproduction.tables import columns
from reproduction.tracking.store import figures_of, log_data, promote, tags
from robojoule.arrays import Array
from robojoule.errors import RobojouleError
from robojoule.profile.parameters import TARGETS
from robojoule.profile.predictor_file import load_profile_predictor

REGISTERED = "energy-profile"
MODEL_CODE = Path(__file__).with_name("profile_model.py")
PREDICTED = ("duration_s", "energy_j", "lower_j", "upper_j")


def record_profile_predictor(
    mlflow: Any,
    params: Params,
    layout: Layout,
    test: pa.Table,
    training: Array,
    metrics: Metrics,
    rivals: Sequence[str] = MODELS,
) -> str:
    """Record the predictor in models/profile_predictor; register it and make it the champion if it passes its gate.

    Args:
        mlflow: MLflow, connected to the store.
        params: Parameters of the pipeline.
        layout: Folder of the project.
        test: Predictions of the test motions by all models.
        training: Simulated parameters of the training motions, whose mean is the baseline, shape (K, 3).
        metrics: target -> model -> figure; those of this model are logged.
        rivals: Models that it has to beat.

    Returns:
        A line of text that says whether it was registered.

    Raises:
        RobojouleError: The registered model is another one than the files in `models/`.
    """
    mine = test.filter(pa.compute.equal(test["model"], MODEL))
    others = [columns(test.filter(pa.compute.equal(test["model"], rival)), TARGETS) for rival in rivals]
    passed = passes_gate(columns(mine, TARGETS), columns(mine, SIMULATED), training, others)
    folder = str(layout.profile_predictor)
    settings = params.train_profile_predictor
    found = tags(layout, settings, "train_profile_predictor") | {"model": MODEL, "passes_gate": str(passed).lower()}
    with mlflow.start_run(run_name=MODEL, tags=found), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # advice on type hints and examples; the signature is given
        mlflow.log_params({"model": MODEL} | settings.model_dump(mode="json"))
        mlflow.log_metrics(figures_of(MODEL, metrics))
        log_data(mlflow, *(path for path in (layout.motions, layout.runs) if path.exists()))
        if not passed:
            mlflow.log_artifacts(folder, "rejected")
            return f"{MODEL}, recorded in MLflow, refused by its gate"
        register_predictor(mlflow, folder, REGISTERED)
    return f"{MODEL}, recorded in MLflow and registered"


def register_predictor(mlflow: Any, folder: str, name: str) -> None:
    """Register a predictor, read it back, and make it the champion; within a run.

    Args:
        mlflow: MLflow, connected to the store.
        folder: The predictor's files.
        name: Name of the registered model.

    Raises:
        RobojouleError: What was registered is another model.
    """
    predictor = load_profile_predictor(folder)
    logged = mlflow.pyfunc.log_model(
        name=MODEL,
        python_model=str(MODEL_CODE),
        artifacts={"predictor": folder},
        signature=_signature(len(predictor.nominal.gear_ratio)),
        pip_requirements=[f"{package}=={version(package)}" for package in ("numpy", "pandas", "pin", "ruckig")],
        registered_model_name=name,
    )
    number = str(logged.registered_model_version)
    again = mlflow.pyfunc.load_model(f"models:/{name}/{number}").unwrap_python_model().predictor
    if not np.array_equal(again.calibration.x, predictor.calibration.x):
        raise RobojouleError(f"models:/{name}/{number} is another model than the one that was judged")
    promote(mlflow, name, number)


def _signature(joints: int) -> object:
    """Columns that the registered model takes and gives, all of them numbers."""
    from mlflow.models import ModelSignature
    from mlflow.types import ColSpec, Schema

    ends = [f"{end}_q{joint + 1}_rad" for end in ("start", "end") for joint in range(joints)]
    inputs, outputs = (
        Schema([ColSpec("double", name) for name in names])
        for names in (["payload_kg", "speed_limit_percent", *ends], PREDICTED)
    )
    return ModelSignature(inputs, outputs)
