"""Simulate every motion of every tree at every speed limit: motions, runs, path torques and time series."""

from __future__ import annotations

import json
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from threadpoolctl import threadpool_limits

from reproduction.config import Params
from reproduction.motions.tables import (
    MotionTable,
    motions_of_trees,
    motions_table,
    paths_table,
    runs_table,
    write_samples,
    write_table,
)
from reproduction.reference_robot.check import energy_model_rows
from reproduction.reference_robot.figures import energy_model_figures
from reproduction.tables import write_csv
from reproduction.validation.kr300 import kr300_energy_error_percent
from robojoule.documents import write_text
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.robot import Robot
from stages._cli import run
from stages.layout import Layout


def simulate_motions(params: Params, layout: Layout) -> None:
    """Simulate all motions of `data/trees.parquet`, in shards on all processors."""
    settings = params.simulate_motions
    motions = motions_of_trees(_read_trees(layout.trees, params.robot.robot().joint_count))
    shards = range(0, len(motions.motion_id), settings.shard_motions)
    layout.samples_dir.mkdir(parents=True, exist_ok=True)
    for stale in layout.samples_dir.glob("part-*.parquet"):
        stale.unlink()
    work = partial(_simulate_shard, params, layout.samples_dir, motions)
    tables: list[tuple[pa.Table, pa.Table, pa.Table]] = []
    with ProcessPoolExecutor(max_workers=max(1, min(os.cpu_count() or 1, len(shards)))) as pool:
        for number, result in enumerate(pool.map(work, shards), start=1):
            tables.append(result)
            print(f"simulate_motions: shard {number} of {len(shards)}", flush=True)
    joined = [pa.concat_tables(parts) for parts in zip(*tables, strict=True)]
    for path, table in zip((layout.motions, layout.runs, layout.paths), joined, strict=True):
        write_table(path, table)
    metrics = energy_model_metrics(params.robot.robot(), joined[0], joined[1])
    write_text(layout.metrics_dir / "energy_model.json", json.dumps(metrics, indent=2) + "\n")
    write_csv(layout.tables_dir / "energy_model.csv", energy_model_rows(metrics))


def _read_trees(path: Path, joints: int) -> pa.Table:
    if not path.exists():
        raise InputError("there are no operation trees; run the stage generate_trees first", file=path)
    try:
        table = pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"the file cannot be read ({' '.join(str(error).split())})", file=path) from None
    kinds = {"tree_id": pa.types.is_string, "split": pa.types.is_string, "point": pa.types.is_integer}
    kinds |= {f"q{joint + 1}_rad": pa.types.is_floating for joint in range(joints)}
    for name, is_right in kinds.items():
        if name not in table.column_names:
            raise InputError("this column is missing", file=path, key=name)
        column = table[name]
        if not is_right(column.type):
            raise InputError(f"the column holds {column.type}", file=path, key=name)
        if column.null_count or (pa.types.is_floating(column.type) and not np.isfinite(column.to_numpy()).all()):
            raise InputError("a cell is empty or not a finite number", file=path, key=name)
    if f"q{joints + 1}_rad" in table.column_names:
        raise InputError(f"the robot has {joints} joints only", file=path, key=f"q{joints + 1}_rad")
    if table.num_rows < 2:
        raise InputError("there is no motion", file=path, allowed="two points of a tree or more")
    return table


def _simulate_shard(
    params: Params, samples_dir: Path, motions: MotionTable, first: int
) -> tuple[pa.Table, pa.Table, pa.Table]:
    """Simulate one shard: its time series go to a file, its tables are returned."""
    settings = params.simulate_motions
    part = motions.rows(slice(first, first + settings.shard_motions))
    speed_limits = np.asarray(settings.speed_limits_percent) / 100.0
    with threadpool_limits(1):  # one process a processor: threads inside would only compete
        paths = MotionPaths(params.robot.robot(), part.start_rad, part.end_rad)
        runs = paths.simulate(speed_limits)
        target = samples_dir / f"part-{first // settings.shard_motions:04d}.parquet"
        write_samples(target, part.motion_id, paths, speed_limits, settings.sample_rate_hz)
        return motions_table(part, paths), runs_table(part.motion_id, runs), paths_table(part.motion_id, paths)


def energy_model_metrics(robot: Robot, motions: pa.Table, runs: pa.Table) -> dict[str, float]:
    """Headline figures of the energy model, power at full speed over the experiment trees as in the thesis."""
    speeds = len(runs) // len(motions)
    duration, energy = (runs[name].to_numpy().reshape(-1, speeds) for name in ("duration_s", "energy_j"))
    experiment = np.flatnonzero(np.array(motions["split"].to_pylist()) == "experiment")
    tree = np.unique(motions["tree_id"].to_pylist(), return_inverse=True)[1]
    figures = energy_model_figures(duration, energy, tree, experiment)
    idle_home = float(MotionPaths(robot, robot.home_rad, robot.home_rad).idle_power_start_w[0])
    idle = motions["idle_power_end_w"].to_numpy()
    figures |= {
        "idle_power_home_w": idle_home,
        "idle_power_min_w": float(idle.min()),
        "idle_power_median_w": float(np.median(idle)),
        "idle_power_max_w": float(idle.max()),
        "rising_slope_over_idle": figures["rising_chord_w"] / idle_home,
        "torque_above_limit_percent": 100.0 * float((runs["peak_torque_ratio"].to_numpy() > 1.0).mean()),
        "kr300_energy_error_percent": kr300_energy_error_percent(),
    }
    return {name: round(value, 6) for name, value in figures.items()}


def main() -> None:
    """Run from the command line."""
    run(simulate_motions)


if __name__ == "__main__":
    main()
