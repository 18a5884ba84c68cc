"""The predictor of whole profiles: fitted to the training trees, read back, judged on held-out trees, registered."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyarrow as pa

from reproduction.config import Params
from reproduction.predictors.gate import passes_gate
from reproduction.predictors.measurements import MeasuredTable, read_measurements
from reproduction.predictors.profile_parameters import TARGETS
from reproduction.tracking import store as _tracking
from robojoule.errors import RobojouleError
from robojoule.profile.parameters import profile_parameters
from robojoule.profile.predicted import Measurements, PredictedProfiles, ProfilePredictor, fit_profile_predictor
from robojoule.profile.predictor_file import export_profile_predictor, load_profile_predictor
from stages.layout import Layout

MODEL = "robojoule_predicted"
REGISTERED = "robojoule_profile_predictor"
HELD_OUT = ("test", "experiment")
TRAINING_TREES = 60  # spread over the training trees: more change nothing
RUNS_PER_MOTION = 3
MODEL_CODE = Path(__file__).with_name("_profile_model.py")


@dataclass(frozen=True)
class ProfileTraining:
    """A fitted profile predictor, as it was read back.

    Attributes:
        predictor: The predictor.
        predictions: Predicted and measured parameters of held-out motions, one row each, as those of other models.
        training: Measured parameters of the training motions, shape (K, 3).
        interval: `coverage_percent`, share of the test runs inside the prediction interval; `half_width_percent`,
            median of half its width over the energy. [%]
        fit_s: Time of the fit, for the record only. [s]
    """

    predictor: ProfilePredictor
    predictions: pa.Table
    training: np.ndarray
    interval: dict[str, float]
    fit_s: float

    def passes(self, rivals: Sequence[np.ndarray] = ()) -> bool:
        """Whether it passes the gate on the test trees; rivals are predictions of the same motions."""
        test = self.predictions.filter(pa.compute.equal(self.predictions["split"], "test"))
        predicted, measured = (
            np.column_stack([test[f"{target}{end}"].to_numpy() for target in TARGETS]) for end in ("", "_measured")
        )
        return passes_gate(predicted, measured, self.training, rivals)


def read_measured(params: Params, layout: Layout) -> dict[str, MeasuredTable]:
    """Measured motions by split: those of some training trees, and all of `HELD_OUT`."""
    robot = params.robot.robot()
    most_trees = {"train": TRAINING_TREES}
    return {
        split: read_measurements(robot, layout.motions, layout.runs, split, most_trees.get(split))
        for split in ("train", *HELD_OUT)
    }


def train_profile_predictor(layout: Layout, measured: Mapping[str, MeasuredTable]) -> ProfileTraining:
    """Fit to training trees, write `models/profile_predictor`, read it back and predict the held-out motions."""
    train = measured["train"].measurements
    start = time.perf_counter()
    fitted = fit_profile_predictor(train.paths.robot, [train.thinned(RUNS_PER_MOTION)])
    fit_s = time.perf_counter() - start
    export_profile_predictor(fitted, layout.models_dir / "profile_predictor")
    predictor = load_profile_predictor(layout.models_dir / "profile_predictor")
    predicted = {
        split: predictor.predict(measured[split].measurements.paths, measured[split].measurements.speed_limits)
        for split in HELD_OUT
    }
    tables = [_predictions(predicted[split], measured[split], split) for split in HELD_OUT]
    predictions = pa.concat_tables(tables).sort_by("motion_id")
    interval = _interval(predicted["test"], measured["test"].measurements)
    return ProfileTraining(predictor, predictions, _parameters(measured["train"]), interval, fit_s)


def _interval(predicted: PredictedProfiles, measured: Measurements) -> dict[str, float]:
    moving, energy = measured.paths.moving, measured.energy_j
    inside = (energy >= predicted.lower_j) & (energy <= predicted.upper_j)
    width = (predicted.upper_j - predicted.lower_j)[moving] / 2.0 / energy[moving]
    return {
        "coverage_percent": round(100.0 * float(inside[moving].mean()), 2),
        "half_width_percent": round(100.0 * float(np.median(width)), 4),
    }


def _parameters(table: MeasuredTable) -> np.ndarray:
    measured = table.measurements
    return profile_parameters(measured.paths.durations(measured.speed_limits), measured.energy_j)


def _predictions(predicted: PredictedProfiles, table: MeasuredTable, split: str) -> pa.Table:
    ours, measured = profile_parameters(predicted.duration_s, predicted.energy_j), _parameters(table)
    columns: dict[str, object] = {
        "motion_id": pa.array(table.motion_id, pa.int32()),
        "tree_id": list(table.tree_id),
        "split": [split] * len(table.motion_id),
        "model": [MODEL] * len(table.motion_id),
    }
    columns |= {target: ours[:, place] for place, target in enumerate(TARGETS)}
    columns |= {f"{target}_measured": measured[:, place] for place, target in enumerate(TARGETS)}
    return pa.table(columns)


def record_profile_predictor(
    recorder: _tracking.Recorder,
    training: ProfileTraining,
    metrics: _tracking.Metrics,
    rivals: Sequence[np.ndarray] = (),
) -> bool:
    """Record the training in MLflow; register the model and make it the champion only if it passes the gate.

    Args:
        recorder: Where to record.
        training: The predictor and its predictions.
        metrics: target -> model -> figure; those of this model are logged.
        rivals: Predictions of the test motions by other models, each of shape (N, 3).

    Returns:
        Whether it was registered.

    Raises:
        RobojouleError: The registered model is another one than the files in `models/`.
    """
    mlflow = recorder.mlflow
    passed = training.passes(rivals)
    files = {suffix: str(recorder.layout.models_dir / f"profile_predictor.{suffix}") for suffix in ("json", "npz")}
    tags = recorder.tags | {"model": MODEL, "passes_gate": str(passed).lower()}
    with mlflow.start_run(run_name=MODEL, tags=tags), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # advice on type hints and examples; the signature is given
        mlflow.log_params({"model": MODEL, "training_trees": TRAINING_TREES, "runs_per_motion": RUNS_PER_MOTION})
        mlflow.log_metrics(_tracking.figures_of(MODEL, metrics) | {"fit_s": training.fit_s})
        if not passed:
            for file in files.values():
                mlflow.log_artifact(file, "rejected")
            return False
        logged = mlflow.pyfunc.log_model(
            name=MODEL,
            python_model=str(MODEL_CODE),
            artifacts=files,
            signature=_signature(len(training.predictor.nominal["gear_ratio"])),
            pip_requirements=[f"{package}=={version(package)}" for package in ("numpy", "pandas", "pin", "ruckig")],
            registered_model_name=REGISTERED,
        )
        number = str(logged.registered_model_version)
        again = mlflow.pyfunc.load_model(f"models:/{REGISTERED}/{number}").unwrap_python_model().predictor
        if not np.array_equal(again.calibration.x, training.predictor.calibration.x):
            raise RobojouleError(f"models:/{REGISTERED}/{number} is another model than the one that was judged")
        mlflow.MlflowClient().set_registered_model_alias(REGISTERED, "champion", number)
    return True


def _signature(joints: int) -> object:
    """Columns that the registered model takes and gives, all of them numbers."""
    from mlflow.models import ModelSignature
    from mlflow.types import ColSpec, Schema

    ends = [f"{end}_q{joint + 1}_rad" for end in ("start", "end") for joint in range(joints)]
    taken = ["payload_kg", "speed_limit_percent", *ends]
    inputs, outputs = (
        Schema([ColSpec("double", name) for name in names])
        for names in (taken, ["duration_s", "energy_j", "lower_j", "upper_j"])
    )
    return ModelSignature(inputs, outputs)
