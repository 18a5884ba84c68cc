"""The record of the trainings in MLflow: parameters, figures, the models, and which of them is the champion."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any

import numpy as np
import pyarrow as pa

from reproduction.config import Params
from reproduction.layout import Layout
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.predictors.comparison import Comparison
from reproduction.predictors.evaluation import beats_mean
from reproduction.predictors.training import SIMULATED, Training
from reproduction.report.predictor_figures import predicted_against_simulated, predicted_profiles
from reproduction.report.results import Results
from reproduction.tables import columns
from reproduction.tracking.profile_predictor import record_profile_predictor
from reproduction.tracking.store import connect, figures_of, log_data, promote, recording, tags
from robojoule.errors import RobojouleError
from robojoule.plots.style import Style
from robojoule.profile.parameters import TARGETS

EXAMPLE_ROWS = 3
CHECKED_ROWS = 200
_LOADING = "MLFLOW_ALLOW_PICKLE_DESERIALIZATION"
# Types beyond numpy's and scikit-learn's public ones that the two models hold; anything else is refused on loading.
TRUSTED_TYPES = ["sklearn.tree._tree.Tree", "sklearn.neural_network._stochastic_optimizers.AdamOptimizer"]


class TrainingRecord:
    """The record of the trainings of all predictors: opened before they begin, written when they are made.

    Args:
        params: Parameters of the pipeline.
        layout: Folder of the project.
    """

    def __init__(self, params: Params, layout: Layout) -> None:
        self._params = params
        self._layout = layout
        self._mlflow: Any = None

    def open(self) -> None:
        """Open the store.

        Raises:
            InputError: It cannot be used.
        """
        self._mlflow = connect(self._layout)

    def write(self, found: Comparison) -> Iterator[str]:
        """Record each training; register its model, read it back and judge it on held-out motions.

        Args:
            found: The models of three parameters and how they compare; the profile predictor is read from its files.

        Yields:
            A line of text for each training.

        Raises:
            RecordError: The store failed meanwhile; the trainings are not touched by that.
            RobojouleError: A model that was read back is another one.
        """
        mlflow, params, layout = self._mlflow, self._params, self._layout
        test = found.predictions.filter(pa.compute.equal(found.predictions["split"], "test"))
        baseline = columns(found.features.filter(pa.compute.equal(found.features["split"], "train")), TARGETS)
        for training in found.trainings:
            with recording(layout):
                number = _record(mlflow, params, layout, training, found)
                mine = test.filter(pa.compute.equal(test["model"], training.model))
                champion = beats_mean(columns(mine, TARGETS), columns(mine, SIMULATED), baseline)
                _judge(mlflow, registered_name(training.model), number, champion)
            yield f"{training.model}, recorded in MLflow"
        with recording(layout):
            line = record_profile_predictor(mlflow, params, layout, test, baseline, found.metrics)
        yield line


def registered_name(model: str) -> str:
    """Name under which a model of three parameters is registered."""
    return model.replace("_", "-")


def _record(mlflow: Any, params: Params, layout: Layout, training: Training, found: Comparison) -> str:
    """Record one training; returns the version under which its model is registered."""
    model, estimator, names = training.model, training.estimator, list(training.predictor.inputs)
    splits = np.array(found.features["split"].to_pylist())
    frame = found.features.filter(pa.array(splits == "test")).select(names).to_pandas()
    expected = estimator.predict(frame)
    settings = params.train_predictors
    with mlflow.start_run(run_name=model, tags=tags(layout, settings, "train_predictors") | {"model": model}):
        mlflow.log_params(
            {"model": model, "seed": settings.seed, "inputs": len(names)}
            | {"training_motions": int((splits == "train").sum()), "test_motions": len(frame)}
            | getattr(settings, model).model_dump(mode="json")
        )
        mlflow.log_metrics(figures_of(model, found.metrics) | {"fit_s": training.fit_s})
        log_data(mlflow, layout.features)
        for table in ("table_5_1", "suitability"):
            mlflow.log_artifact(str(layout.tables_dir / f"{table}.csv"), "tables")
        results = Results(layout, params.robot.robot(), ThreeSegmentShape(), ("runs", "features", "predictions"))
        with Style().applied():
            drawn = [predicted_against_simulated(target, results, Style(), [model]) for target in TARGETS]
            for place, drawing in enumerate([*drawn, predicted_profiles(results, Style(), model)], start=1):
                mlflow.log_figure(drawing.figure, f"figures/figure_5_{place}.png")
        with _own_model():
            logged = mlflow.sklearn.log_model(
                estimator,
                name=model,
                signature=mlflow.models.infer_signature(frame, expected),
                input_example=frame.head(EXAMPLE_ROWS),
                skops_trusted_types=TRUSTED_TYPES,
                pip_requirements=[f"{name}=={version(name)}" for name in ("scikit-learn", "numpy", "pandas", "skops")],
                registered_model_name=registered_name(model),
            )
        registered = f"models:/{registered_name(model)}/{logged.registered_model_version}"
        again = load_estimator(mlflow, registered).predict(frame[:CHECKED_ROWS])
        if not np.allclose(again, expected[:CHECKED_ROWS], rtol=1e-12, atol=1e-9):
            raise RobojouleError(f"{registered} predicts something else than the model that was logged")
    return str(logged.registered_model_version)


@contextmanager
def _own_model() -> Iterator[None]:
    """Let MLflow load the model that it is given, by which it checks the example; others stay forbidden."""
    before = os.environ.get(_LOADING)
    os.environ[_LOADING] = "true"
    try:
        yield
    finally:
        os.environ.pop(_LOADING)
        if before is not None:
            os.environ[_LOADING] = before


def load_estimator(mlflow: Any, model: str) -> Any:
    """A registered forest or network, built of known types alone.

    MLflow itself takes the list of types from the registry, so that `desk.env` forbids it to load such models.

    Args:
        mlflow: MLflow, connected to the store.
        model: Its address, such as `models:/random-forest@champion`.

    Raises:
        TypeError: It holds other types.
    """
    import skops.io

    with tempfile.TemporaryDirectory(prefix="model-") as folder:
        fetched = mlflow.artifacts.download_artifacts(artifact_uri=f"{model}/model.skops", dst_path=folder)
        return skops.io.load(fetched, trusted=TRUSTED_TYPES)


def _judge(mlflow: Any, name: str, number: str, champion: bool) -> None:
    """Make a version the champion if it beats the training data's mean on the test trees."""
    mlflow.MlflowClient().set_model_version_tag(name, number, "beats_baseline", str(champion).lower())
    if champion:
        promote(mlflow, name, number)
