"""Train the predictor of whole profiles on the training trees and let it predict the held-out ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
from threadpoolctl import threadpool_limits

from reproduction.config import TrainProfilePredictorParams
from reproduction.profile_predictor.fit import fit_profile_predictor
from reproduction.profile_predictor.simulated_runs import SimulatedMotions, read_simulated_motions
from robojoule.arrays import Array
from robojoule.calibration.run_model import ObservedRuns
from robojoule.profile.parameters import TARGETS, profile_parameters
from robojoule.profile.predicted import PredictedProfiles, ProfilePredictor
from robojoule.robots.robot import Robot

MODEL = "robojoule_predicted"
HELD_OUT = ("test", "experiment")


def train(robot: Robot, settings: TrainProfilePredictorParams, motions: Path, runs: Path) -> ProfilePredictor:
    """Fit a predictor to some runs of some training trees.

    Args:
        robot: Robot with its payload.
        settings: How many trees and runs.
        motions: data/motions.parquet.
        runs: data/runs.parquet.

    Raises:
        InputError: A file is missing or unreadable, or there is no training motion.
    """
    known = read_simulated_motions(robot, motions, runs, "train", settings.training_trees).runs
    return fit_profile_predictor(robot, [known.thinned(settings.runs_per_motion)])


def predict_held_out(
    predictor: ProfilePredictor, robot: Robot, motions: Path, runs: Path
) -> tuple[pa.Table, dict[str, float]]:
    """Predictions of the test and experiment trees, and how good the prediction interval is on the test trees.

    Args:
        predictor: The predictor, as it was read back.
        robot: Robot with its payload.
        motions: data/motions.parquet.
        runs: data/runs.parquet.

    Returns:
        Predicted and simulated parameters, one row per motion, in the order of the motions; `coverage_percent`, share
        of the runs inside the interval, and `half_width_percent`, median of half its width over the energy. [%]

    Raises:
        InputError: A file is missing or unreadable, or a split has no motion.
    """
    tables, interval = [], {}
    for split in HELD_OUT:
        found = read_simulated_motions(robot, motions, runs, split)
        with threadpool_limits(1):  # sums of a matrix product depend on the number of threads
            predicted = predictor.predict(found.runs.paths, found.runs.speed_limits)
        tables.append(_table(predicted, found, split))
        if split == "test":
            interval = _interval(predicted, found.runs)
    return pa.concat_tables(tables).sort_by("motion_id"), interval


def _table(predicted: PredictedProfiles, motions: SimulatedMotions, split: str) -> pa.Table:
    runs = motions.runs
    found = profile_parameters(predicted.duration_s, predicted.energy_j)
    simulated = profile_parameters(runs.paths.durations(runs.speed_limits), runs.energy_j)
    columns: dict[str, object] = {
        "motion_id": pa.array(motions.motion_id, pa.int32()),
        "tree_id": list(motions.tree_id),
        "split": [split] * len(motions.motion_id),
        "model": [MODEL] * len(motions.motion_id),
    }
    columns |= _named(found, "") | _named(simulated, "_simulated")
    return pa.table(columns)


def _named(parameters: Array, ending: str) -> dict[str, Array]:
    return {f"{target}{ending}": parameters[:, place] for place, target in enumerate(TARGETS)}


def _interval(predicted: PredictedProfiles, simulated: ObservedRuns) -> dict[str, float]:
    moving, energy = simulated.paths.moving, simulated.energy_j
    inside = (energy >= predicted.lower_j) & (energy <= predicted.upper_j)
    width = (predicted.upper_j - predicted.lower_j)[moving] / 2.0 / energy[moving]
    return {
        "coverage_percent": round(100.0 * float(inside[moving].mean()), 2),
        "half_width_percent": round(100.0 * float(np.median(width)), 4),
    }
