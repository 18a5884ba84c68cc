"""All motions of all trees, simulated in shards on all processors; the bytes do not depend on how they are cut."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from threadpoolctl import threadpool_limits

from reproduction.config import RobotParams, SimulateMotionsParams
from reproduction.motions.tables import (
    MotionTable,
    motions_of_trees,
    motions_table,
    paths_table,
    runs_table,
    write_samples,
)
from reproduction.tables import column_names, read_table
from robojoule.errors import InputError
from robojoule.motion.simulation import Engines, MotionPaths
from robojoule.motion.time_laws import installed_ruckig
from robojoule.robots.mechanism import installed_pinocchio


class SimulatedTables(NamedTuple):
    """Tables of simulated motions.

    Attributes:
        motions: One row per motion.
        runs: One row per motion and speed limit.
        paths: Path torques, one row per motion.
    """

    motions: pa.Table
    runs: pa.Table
    paths: pa.Table


def installed_engines(settings: SimulateMotionsParams) -> Engines:
    """The engines that the parameters name.

    Raises:
        InputError: The package of one is not there.
    """
    if settings.inverse_dynamics == "pinocchio" and installed_pinocchio() is None:
        raise _missing("Pinocchio", "inverse_dynamics", "recursion")
    if settings.time_laws == "ruckig" and installed_ruckig() is None:
        raise _missing("Ruckig", "time_laws", "closed_form")
    return Engines(settings.inverse_dynamics, settings.time_laws)


def _missing(package: str, parameter: str, own: str) -> InputError:
    return InputError(
        f"{package} is not installed or cannot be loaded here", key=f"simulate_motions.{parameter}", allowed=own
    )


def read_motions(trees: Path, joints: int) -> MotionTable:
    """Motions of the trees in `data/trees.parquet`.

    Args:
        trees: The file.
        joints: Number of joints of the robot.

    Raises:
        InputError: The file is missing or unreadable, a column is missing or garbled, or there is no motion.
    """
    numbers = ["point", *(f"q{joint + 1}_rad" for joint in range(joints))]
    table = read_table(trees, "generate_trees", numbers=numbers, texts=["tree_id", "split"])
    if f"q{joints + 1}_rad" in column_names(trees, "generate_trees"):
        raise InputError(f"the robot has {joints} joints only", file=trees, key=f"q{joints + 1}_rad")
    if len(table) < 2:
        raise InputError("there is no motion", file=trees, allowed="two points of a tree or more")
    return motions_of_trees(table)


def simulate_shards(
    robot: RobotParams,
    settings: SimulateMotionsParams,
    motions: MotionTable,
    samples_dir: Path,
    progress: Callable[[str], None],
) -> SimulatedTables:
    """Simulate motions at every speed limit; the time series of each shard go to a file.

    Args:
        robot: Which robot carries what.
        settings: Speed limits, sample rate, size of a shard.
        motions: The motions.
        samples_dir: Folder of the time series; shards of an earlier run are removed.
        progress: Called with a line of text after each shard.

    Raises:
        InputError: The package of an engine is not there.
    """
    engines = installed_engines(settings)
    shards = range(0, len(motions.motion_id), settings.shard_motions)
    samples_dir.mkdir(parents=True, exist_ok=True)
    for stale in samples_dir.glob("part-*.parquet"):
        stale.unlink()
    work = partial(_simulate_shard, robot, settings, engines, motions, samples_dir)
    workers = min(os.cpu_count() or 1, len(shards))
    parts: list[SimulatedTables] = []
    # Spawned, not forked: a copy of a process with threads may hang.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for number, part in enumerate(pool.map(work, shards), start=1):
            parts.append(part)
            progress(f"shard {number} of {len(shards)}")
    return SimulatedTables(*(pa.concat_tables(tables) for tables in zip(*parts, strict=True)))


def _simulate_shard(
    robot: RobotParams,
    settings: SimulateMotionsParams,
    engines: Engines,
    motions: MotionTable,
    samples_dir: Path,
    first: int,
) -> SimulatedTables:
    part = motions.rows(slice(first, first + settings.shard_motions))
    speed_limits = np.asarray(settings.speed_limits_percent) / 100.0
    with threadpool_limits(1):  # one process per processor: threads inside would only compete
        paths = MotionPaths(robot.robot(), part.start_rad, part.end_rad, engines=engines)
        runs = paths.simulate(speed_limits)
        target = samples_dir / f"part-{first // settings.shard_motions:04d}.parquet"
        write_samples(target, part.motion_id, paths, speed_limits, settings.sample_rate_hz)
        return SimulatedTables(
            motions_table(part, paths), runs_table(part.motion_id, runs), paths_table(part.motion_id, paths)
        )
