"""The record of predictors of measured motions in MLflow; one is registered if it knows the machine better."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from reproduction.layout import Layout
from reproduction.measured.predictor import MeasuredPredictor
from reproduction.tracking.profile_predictor import register_predictor
from reproduction.tracking.store import log_data, of_the_code, recording


def registered_name(robot: str) -> str:
    """Name under which the predictors of a robot's measured motions are registered."""
    return f"energy-profile-measured-{robot}"


def record_measured(mlflow: Any, layout: Layout, found: MeasuredPredictor, folder: Path, rows: Path) -> str:
    """Record a fit to measured motions.

    Args:
        mlflow: MLflow, connected to the store.
        layout: Folder of the project.
        found: The fit.
        folder: Its predictor's files.
        rows: The measured set.

    Returns:
        A line of text that says whether it was registered.

    Raises:
        RecordError: The store failed.
    """
    name = registered_name(found.predictor.robot)
    tags = of_the_code(layout) | {"robot": found.predictor.robot}
    with recording(layout), mlflow.start_run(run_name=found.predictor.robot, tags=tags), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # advice on type hints and examples; the signature is given
        mlflow.log_params({"motions": found.motions, "note": found.predictor.note})
        mlflow.log_metrics({"error_percent": found.error_percent, "entry_error_percent": found.entry_error_percent})
        log_data(mlflow, rows)
        said = f"{found.error_percent:g} % error on held-out motions, {found.entry_error_percent:g} % by the entry"
        if not found.is_accepted:
            mlflow.log_artifacts(str(folder), "rejected")
            return f"recorded, not registered: {said}"
        register_predictor(mlflow, str(folder), name)
    return f"registered as {name}: {said}"
