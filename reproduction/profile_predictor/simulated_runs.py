"""Simulated runs of motions from the tables `motions.parquet` and `runs.parquet`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from reproduction.tables import columns, read_runs, read_table
from robojoule.calibration.run_model import ObservedRuns
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.robot import Robot


@dataclass(frozen=True)
class SimulatedMotions:
    """Simulated motions and which they are.

    Attributes:
        motion_id: Shape (M,).
        tree_id: M names of trees.
        runs: Energies and idle powers.
    """

    motion_id: NDArray[np.int64]
    tree_id: tuple[str, ...]
    runs: ObservedRuns


def read_simulated_motions(
    robot: Robot, motions: str | Path, runs: str | Path, split: str, most_trees: int | None = None
) -> SimulatedMotions:
    """Read the simulated motions of one split.

    Args:
        robot: Nominal entry with the payload that was carried.
        motions: Motions, one row per motion.
        runs: Runs, one row per motion and speed limit.
        split: train, test or experiment.
        most_trees: Only so many trees, spread evenly over those of the split.

    Raises:
        InputError: A file is missing or cannot be read, there is no such motion, or a run is missing.
    """
    motions, runs = Path(motions), Path(runs)
    ends = [[f"{side}_q{j + 1}_rad" for j in range(robot.joint_count)] for side in ("start", "end")]
    idle = ["idle_power_start_w", "idle_power_end_w"]
    table = read_table(
        motions,
        "simulate_motions",
        numbers=["motion_id", *ends[0], *ends[1], *idle],
        texts=["tree_id", "split"],
        filters=[("split", "==", split)],
    ).sort_by("motion_id")
    names = sorted(set(table["tree_id"].to_pylist()))
    if not names:
        raise InputError(f"there is no motion of the split '{split}'", file=motions, key="split")
    if most_trees is not None and len(names) > most_trees:
        names = [names[place] for place in (np.arange(most_trees) * len(names) // most_trees).tolist()]
        table = table.filter(pa.array([tree in set(names) for tree in table["tree_id"].to_pylist()]))
    ids = table["motion_id"].to_numpy().astype(np.int64)
    start, end = (columns(table, of_end, motions) for of_end in ends)
    limits, _, energies = read_runs(runs, ids)
    trees = table["tree_id"].to_pylist()
    number = {name: place for place, name in enumerate(names)}
    return SimulatedMotions(
        ids,
        tuple(trees),
        ObservedRuns(
            MotionPaths(robot, start, end),
            np.broadcast_to(limits, energies.shape).copy(),
            energies,
            columns(table, idle, motions),
            np.array([number[tree] for tree in trees], dtype=np.intp),
        ),
    )
