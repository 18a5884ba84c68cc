"""The shards of the pipeline's own simulation on a task runner, such as a cluster.

They are put where the stage keeps finished shards of runs that were killed: it finds them, makes what is missing and
writes its outputs. It knows nothing of Prefect, and the bytes are the same.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from prefect import flow, get_run_logger, task
from prefect.cache_policies import NO_CACHE
from prefect.task_runners import TaskRunner
from threadpoolctl import threadpool_limits

from reproduction.config import load_params
from reproduction.layout import Layout
from reproduction.motions.simulate import Shard, planned_shards, read_motions

STAGE = "simulate_motions"


@task(cache_policy=NO_CACHE, persist_result=False)
def make_shard(shard: Shard) -> int:
    """Simulate one shard; returns its number."""
    shard.make()
    return shard.number


@flow(name="simulate-shards", persist_result=False, validate_parameters=False)
def make_shards(shards: list[Shard]) -> int:
    """Simulate shards on this flow's task runner; returns how many."""
    with threadpool_limits(1):  # also holds while threads end one after another
        return len([future.result() for future in [make_shard.submit(shard) for shard in shards]])


def fan_out(root: Path, tasks: TaskRunner[Any], force: bool = False) -> int:
    """Make the missing shards of the stage, if it would run.

    Args:
        root: Folder of `dvc.yaml`, which the workers see under the same name.
        tasks: Task runner.
        force: Whether the stage runs in any case.

    Returns:
        How many were made.

    Raises:
        InputError: Bad parameters or trees.
    """
    if not force and not _would_run(root):
        return 0
    missing = missing_shards(Layout(root.resolve()))
    get_run_logger().info("%d shards of %s are missing", len(missing), STAGE)
    return make_shards.with_options(task_runner=tasks)(missing) if missing else 0


def missing_shards(layout: Layout) -> list[Shard]:
    """Shards of the stage that no earlier run has made with the same code, parameters and trees.

    Raises:
        InputError: Bad parameters or trees.
    """
    params = load_params(layout.root / "params.yaml")
    motions = read_motions(layout.trees, params.robot.robot().joint_count)
    shards = planned_shards(params.robot, params.simulate_motions, motions, layout.scratch_dir / STAGE)
    return [shard for shard in shards if not shard.is_made]


def _would_run(root: Path) -> bool:
    """Whether DVC finds the stage out of date."""
    words = [sys.executable, "-m", "dvc", "status", "--json", STAGE]
    done = subprocess.run(words, cwd=root, capture_output=True, text=True, check=False)
    return done.returncode != 0 or json.loads(done.stdout.strip() or "{}") != {}
