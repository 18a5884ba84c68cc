"""Read what the plan experiment needs from the pipeline's files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reproduction.experiment.experiment import Beliefs
from reproduction.predictors.profile_parameters import TARGETS
from reproduction.predictors.simulated_runs import read_runs
from reproduction.tables import columns, read_table
from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.formats.tree_files import load_tree
from robojoule.planning.batch import TreeBatch
from robojoule.profile.predictor_file import load_profile_predictor
from robojoule.robots.robot import Robot

# Idle power of the original plug-in: the mean of the mains power over this time before the destination of the slowest
# profiling run ("averaging the final few consumption measurements", thesis 5.1).
FINAL_POWER_WINDOW_S = 0.1
PREDICTOR = "random_forest"
PREDICTED_SPEED_LIMITS = 41  # at which a profile is predicted


@dataclass(frozen=True, eq=False)
class ExperimentData:
    """Experiment trees with everything that methods know about them.

    Attributes:
        tree_ids: Identifiers, in order.
        complexities: simple, medium or complex, one a tree.
        batch: The trees.
        beliefs: Measured and predicted figures of their motions.
    """

    tree_ids: tuple[str, ...]
    complexities: tuple[str, ...]
    batch: TreeBatch
    beliefs: Beliefs


def read_experiment(
    robot: Robot,
    *,
    trees: Path,
    trees_dir: Path,
    motions: Path,
    runs: Path,
    samples_dir: Path,
    predictions: Path,
    profile_predictor: Path,
) -> ExperimentData:
    """Read the experiment's trees, runs, samples of the slowest runs and predictions; predict profiles.

    Args:
        robot: Robot with its payload.
        trees: data/trees.parquet.
        trees_dir: Folder of the operation-tree files.
        motions: data/motions.parquet.
        runs: data/runs.parquet.
        samples_dir: Folder of the time series.
        predictions: data/predictions.parquet.
        profile_predictor: models/profile_predictor.

    Raises:
        InputError: A file is missing, or files do not belong together.
    """
    starts = [f"start_q{j + 1}_rad" for j in range(robot.joint_count)]
    table = read_table(
        motions,
        "simulate_motions",
        numbers=["motion_id", "order", *starts],
        texts=["tree_id", "split"],
        filters=[("split", "==", "experiment")],
    ).sort_by([("tree_id", "ascending"), ("order", "ascending")])
    if not len(table):
        raise InputError("there is no experiment motion", file=motions, key="split")
    ids = table["motion_id"].to_numpy().astype(np.int64)
    tree_ids = tuple(dict.fromkeys(table["tree_id"].to_pylist()))
    loaded = [load_tree(trees_dir / f"{tree_id}.yaml", robot) for tree_id in tree_ids]
    speeds, durations, energies = read_runs(runs, ids)
    batch = TreeBatch(robot, loaded, slowest_speed_limit=float(speeds[0]))
    of_trees = np.concatenate([tree.configurations_rad()[:-1] for tree in loaded])
    of_motions = columns(table, starts, motions)
    if of_motions.shape != of_trees.shape or not np.allclose(of_motions, of_trees, rtol=0.0, atol=1e-9):
        raise InputError("the motions are not those of the operation-tree files", file=motions)
    saving, optimal_duration, penalty = _predictions(predictions, ids).T
    if not profile_predictor.exists():
        raise InputError("the folder is missing; run the stage train_predictors first", file=profile_predictor)
    predictor = load_profile_predictor(profile_predictor)
    beliefs = Beliefs(
        run_speed_limits=speeds,
        run_durations_s=durations,
        run_energies_j=energies,
        final_power_w=_final_power_w(samples_dir, ids, float(speeds[0])),
        predicted_optimal_duration_s=optimal_duration,
        predicted_saving_j=saving,
        predicted_penalty_j=penalty,
        # The plant of the pipeline is the entry itself: its paths are the nominal ones.
        predicted_profiles=predictor.predict(batch.paths, batch.speed_limits(PREDICTED_SPEED_LIMITS)),
    )
    return ExperimentData(tree_ids, _complexities(trees, tree_ids), batch, beliefs)


def _complexities(path: Path, tree_ids: tuple[str, ...]) -> tuple[str, ...]:
    points = read_table(
        path, "generate_trees", numbers=[], texts=["tree_id", "complexity"], filters=[("tree_id", "in", tree_ids)]
    )
    found = dict(zip(points["tree_id"].to_pylist(), points["complexity"].to_pylist(), strict=True))
    for tree_id in tree_ids:
        if tree_id not in found:
            raise InputError(f"the tree {tree_id} is missing", file=path, key="tree_id")
    return tuple(found[tree_id] for tree_id in tree_ids)


def _predictions(path: Path, ids: NDArray[np.int64]) -> Array:
    """Parameters that the thesis's predictor gives each motion, in the order of `TARGETS`, shape (M, 3)."""
    table = read_table(
        path,
        "train_predictors",
        numbers=["motion_id", *TARGETS],
        texts=["model"],
        filters=[("motion_id", "in", ids.tolist()), ("model", "==", PREDICTOR)],
    ).sort_by("motion_id")
    if not np.array_equal(table["motion_id"].to_numpy(), np.sort(ids)):
        raise InputError(
            f"there is not one prediction of {PREDICTOR} for each experiment motion", file=path, key="motion_id, model"
        )
    return columns(table, TARGETS, path)[np.argsort(np.argsort(ids))]


def _final_power_w(samples_dir: Path, ids: NDArray[np.int64], slowest: float) -> Array:
    """Mean power before the destination of the slowest run of each motion, shape (M,). [W]"""
    names = ["motion_id", "speed_limit_percent", "time_s", "power_w"]
    wanted = [("motion_id", "in", ids.tolist()), ("speed_limit_percent", "==", np.float32(100.0 * slowest))]
    parts = [
        columns(read_table(path, "simulate_motions", numbers=names, filters=wanted), names, path)
        for path in sorted(samples_dir.glob("*.parquet"))
    ]
    if not parts:
        raise InputError("there are no time series; run the stage simulate_motions first", file=samples_dir)
    motion, _, time, power = np.concatenate(parts).T
    if not np.isin(ids, motion).all():
        raise InputError("there are no samples of the slowest run of every experiment motion", file=samples_dir)
    order = np.argsort(motion, kind="stable")
    motion, time, power = motion[order], time[order], power[order]
    first, last = np.searchsorted(motion, ids), np.searchsorted(motion, ids, side="right")
    result = np.empty(len(ids))
    for place, (a, b) in enumerate(zip(first, last, strict=True)):
        final = time[a:b] >= time[b - 1] - FINAL_POWER_WINDOW_S
        result[place] = power[a:b][final].mean()
    return result
