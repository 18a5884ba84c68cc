"""Trained predictors by name: a folder, or a version in the registry of MLflow.

Only arrays and figures are read; the code that MLflow keeps beside them, for its own server, is not run.
"""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from robojoule.documents import reason
from robojoule.errors import InputError, require_package
from robojoule.inputs import as_path

SCHEME = "models:/"
_DESCRIPTION = "predictor.json"
_STORE = Path(".desk/mlflow.db")  # of the pipeline, in its folder


@contextmanager
def model_folder(model: str | None) -> Iterator[Path | None]:
    """Folder of a predictor, fetched for a while where it is in a registry.

    Args:
        model: A folder, `models:/NAME@ALIAS` or `models:/NAME/VERSION`; None: none is asked for.

    Raises:
        InputError: MLflow is not installed, has no such model, or the model does not predict profiles.
    """
    if model is None or not model.startswith(SCHEME):
        yield None if model is None else as_path(model, "--model")
        return
    require_package("mlflow", "pipeline", f"--model {model}")
    with tempfile.TemporaryDirectory(prefix="robojoule-") as folder:
        fetched = _fetched(model, folder)
        found = sorted(fetched.rglob(_DESCRIPTION))
        if len(found) != 1:
            raise InputError(f"'{model}' does not predict energy profiles", key="--model", allowed="one that is")
        yield found[0].parent


def _fetched(model: str, folder: str) -> Path:
    """Files of a registered model."""
    for name, value in (("DISABLE_TELEMETRY", "true"), ("HTTP_REQUEST_MAX_RETRIES", "2")):
        os.environ.setdefault(f"MLFLOW_{name}", value)
    os.environ.setdefault("MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR", "false")
    if "MLFLOW_TRACKING_URI" not in os.environ:
        if not _STORE.exists():
            raise InputError(
                "no registry of MLflow is known",
                key="--model",
                allowed="the folder of the pipeline, or MLFLOW_TRACKING_URI",
            )
        os.environ["MLFLOW_TRACKING_URI"] = f"sqlite:///{_STORE.resolve()}"
    import mlflow

    logging.getLogger("mlflow").setLevel(logging.ERROR)
    try:
        return Path(mlflow.artifacts.download_artifacts(artifact_uri=model, dst_path=folder))
    except (mlflow.exceptions.MlflowException, OSError) as error:
        said = f"'{model}' cannot be fetched ({reason(error)})"
        raise InputError(said, key="--model", allowed="models:/NAME@ALIAS or models:/NAME/VERSION") from None
