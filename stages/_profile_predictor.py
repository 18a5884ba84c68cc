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
from threadpoolctl import threadpool_limits

from reproduction.config import Params
from reproduction.predictors.gate import passes_gate
from reproduction.predictors.profile_fit import fit_profile_predictor
from reproduction.predictors.profile_parameters import TARGETS
from reproduction.predictors.simulated_runs import SimulatedMotions, read_simulated_motions
from reproduction.tracking import store as _tracking
from robojoule.calibration.run_model import ObservedRuns
from robojoule.errors import RobojouleError
from robojoule.profile.parameters import profile_parameters
from robojoule.profile.predicted import PredictedProfiles, ProfilePredictor
from robojoule.profile.predictor_file import load_profile_predictor, save_profile_predictor
from stages.layout import Layout

MODEL = "robojoule_predicted"
REGISTERED = "robojoule_profile_predictor"
HELD_OUT = ("test", "experiment")
TRAINING_TREES = 60  # spread over the training trees: more change nothing
RUNS_PER_MOTION = 3
MODEL_CODE = Path(__file__).with_name("_profile_model.py")
FOLDER = "profile_predictor"  # below `models/`


@dataclass(frozen=True)
class ProfileTraining:
    """A fitted profile predictor, as it was read back.

    Attributes:
        predictor: The predictor.
        predictions: Predicted and simulated parameters of held-out motions, one row each, as those of other models.
        training: Simulated parameters of the training motions, shape (K, 3).
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
        predicted, simulated = (
            np.column_stack([test[f"{target}{end}"].to_numpy() for target in TARGETS]) for end in ("", "_measured")
        )
        return passes_gate(predicted, simulated, self.training, rivals)


def read_simulated(params: Params, layout: Layout) -> dict[str, SimulatedMotions]:
    """Simulated motions by split: those of some training trees, and all of `HELD_OUT`."""
    robot = params.robot.robot()
    most_trees = {"train": TRAINING_TREES}
    return {
        split: read_simulated_motions(robot, layout.motions, layout.runs, split, most_trees.get(split))
        for split in ("train", *HELD_OUT)
    }


def train_profile_predictor(layout: Layout, simulated: Mapping[str, SimulatedMotions]) -> ProfileTraining:
    """Fit to training trees, write `models/profile_predictor`, read it back and predict the held-out motions."""
    train = simulated["train"].runs
    start = time.perf_counter()
    fitted = fit_profile_predictor(train.paths.robot, [train.thinned(RUNS_PER_MOTION)])
    fit_s = time.perf_counter() - start
    save_profile_predictor(fitted, layout.models_dir / FOLDER)
    predictor = load_profile_predictor(layout.models_dir / FOLDER)
    with threadpool_limits(1):  # sums of a matrix product depend on the number of threads
        predicted = {
            split: predictor.predict(simulated[split].runs.paths, simulated[split].runs.speed_limits)
            for split in HELD_OUT
        }
    tables = [_predictions(predicted[split], simulated[split], split) for split in HELD_OUT]
    predictions = pa.concat_tables(tables).sort_by("motion_id")
    interval = _interval(predicted["test"], simulated["test"].runs)
    return ProfileTraining(predictor, predictions, _parameters(simulated["train"]), interval, fit_s)


def _interval(predicted: PredictedProfiles, simulated: ObservedRuns) -> dict[str, float]:
    moving, energy = simulated.paths.moving, simulated.energy_j
    inside = (energy >= predicted.lower_j) & (energy <= predicted.upper_j)
    width = (predicted.upper_j - predicted.lower_j)[moving] / 2.0 / energy[moving]
    return {
        "coverage_percent": round(100.0 * float(inside[moving].mean()), 2),
        "half_width_percent": round(100.0 * float(np.median(width)), 4),
    }


def _parameters(motions: SimulatedMotions) -> np.ndarray:
    runs = motions.runs
    return profile_parameters(runs.paths.durations(runs.speed_limits), runs.energy_j)


def _predictions(predicted: PredictedProfiles, motions: SimulatedMotions, split: str) -> pa.Table:
    found, simulated = profile_parameters(predicted.duration_s, predicted.energy_j), _parameters(motions)
    columns: dict[str, object] = {
        "motion_id": pa.array(motions.motion_id, pa.int32()),
        "tree_id": list(motions.tree_id),
        "split": [split] * len(motions.motion_id),
        "model": [MODEL] * len(motions.motion_id),
    }
    columns |= {target: found[:, place] for place, target in enumerate(TARGETS)}
    columns |= {f"{target}_measured": simulated[:, place] for place, target in enumerate(TARGETS)}
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
    folder = str(recorder.layout.models_dir / FOLDER)
    tags = recorder.tags | {"model": MODEL, "passes_gate": str(passed).lower()}
    with mlflow.start_run(run_name=MODEL, tags=tags), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # advice on type hints and examples; the signature is given
        mlflow.log_params({"model": MODEL, "training_trees": TRAINING_TREES, "runs_per_motion": RUNS_PER_MOTION})
        mlflow.log_metrics(_tracking.figures_of(MODEL, metrics) | {"fit_s": training.fit_s})
        if not passed:
            mlflow.log_artifacts(folder, "rejected")
            return False
        logged = mlflow.pyfunc.log_model(
            name=MODEL,
            python_model=str(MODEL_CODE),
            artifacts={"predictor": folder},
            signature=_signature(len(training.predictor.nominal.gear_ratio)),
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
