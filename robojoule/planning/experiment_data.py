"""Read what the plan experiment needs from the pipeline's files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from robojoule.errors import InputError
from robojoule.operations import OperationTree, load_tree
from robojoule.planning.batch import TreeBatch
from robojoule.planning.experiment import Beliefs
from robojoule.predictor.profile_archive import load_profile_predictor
from robojoule.profile.piecewise import Array
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
    table = _read(motions, "simulate_motions", filters=[("split", "==", "experiment")])
    table = table.sort_by([("tree_id", "ascending"), ("order", "ascending")])
    if not len(table):
        raise InputError("there is no experiment motion", file=motions)
    ids = table["motion_id"].to_numpy()
    tree_ids = tuple(dict.fromkeys(table["tree_id"].to_pylist()))
    loaded = [load_tree(trees_dir / f"{tree_id}.yaml", robot) for tree_id in tree_ids]
    speeds, durations, energies = _runs(runs, ids)
    batch = TreeBatch(robot, loaded, slowest_speed_limit=float(speeds[0]))
    _check_same_motions(table, batch, loaded, motions)
    predicted = _predictions(predictions, ids)
    if not profile_predictor.with_suffix(".json").exists():
        raise InputError(
            "the file is missing; run the stage train_predictors first", file=profile_predictor.with_suffix(".json")
        )
    predictor = load_profile_predictor(profile_predictor)
    beliefs = Beliefs(
        run_speed_limits=speeds,
        run_durations_s=durations,
        run_energies_j=energies,
        final_power_w=_final_power_w(samples_dir, ids, float(speeds[0])),
        predicted_optimal_duration_s=predicted["optimal_duration_s"],
        predicted_saving_j=predicted["energy_saving_j"],
        predicted_penalty_j=predicted["energy_penalty_j"],
        # The plant of the pipeline is the entry itself: its paths are the nominal ones.
        predicted_profiles=predictor.predict(batch.paths, batch.speed_limits(PREDICTED_SPEED_LIMITS)),
    )
    points = _read(trees, "generate_trees", columns=["tree_id", "complexity"])
    complexity = dict(zip(points["tree_id"].to_pylist(), points["complexity"].to_pylist(), strict=True))
    return ExperimentData(tree_ids, tuple(complexity[tree_id] for tree_id in tree_ids), batch, beliefs)


def _read(path: Path, stage: str, **options: object) -> pa.Table:
    if not path.exists():
        raise InputError(f"the file is missing; run the stage {stage} first", file=path)
    try:
        return pq.read_table(path, **options)
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"the file cannot be read ({' '.join(str(error).split())})", file=path) from None


def _check_same_motions(table: pa.Table, batch: TreeBatch, trees: list[OperationTree], path: Path) -> None:
    joints = batch.robot.joint_count
    starts = np.stack([table[f"start_q{j + 1}_rad"].to_numpy() for j in range(joints)], axis=1)
    of_trees = np.concatenate([tree.configurations_rad()[:-1] for tree in trees])
    if starts.shape != of_trees.shape or not np.allclose(starts, of_trees, rtol=0.0, atol=1e-9):
        raise InputError("the motions are not those of the operation-tree files", file=path)


def _runs(path: Path, ids: Array) -> tuple[Array, Array, Array]:
    """Speed limits (S,), durations (M, S) [s] and energies (M, S) [J] of the measured runs."""
    columns = ["motion_id", "speed_limit_percent", "duration_s", "energy_j"]
    table = _read(path, "simulate_motions", columns=columns, filters=[("motion_id", "in", ids.tolist())])
    table = _in_order(table, ids).sort_by([("place", "ascending"), ("speed_limit_percent", "ascending")])
    speeds = np.unique(table["speed_limit_percent"].to_numpy())
    if len(table) != len(ids) * len(speeds):
        raise InputError("there is not one run for each experiment motion and speed limit", file=path)
    durations, energies = (table[name].to_numpy().reshape(len(ids), -1) for name in ("duration_s", "energy_j"))
    return speeds / 100.0, durations, energies


def _predictions(path: Path, ids: Array) -> dict[str, Array]:
    table = _read(path, "train_predictors", filters=[("motion_id", "in", ids.tolist()), ("model", "==", PREDICTOR)])
    table = _in_order(table, ids).sort_by("place")
    if not np.array_equal(table["motion_id"].to_numpy(), ids):
        raise InputError(f"there is not one prediction of {PREDICTOR} for each experiment motion", file=path)
    names = ("optimal_duration_s", "energy_saving_j", "energy_penalty_j")
    return {name: table[name].to_numpy() for name in names}


def _final_power_w(samples_dir: Path, ids: Array, slowest: float) -> Array:
    """Mean power before the destination of the slowest run of each motion, shape (M,). [W]"""
    wanted = pc.field("motion_id").isin(ids.tolist()) & (pc.field("speed_limit_percent") == np.float32(100.0 * slowest))
    columns = ["motion_id", "time_s", "power_w"]
    parts = [
        _read(path, "simulate_motions", columns=columns, filters=wanted)
        for path in sorted(samples_dir.glob("*.parquet"))
    ]
    if not parts:
        raise InputError("there are no time series; run the stage simulate_motions first", file=samples_dir)
    samples = pa.concat_tables(parts)
    motion = samples["motion_id"].to_numpy()
    if not np.isin(ids, motion).all():
        raise InputError("there are no samples of the slowest run of every experiment motion", file=samples_dir)
    time, power = (samples[name].to_numpy().astype(float) for name in ("time_s", "power_w"))
    order = np.argsort(motion, kind="stable")
    motion, time, power = motion[order], time[order], power[order]
    first, last = np.searchsorted(motion, ids), np.searchsorted(motion, ids, side="right")
    result = np.empty(len(ids))
    for place, (a, b) in enumerate(zip(first, last, strict=True)):
        final = time[a:b] >= time[b - 1] - FINAL_POWER_WINDOW_S
        result[place] = power[a:b][final].mean()
    return result


def _in_order(table: pa.Table, ids: Array) -> pa.Table:
    """Add `place`: where each row's motion stands in `ids`."""
    place = {int(motion): index for index, motion in enumerate(ids)}
    return table.append_column("place", pa.array([place[motion] for motion in table["motion_id"].to_pylist()]))
