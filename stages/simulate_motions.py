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

from robojoule.config import Params, RobotParams
from robojoule.dataset import MotionTable, motions_of_trees, motions_table, paths_table, runs_table, write_samples
from robojoule.documents import atomic_path, write_text
from robojoule.errors import InputError
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload, Robot
from robojoule.simulation import MotionPaths
from stages._cli import run
from stages.layout import Layout


def simulate_motions(params: Params, layout: Layout) -> None:
    """Simulate all motions of `data/trees.parquet`, in shards on all processors."""
    settings = params.simulate_motions
    motions = motions_of_trees(_read_trees(layout.trees))
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
        with atomic_path(path) as temporary:
            pq.write_table(table, temporary, compression="zstd")
    metrics = energy_model_metrics(robot_of(params.robot), joined[0], joined[1])
    write_text(layout.metrics_dir / "energy_model.json", json.dumps(metrics, indent=2) + "\n")


def robot_of(params: RobotParams) -> Robot:
    """The robot and payload that the parameters name."""
    return load_robot(params.name, Payload(params.payload_kg, params.payload_com_m))


def _read_trees(path: Path) -> pa.Table:
    if not path.exists():
        raise InputError("there are no operation trees; run the stage generate_trees first", file=path)
    return pq.read_table(path)


def _simulate_shard(
    params: Params, samples_dir: Path, motions: MotionTable, first: int
) -> tuple[pa.Table, pa.Table, pa.Table]:
    """Simulate one shard: its time series go to a file, its tables are returned."""
    settings = params.simulate_motions
    part = motions.rows(slice(first, first + settings.shard_motions))
    speed_limits = np.asarray(settings.speed_limits_percent) / 100.0
    with threadpool_limits(1):  # one process a processor: threads inside would only compete
        paths = MotionPaths(robot_of(params.robot), part.start_rad, part.end_rad)
        runs = paths.simulate(speed_limits)
        target = samples_dir / f"part-{first // settings.shard_motions:04d}.parquet"
        write_samples(target, part.motion_id, paths, speed_limits, settings.sample_rate_hz)
        return motions_table(part, paths), runs_table(part.motion_id, runs), paths_table(part.motion_id, paths)


def energy_model_metrics(robot: Robot, motions: pa.Table, runs: pa.Table) -> dict[str, float]:
    """Headline figures of the energy model, over the experiment trees where the thesis gives them so."""
    home = MotionPaths(robot, robot.home_rad, robot.home_rad)
    speeds = len(runs) // len(motions)
    energy = runs["energy_j"].to_numpy().reshape(-1, speeds)
    duration = runs["duration_s"].to_numpy().reshape(-1, speeds)
    experiment = np.array(motions["split"].to_pylist()) == "experiment"
    trees = np.array(motions["tree_id"].to_pylist())[experiment]
    full_energy, full_duration = energy[experiment, -1], duration[experiment, -1]
    power = np.array(
        [full_energy[trees == tree].sum() / full_duration[trees == tree].sum() for tree in np.unique(trees)]
    )
    best = energy.argmin(axis=1)
    inside = (best > 0) & (duration[np.arange(len(best)), best] > duration[:, -1])
    rows = np.flatnonzero((best > 0) & (duration[:, 0] > 0))
    chord = (energy[rows, 0] - energy[rows, best[rows]]) / (duration[rows, 0] - duration[rows, best[rows]])
    idle_home = float(home.idle_power_start_w[0])
    return {
        "idle_power_home_w": round(idle_home, 6),
        "idle_power_min_w": round(float(motions["idle_power_end_w"].to_numpy().min()), 6),
        "idle_power_max_w": round(float(motions["idle_power_end_w"].to_numpy().max()), 6),
        "mean_power_full_speed_w": round(float(power.mean()), 6),
        "min_tree_power_full_speed_w": round(float(power.min()), 6),
        "max_tree_power_full_speed_w": round(float(power.max()), 6),
        "duration_ratio_slowest_to_fastest": round(float(np.median(duration[rows, 0] / duration[rows, -1])), 6),
        "optimum_inside_percent": round(100.0 * float(inside.mean()), 6),
        "rising_slope_over_idle": round(float(np.median(chord)) / idle_home, 6),
    }


def main() -> None:
    """Run from the command line."""
    run(simulate_motions)


if __name__ == "__main__":
    main()
