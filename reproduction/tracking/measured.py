"""The record of predictors of measured motions in MLflow; one is registered if it knows the machine better."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from reproduction.layout import Layout
from reproduction.measured.predictor import MeasuredPredictor
from reproduction.tracking.profile_predictor import register_predictor
from reproduction.tracking.store import git_commit, log_data, recording

REGISTERED = "energy-profile-measured"


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
    tags = {"git_commit": git_commit(layout.root), "robot": found.predictor.robot}
    with recording(layout), mlflow.start_run(run_name=found.predictor.robot, tags=tags), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # advice on type hints and examples; the signature is given
        mlflow.log_params({"motions": found.motions, "note": found.predictor.note})
        mlflow.log_metrics({"error_percent": found.error_percent, "entry_error_percent": found.entry_error_percent})
        log_data(mlflow, rows)
        said = f"{found.error_percent:g} % error on held-out motions, {found.entry_error_percent:g} % by the entry"
        if not found.is_accepted:
            mlflow.log_artifacts(str(folder), "rejected")
            return f"recorded, not registered: {said}"
        register_predictor(mlflow, str(folder), REGISTERED)
    return f"registered as {REGISTERED}: {said}"
