"""Read what the plan experiment needs from the pipeline's files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from reproduction.layout import Layout
from reproduction.methods.registry import Knowledge
from reproduction.tables import columns, read_runs, read_table
from robojoule.arrays import Array, Index
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.profile.parameters import TARGETS
from robojoule.profile.predictor_file import load_profile_predictor
from robojoule.profile.sampled import sampled_profiles
from robojoule.programs.operation_tree import OperationTree, tree_from_configurations
from robojoule.robots.robot import Robot

# Idle power of the original plug-in: the mean of the mains power over this time before the destination of the slowest
# profiling run ("averaging the final few consumption measurements", thesis 5.1).
FINAL_POWER_WINDOW_S = 0.1
PREDICTOR = "random_forest"


@dataclass(frozen=True, eq=False)
class ExperimentData:
    """Experiment trees with everything that methods know about them.

    Attributes:
        complexities: simple, medium or complex, one per tree.
        batch: The trees.
        knowledge: What methods know of their motions.
    """

    complexities: tuple[str, ...]
    batch: TreeBatch
    knowledge: Knowledge


def read_experiment(robot: Robot, layout: Layout, predicted_speed_limits: int) -> ExperimentData:
    """Read the experiment's trees, runs, samples of the slowest runs and predictions; predict profiles.

    Args:
        robot: Robot with its payload.
        layout: Folder of the project.
        predicted_speed_limits: Number of speed limits at which profiles are predicted.

    Raises:
        InputError: A file is missing, or files do not belong together.
    """
    trees, complexities = _read_trees(layout.trees, robot)
    ids, tree_of_motion, parameters = _read_predictions(layout.predictions)
    if tree_of_motion != [tree.name for tree in trees for _ in tree.moves()]:
        raise InputError("the motions are not those of the experiment trees", file=layout.predictions, key="tree_id")
    speeds, durations, energies = read_runs(layout.runs, ids)
    batch = TreeBatch(robot, trees, slowest_speed_limit=float(speeds[0]))
    if not np.allclose(durations[:, -1], batch.d_min_s, rtol=1e-9, atol=0.0):
        raise InputError("the runs are not those of the experiment trees", file=layout.runs, key="duration_s")
    if not layout.profile_predictor.exists():
        raise InputError(
            "the folder is missing; run the stage train_profile_predictor first", file=layout.profile_predictor
        )
    predictor = load_profile_predictor(layout.profile_predictor)
    # The plant of the pipeline is the entry itself: its paths are the nominal ones.
    with threadpool_limits(1):  # sums of a matrix product depend on the number of threads
        predicted = predictor.predict(batch.paths, batch.speed_limits(predicted_speed_limits))
    knowledge = Knowledge(
        simulated=sampled_profiles(durations, energies, np.broadcast_to(speeds, durations.shape)),
        runs_per_motion=len(speeds),
        final_power_w=_final_power_w(layout.samples_dir, ids, float(speeds[0])),
        predicted_parameters=parameters,
        predicted_profiles=predicted,
    )
    return ExperimentData(complexities, batch, knowledge)


def _read_trees(path: Path, robot: Robot) -> tuple[list[OperationTree], tuple[str, ...]]:
    """Experiment trees in order, and the complexity of each."""
    joints = [f"q{joint + 1}_rad" for joint in range(robot.joint_count)]
    points = read_table(
        path,
        "generate_trees",
        numbers=["point", *joints],
        texts=["tree_id", "split", "complexity"],
        filters=[("split", "==", "experiment")],
    ).sort_by([("tree_id", "ascending"), ("point", "ascending")])
    if not len(points):
        raise InputError("there is no experiment tree", file=path, key="split")
    q_rad, tree_ids = columns(points, joints, path), np.array(points["tree_id"].to_pylist())
    complexities = dict(zip(points["tree_id"].to_pylist(), points["complexity"].to_pylist(), strict=True))
    trees = [tree_from_configurations(name, q_rad[tree_ids == name], robot.name) for name in complexities]
    return trees, tuple(complexities.values())


def _read_predictions(path: Path) -> tuple[Index, list[str], Array]:
    """Experiment motions in order: identifiers (M,), tree of each, and what the thesis's predictor says of them (M, 3).

    The parameters are in the order of `TARGETS`.
    """
    table = read_table(
        path,
        "train_predictors",
        numbers=["motion_id", *TARGETS],
        texts=["tree_id", "split", "model"],
        filters=[("split", "==", "experiment"), ("model", "==", PREDICTOR)],
    ).sort_by("motion_id")
    return table["motion_id"].to_numpy().astype(np.intp), table["tree_id"].to_pylist(), columns(table, TARGETS, path)


def _final_power_w(samples_dir: Path, ids: Index, slowest: float) -> Array:
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
