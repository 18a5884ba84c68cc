"""Many random motions of a robot, simulated by shards on Prefect's task runners. `python -m flows.scale --help`.

The bytes do not depend on the runner or the number of its workers, and a run that was stopped goes on with the shards
that are missing (see `reproduction.motions.shards`). Prefect starts the tasks and keeps nothing.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from prefect import flow, get_run_logger, task
from prefect.cache_policies import NO_CACHE
from prefect.futures import as_completed
from threadpoolctl import threadpool_limits

from flows.command import told
from flows.runners import add_runner, task_runner
from flows.server import prefect_server
from reproduction.layout import Layout
from reproduction.motions.shards import MotionSet, close_folder, open_folder, write_shard
from robojoule.documents import parse


@task(cache_policy=NO_CACHE, persist_result=False)
def simulate_shard(motion_set: MotionSet, out: Path, shard: int) -> int:
    """Simulate one shard; returns its number."""
    write_shard(motion_set, out, shard)
    return shard


@flow(persist_result=False)
def simulate_shards(motion_set: MotionSet, out: Path, shards: list[int]) -> None:
    """Simulate some shards on this flow's task runner."""
    logger, started = get_run_logger(), time.monotonic()
    futures = [simulate_shard.submit(motion_set, out, shard) for shard in shards]
    for done, future in enumerate(as_completed(futures), start=1):
        shard = future.result()
        logger.info("shard %d: %d of %d after %.1f s", shard, done, len(shards), time.monotonic() - started)


@flow(name="scale", persist_result=False)
def scale(
    motion_set: MotionSet, out: Path, runner: str = "processes", workers: int = 2, address: str | None = None
) -> int:
    """Simulate a set of random motions; shards that are there already are not made again.

    Args:
        motion_set: Which motions.
        out: Folder of the set.
        runner: Task runner: processes, threads, dask or ray.
        workers: Number of processes or threads here.
        address: Address of a Dask or Ray cluster.

    Returns:
        Number of shards that were made.

    Raises:
        InputError: Bad runner, robot or folder.
    """
    tasks = task_runner(runner, workers, address)
    missing = open_folder(motion_set, out)
    get_run_logger().info("%d of %d shards are missing", len(missing), motion_set.shards)
    if missing:
        with threadpool_limits(1):  # also holds while threads end one after another
            simulate_shards.with_options(task_runner=tasks)(motion_set, out.resolve(), missing)
    close_folder(motion_set, out)
    return len(missing)


def main() -> None:
    """Make a set, or go on with one, from the command line."""
    parser = argparse.ArgumentParser(prog="python -m flows.scale", description=__doc__.splitlines()[0])
    parser.add_argument("--motions", type=int, required=True, metavar="N", help="number of motions")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the set")
    parser.add_argument("--robot", default="kuka_kr16_r2010_2", metavar="NAME", help="catalog name or robot file")
    parser.add_argument("--payload", type=float, default=10.0, metavar="KG", help="payload mass [kg] (default: 10)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the motions (default: 1)")
    parser.add_argument(
        "--shard-motions", type=int, default=10000, metavar="N", help="motions per shard (default: 10000)"
    )
    add_runner(parser, "processes")
    arguments = parser.parse_args()
    with told("flows.scale"):
        description = {
            "robot": {
                "name": arguments.robot,
                "payload_kg": arguments.payload,
                "payload_com_m": (0.0, 0.0, 0.1),
            },
            **{key: getattr(arguments, key) for key in ("seed", "motions", "shard_motions")},
        }
        motion_set = parse(MotionSet, description, "command line")
        task_runner(arguments.runner, arguments.workers, arguments.address)
        open_folder(motion_set, arguments.out)  # both: refused before a server is started
        with prefect_server(Layout()):
            scale(motion_set, arguments.out, arguments.runner, arguments.workers, arguments.address)


if __name__ == "__main__":
    main()
