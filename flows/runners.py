"""Where tasks run: on processes or threads here, or on a Dask or Ray cluster, chosen by name."""

from __future__ import annotations

import argparse
import os
from importlib import import_module
from typing import Any

from prefect.task_runners import ProcessPoolTaskRunner, TaskRunner, ThreadPoolTaskRunner

from reproduction.pools import end_with_parent
from robojoule.errors import InputError

CLUSTERS = {"dask": ("prefect_dask", "DaskTaskRunner"), "ray": ("prefect_ray", "RayTaskRunner")}
RUNNERS = ("processes", "threads", *CLUSTERS)


def task_runner(name: str, workers: int = 1, address: str | None = None) -> TaskRunner[Any]:
    """A task runner of Prefect by its name.

    Args:
        name: One of `RUNNERS`.
        workers: Number of processes or threads here; a cluster has its own.
        address: Address of a Dask or Ray cluster; a temporary one on this machine if not given.

    Raises:
        InputError: Unknown name, no worker, an address without a cluster, or a package that is not installed.
    """
    if workers < 1:
        raise InputError(f"{workers} is not a number of workers", key="workers", allowed="1 or more")
    if name not in RUNNERS:
        raise InputError(f"unknown task runner '{name}'", key="runner", allowed=", ".join(RUNNERS))
    if name in CLUSTERS:
        package, kind = CLUSTERS[name]
        try:
            runner = getattr(import_module(package), kind)
        except ImportError:
            wanted = package.replace("_", "-")
            raise InputError(
                f"the task runner '{name}' needs the package {wanted}, which is not installed",
                key="runner",
                allowed=f"{', '.join(RUNNERS[:2])}, or any after `pip install 'robojoule[{name}]'`",
            ) from None
        return runner(address=address)  # type: ignore[no-any-return]
    if address is not None:
        raise InputError(f"the task runner '{name}' works on this machine", key="address", allowed="dask or ray")
    if name == "threads":
        return ThreadPoolTaskRunner(max_workers=workers)
    return ProcessPoolTaskRunner(max_workers=workers, initializer=end_with_parent, initargs=(os.getpid(),))


def add_runner(parser: argparse.ArgumentParser, default: str | None) -> None:
    """Add the choice of a task runner to a command."""
    said = "the stage's own processes" if default is None else default
    parser.add_argument("--runner", default=default, help=f"task runner: {', '.join(RUNNERS)} (default: {said})")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes or threads")
    parser.add_argument("--address", help="address of a Dask or Ray cluster")
