"""Measured motions from the tables `motions.parquet` and `runs.parquet`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from robojoule.errors import InputError
from robojoule.predictor.physics import Measurements
from robojoule.robots.robot import Robot
from robojoule.simulation import MotionPaths


@dataclass(frozen=True)
class MeasuredTable:
    """Measured motions and which they are.

    Attributes:
        motion_id: Shape (M,).
        tree_id: M names of trees.
        measurements: Energies and idle powers.
    """

    motion_id: NDArray[np.int64]
    tree_id: tuple[str, ...]
    measurements: Measurements


def read_measurements(
    robot: Robot, motions: str | Path, runs: str | Path, split: str, most_trees: int | None = None
) -> MeasuredTable:
    """Read the measured motions of one split.

    Args:
        robot: Nominal entry with the payload that was carried.
        motions: Motions, one row a motion.
        runs: Runs, one row a motion and speed limit.
        split: train, test or experiment.
        most_trees: Only so many trees, spread evenly over those of the split.

    Raises:
        InputError: A file is missing or cannot be read, there is no such motion, or a run is missing.
    """
    table = _read(Path(motions), [("split", "==", split)]).sort_by("motion_id")
    names = sorted(set(table["tree_id"].to_pylist()))
    if not names:
        raise InputError(f"there is no motion of the split '{split}'", file=motions, key="split")
    if most_trees is not None and len(names) > most_trees:
        names = [names[place] for place in (np.arange(most_trees) * len(names) // most_trees).tolist()]
        table = table.filter(pa.array([tree in set(names) for tree in table["tree_id"].to_pylist()]))
    ids = table["motion_id"].to_numpy().astype(np.int64)
    start, end = (
        np.stack([table[f"{side}_q{j + 1}_rad"].to_numpy() for j in range(robot.joint_count)], axis=1)
        for side in ("start", "end")
    )
    measured = _read(Path(runs), [("motion_id", "in", ids.tolist())])
    measured = measured.sort_by([("motion_id", "ascending"), ("speed_limit_percent", "ascending")])
    limits = np.unique(measured["speed_limit_percent"].to_numpy())
    if not np.array_equal(measured["motion_id"].to_numpy(), np.repeat(ids, len(limits))):
        raise InputError("there is not one run for each motion and speed limit", file=runs)
    trees = table["tree_id"].to_pylist()
    number = {name: place for place, name in enumerate(names)}
    idle = np.stack([table[f"idle_power_{side}_w"].to_numpy() for side in ("start", "end")], axis=1)
    return MeasuredTable(
        ids,
        tuple(trees),
        Measurements(
            MotionPaths(robot, start, end),
            np.broadcast_to(limits / 100.0, (len(ids), len(limits))).copy(),
            measured["energy_j"].to_numpy().reshape(len(ids), -1).copy(),
            idle,
            np.array([number[tree] for tree in trees], dtype=np.intp),
        ),
    )


def _read(path: Path, filters: list[tuple[str, str, object]]) -> pa.Table:
    try:
        return pq.read_table(path, filters=filters)
    except FileNotFoundError:
        raise InputError("the file is missing; run the stage simulate_motions first", file=path) from None
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"the file cannot be read ({' '.join(str(error).split())})", file=path) from None
