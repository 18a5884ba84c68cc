"""The record of trainings in MLflow: a local SQLite store, its artifacts in the project's folder.

Nothing of it is an output of the pipeline: what is recorded here (times, ids, commit) changes no result.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import subprocess
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from reproduction.config import Params
from reproduction.predictors.evaluation import beats_mean
from reproduction.predictors.profile_parameters import TARGETS, input_names
from robojoule.errors import RobojouleError
from stages.layout import Layout

EXPERIMENT = "robojoule"
STAGE = "train_predictors"
EXAMPLE_ROWS = 3
CHECKED_ROWS = 200
# Types beyond numpy's and scikit-learn's public ones that the two models hold; anything else is refused on loading.
TRUSTED_TYPES = ["sklearn.tree._tree.Tree", "sklearn.neural_network._stochastic_optimizers.AdamOptimizer"]

Metrics = dict[str, dict[str, dict[str, float]]]
"""target (or "suitability") -> model -> figure."""


@dataclass(frozen=True)
class RecordedRun:
    """A training found in the store.

    Attributes:
        run_id: Its id in MLflow.
        experiment_id: Id of its experiment.
        model: Name of the model.
        data_hash: MD5 of the features that it was trained on.
        git_commit: Commit, with `-dirty` where the files differed from it.
    """

    run_id: str
    experiment_id: str
    model: str
    data_hash: str
    git_commit: str

    @property
    def page(self) -> str:
        """Where the run is shown below the address of `mlflow ui`."""
        return f"/#/experiments/{self.experiment_id}/runs/{self.run_id}"


def data_hash(path: Path) -> str:
    """MD5 of a file, the hash by which DVC knows it too."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "md5").hexdigest()


def config_hash(params: Params) -> str:
    """MD5 of the stage's parameters."""
    text = json.dumps(params.train_predictors.model_dump(mode="json"), sort_keys=True)
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def find_run(layout: Layout, model: str, data: str, config: str | None = None) -> RecordedRun | None:
    """Newest finished training of `model` on given data; also one of a stage that DVC took from its cache.

    Args:
        layout: Folder of the project.
        model: Name of the model.
        data: `data_hash` of the features.
        config: `config_hash` of the parameters; None: any.

    Returns:
        The run, or None if this store has none.
    """
    if not _store_path(layout).exists():  # a look must not create a store
        return None
    mlflow = _mlflow()
    client = mlflow.MlflowClient(tracking_uri=store_uri(layout))
    experiment = client.get_experiment_by_name(EXPERIMENT)
    if experiment is None:
        return None
    wanted = {"data_hash": data, "model": model} | ({} if config is None else {"config_hash": config})
    condition = " and ".join([f"tags.{key} = '{value}'" for key, value in wanted.items()])
    runs = client.search_runs(
        [experiment.experiment_id],
        f"{condition} and attributes.status = 'FINISHED'",
        max_results=1,
        order_by=["attributes.start_time DESC"],
    )
    if not runs:
        return None
    tags = runs[0].data.tags
    return RecordedRun(runs[0].info.run_id, experiment.experiment_id, model, data, tags["git_commit"])


def store_uri(layout: Layout) -> str:
    """Address of the store, absolute: it means the same from every folder."""
    return f"sqlite:///{_store_path(layout)}"


def _store_path(layout: Layout) -> Path:
    return Path(layout.mlflow_uri.removeprefix("sqlite:///")).resolve()


