"""Time series of motions at ten speed limits, written to Parquet at 250 Hz. `python -m benchmarks.series`.

Against the bare writing of the same rows with the same options, and for memory: the peak of a process that writes few
motions against one that writes many.
"""

from __future__ import annotations

import json
import resource
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from threadpoolctl import threadpool_limits

from benchmarks.measure import interleaved, ratio, rounded, run
from reproduction.motions.shards import random_motions
from reproduction.motions.tables import samples_writer, write_samples
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload

SPEED_LIMITS = np.arange(1, 11) / 10.0
RATE_HZ = 250.0
WORKERS = 2
SHARD_MOTIONS = 300


def simulate_and_write(path: Path, motions: int, seed: int = 0) -> None:
    """What the stage simulate_motions does with a shard: all runs, then their time series."""
    with threadpool_limits(1):
        robot = load_robot("kuka_kr16_r2010_2", Payload(10.0))
        paths = MotionPaths(robot, *random_motions(robot, np.random.default_rng(seed), motions, (2.1, 4.5)))
        paths.simulate(SPEED_LIMITS)
        write_samples(path, np.arange(motions), paths, SPEED_LIMITS, RATE_HZ)


def _rewrite(path: Path, table: object) -> None:
    with samples_writer(path) as writer:
        writer.write_table(table, row_group_size=1 << 20)


def measure(folder: Path) -> dict[str, float]:
    """Rates, ratio to the writer and memory."""
    one = folder / "one.parquet"
    simulate_and_write(one, SHARD_MOTIONS)
    table = pq.read_table(one)
    seconds = interleaved(
        3,
        time.process_time,
        all=lambda: simulate_and_write(one, SHARD_MOTIONS),
        writer=lambda: _rewrite(folder / "bare.parquet", table),
    )
    # Spawned, as the workers of a stage on a fresh machine are.
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
        files = [folder / f"part-{shard}.parquet" for shard in range(8)]
        list(pool.map(simulate_and_write, files[:WORKERS], [10] * WORKERS))  # imports are not part of the rate
        start = time.perf_counter()
        list(pool.map(simulate_and_write, files, [SHARD_MOTIONS] * len(files), range(len(files))))
        rate = len(files) * SHARD_MOTIONS / (time.perf_counter() - start)
    few, many = (
        float(run([sys.executable, "-m", "benchmarks.series", "--memory", str(motions), str(one)]).output)
        for motions in (SHARD_MOTIONS, 8 * SHARD_MOTIONS)
    )
    return rounded(
        {
            "ratio_to_bare_writer": ratio(seconds, "all", "writer"),
            "motions_per_s_on_two_cores": rate,
            "bare_writer_motions_per_s_on_one_core": SHARD_MOTIONS / float(np.median(seconds["writer"])),
            "memory_of_8_shards_over_1": many / few,
            "peak_mib_of_a_worker": many,
        }
    )


def main() -> None:
    """Print one JSON line; with `--memory MOTIONS FILE`, the peak memory [MiB] of writing so many motions."""
    if sys.argv[1:2] == ["--memory"]:
        for seed in range(int(sys.argv[2]) // SHARD_MOTIONS):
            simulate_and_write(Path(sys.argv[3]), SHARD_MOTIONS, seed)
        print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
        return
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(measure(Path(folder))))


if __name__ == "__main__":
    main()
