"""All motions of all trees, simulated in shards on all processors; the bytes do not depend on how they are cut."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
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
from reproduction.pools import worker_pool
from reproduction.scratch import replace_folder, scratch_folder
from reproduction.tables import column_names, read_table
from robojoule.documents import atomic_path
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


@dataclass(frozen=True)
class Shard:
    """Some of the motions, simulated by whoever sees its folder: the files of a shard appear whole, the last one last.

    Attributes:
        number: Its number, from 0.
        robot: Which robot carries what.
        settings: Speed limits and sample rate.
        engines: What computes torques and time laws.
        motions: Its motions.
        folder: Where its files are.
    """

    number: int
    robot: RobotParams
    settings: SimulateMotionsParams
    engines: Engines
    motions: MotionTable
    folder: Path

    @property
    def samples(self) -> Path:
        """Time series of its runs."""
        return self.folder / f"part-{self.number:04d}.parquet"

    def table(self, name: str) -> Path:
        """One of its `SimulatedTables`."""
        return self.folder / f"{name}-{self.number:04d}.arrow"

    @property
    def is_made(self) -> bool:
        """Whether its files are there."""
        return all(path.exists() for path in (self.samples, *map(self.table, SimulatedTables._fields)))

    def make(self) -> None:
        """Simulate it, unless that is done.

        Raises:
            InputError: Its files cannot be written.
        """
        if self.is_made:
            return
        speed_limits = np.asarray(self.settings.speed_limits_percent) / 100.0
        ids = self.motions.motion_id
        with threadpool_limits(1):  # one process per processor: threads inside would only compete
            paths = MotionPaths(self.robot.robot(), self.motions.start_rad, self.motions.end_rad, engines=self.engines)
            runs = paths.simulate(speed_limits)
            write_samples(self.samples, ids, paths, speed_limits, self.settings.sample_rate_hz)
            tables = SimulatedTables(motions_table(self.motions, paths), runs_table(ids, runs), paths_table(ids, paths))
        for name, table in tables._asdict().items():
            with (
                atomic_path(self.table(name)) as temporary,
                pa.OSFile(str(temporary), "wb") as file,
                pa.ipc.new_file(file, table.schema) as writer,
            ):
                writer.write_table(table)

    def tables(self) -> SimulatedTables:
        """What it wrote."""
        return SimulatedTables(*(_arrow(self.table(name)) for name in SimulatedTables._fields))


def _arrow(path: Path) -> pa.Table:
    with pa.OSFile(str(path)) as file, pa.ipc.open_file(file) as reader:
        return reader.read_all()


def planned_shards(
    robot: RobotParams, settings: SimulateMotionsParams, motions: MotionTable, scratch: Path
) -> list[Shard]:
    """The shards of some motions; those that an earlier run made with the same code and parameters are there.

    Args:
        robot: Which robot carries what.
        settings: Speed limits, sample rate, size of a shard.
        motions: The motions.
        scratch: Folder of unfinished runs of the stage.

    Raises:
        InputError: The package of an engine is not there, or nothing can be written.
    """
    engines = installed_engines(settings)
    params = {"robot": robot.model_dump(mode="json"), "settings": settings.model_dump(mode="json")}
    columns = (motions.motion_id, motions.order, motions.start_rad, motions.end_rad)
    inputs = [np.ascontiguousarray(column).tobytes() for column in columns]
    words = json.dumps([motions.tree_id, motions.split]).encode()
    folder = scratch_folder(scratch, params, [*inputs, words])
    size = settings.shard_motions
    return [
        Shard(number, robot, settings, engines, motions.rows(slice(first, first + size)), folder)
        for number, first in enumerate(range(0, len(motions.motion_id), size))
    ]


def make_shards(shards: Sequence[Shard], progress: Callable[[str], None], executor: Executor | None = None) -> None:
    """Simulate the shards that are not made yet.

    Args:
        shards: All shards of the motions.
        progress: Called with a line of text after each shard.
        executor: Simulates them; one process for each processor here if not given.

    Raises:
        InputError: Something cannot be written.
    """
    missing = [shard for shard in shards if not shard.is_made]
    if len(missing) < len(shards):
        progress(f"{len(shards) - len(missing)} of {len(shards)} shards are there already")
    if not missing:
        return
    with nullcontext(executor) if executor else worker_pool(min(os.cpu_count() or 1, len(missing))) as pool:
        for number, _ in enumerate(pool.map(Shard.make, missing), start=1):
            progress(f"shard {number} of {len(missing)}")


def gathered(shards: Sequence[Shard], samples_dir: Path) -> SimulatedTables:
    """Tables of all shards; their time series are put in place.

    Args:
        shards: All shards of the motions.
        samples_dir: Folder of the time series; one of an earlier run goes when the new one is complete.

    Raises:
        InputError: Something cannot be written.
    """
    found = SimulatedTables(*map(pa.concat_tables, zip(*(shard.tables() for shard in shards), strict=True)))
    replace_folder(samples_dir, {shard.samples.name: shard.samples for shard in shards})
    return found


def forget(shards: Sequence[Shard]) -> None:
    """Remove what was kept of shards, now that the outputs made of them are written."""
    for folder in {shard.folder for shard in shards}:
        shutil.rmtree(folder, ignore_errors=True)