def _mlflow() -> Any:
    """MLflow, imported only where something is recorded or looked up, because that takes some 10 s."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    os.environ.setdefault("MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR", "false")
    os.environ.setdefault("MLFLOW_UV_AUTO_DETECT", "false")  # a model needs the few packages named with it
    import mlflow

    logging.getLogger("mlflow").setLevel(logging.WARNING)
    logging.getLogger("mlflow.utils.environment").setLevel(logging.ERROR)  # complains where there is no pip
    return mlflow


def git_commit(folder: Path) -> str:
    """Commit of the code, `-dirty` where tracked files differ from it; `unknown` outside a repository."""
    try:
        done = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return done.stdout.strip()


class Recorder:
    """Records trainings in the store of a project.

    Args:
        layout: Folder of the project.
        params: Parameters of the pipeline.
    """

    def __init__(self, layout: Layout, params: Params) -> None:
        self.layout = layout
        self.params = params
        self.mlflow = _mlflow()
        self.mlflow.set_tracking_uri(store_uri(layout))
        self.mlflow.set_registry_uri(store_uri(layout))
        if self.mlflow.get_experiment_by_name(EXPERIMENT) is None:
            artifacts = _store_path(layout).parent / "mlartifacts"
            self.mlflow.create_experiment(EXPERIMENT, artifact_location=artifacts.as_uri())
        self.mlflow.set_experiment(EXPERIMENT)
        self.tags = {
            "data_hash": data_hash(layout.features),
            "config_hash": config_hash(params),
            "git_commit": git_commit(Path(__file__).parent),
            "dvc_stage": STAGE,
        }

    def training(
        self,
        model: str,
        estimator: Any,
        features: pa.Table,
        predictions: pa.Table,
        metrics: Metrics,
        fit_s: float,
    ) -> None:
        """Record one training; register its model, read it back and compare it on held-out motions.

        Args:
            model: Name of the model.
            estimator: Fitted estimator.
            features: All features.
            predictions: Predictions of held-out motions by all models.
            metrics: target -> model -> figure.
            fit_s: Time of the fit. [s]

        Raises:
            RobojouleError: The model that was read back predicts something else.
        """
        splits = np.array(features["split"].to_pylist())
        names = list(input_names(sum(name.endswith("_angle_difference_rad") for name in features.column_names)))
        test = features.filter(pa.array(splits == "test"))
        frame = test.select(names).to_pandas()
        expected = estimator.predict(frame)
        settings = getattr(self.params.train_predictors, model).model_dump(mode="json")
        with self.mlflow.start_run(run_name=model, tags=self.tags | {"model": model}):
            self.mlflow.log_params(
                {"model": model, "seed": self.params.train_predictors.seed, "inputs": len(names)}
                | {"training_motions": int((splits == "train").sum()), "test_motions": len(test)}
                | settings
            )
            self.mlflow.log_metrics(figures_of(model, metrics) | {"fit_s": fit_s})
            for table in ("table_5_1", "suitability"):
                self.mlflow.log_artifact(str(self.layout.tables_dir / f"{table}.csv"), "tables")
            for name, figure in _figures(self.layout, model, predictions, features):
                self.mlflow.log_figure(figure, f"figures/{name}.png")
            logged = self.mlflow.sklearn.log_model(
                estimator,
                name=model,
                signature=self.mlflow.models.infer_signature(frame, expected),
                input_example=frame.head(EXAMPLE_ROWS),
                skops_trusted_types=TRUSTED_TYPES,
                pip_requirements=[f"{name}=={version(name)}" for name in ("scikit-learn", "numpy", "pandas", "skops")],
                registered_model_name=f"{EXPERIMENT}_{model}",
            )
            registered = f"models:/{EXPERIMENT}_{model}/{logged.registered_model_version}"
            again = self.mlflow.sklearn.load_model(registered)
            if not np.allclose(again.predict(frame[:CHECKED_ROWS]), expected[:CHECKED_ROWS], rtol=1e-12, atol=1e-9):
                raise RobojouleError(f"{registered} predicts something else than the model that was logged")
            self._promote(model, str(logged.registered_model_version), features, predictions, splits)

    def _promote(self, model: str, number: str, features: pa.Table, predictions: pa.Table, splits: np.ndarray) -> None:
        """Make the version the champion if it beats the training data's mean on the test trees."""
        name = f"{EXPERIMENT}_{model}"
        chosen = pa.compute.and_(
            pa.compute.equal(predictions["model"], model), pa.compute.equal(predictions["split"], "test")
        )
        ours = predictions.filter(chosen)
        predicted, measured = (
            np.column_stack([ours[f"{target}{end}"].to_numpy() for target in TARGETS]) for end in ("", "_measured")
        )
        training = np.column_stack([features[target].to_numpy()[splits == "train"] for target in TARGETS])
        better = beats_mean(predicted, measured, training)
        client = self.mlflow.MlflowClient()
        client.set_model_version_tag(name, number, "beats_baseline", str(better).lower())
        if better:
            client.set_registered_model_alias(name, "champion", number)


def figures_of(model: str, metrics: Metrics) -> dict[str, float]:
    """Figures of one model as MLflow names them, `energy_saving_j.rel_p50_percent`."""
    return {
        f"{group}.{name}": value
        for group, by_model in metrics.items()
        for name, value in by_model.get(model, {}).items()
    }


class _Profiles:
    """Measured profiles of single motions, as the figures ask for them."""

    def __init__(self, runs: pa.Table) -> None:
        self._runs = {
            name: runs[name].to_numpy() for name in ("motion_id", "duration_s", "energy_j", "speed_limit_percent")
        }

    def profile(self, motion_id: int) -> Any:
        """Distinct runs of a motion."""
        from robojoule.profile.sampled import sampled_profile

        runs = self._runs
        rows = runs["motion_id"] == motion_id
        return sampled_profile(
            runs["duration_s"][rows], runs["energy_j"][rows], runs["speed_limit_percent"][rows] / 100
        )


def _figures(layout: Layout, model: str, predictions: pa.Table, features: pa.Table) -> list[tuple[str, Any]]:
    """Figures 5.1-5.4 for one model, with their names."""
    from reproduction.methods.three_segment_profile import ThreeSegmentShape
    from reproduction.report.predictor_figures import overlapping_profiles, predicted_against_measured
    from robojoule.plots.style import Style

    joined = predictions.join(features.select(["motion_id", "duration_fastest_s", "duration_slowest_s"]), "motion_id")
    joined = joined.sort_by("motion_id")
    rows = {name: np.asarray(joined[name].to_pylist()) for name in joined.column_names}
    chosen = (rows["model"] == model) & (rows["split"] == "test")
    rows = {name: values[chosen] for name, values in rows.items()}
    style = Style()
    figures = []
    with style.applied():
        for number, target in enumerate(TARGETS, start=1):
            figures.append((f"figure_5_{number}", predicted_against_measured(rows, target, style).figure))
        moving = rows["duration_slowest_s"] > rows["duration_fastest_s"]
        rows = {name: values[moving] for name, values in rows.items()}
        error = np.abs(rows["energy_saving_j"] - rows["energy_saving_j_measured"])
        best_first = np.argsort(error / (rows["energy_saving_j_measured"] + 1), kind="stable")
        rows = {name: values[best_first] for name, values in rows.items()}
        profiles = _Profiles(pq.read_table(layout.runs))
        figures.append(("figure_5_4", overlapping_profiles(rows, profiles, style, ThreeSegmentShape()).figure))
    return figures
