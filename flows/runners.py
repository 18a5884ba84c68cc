"""Where tasks run: on processes or threads here, or on a Dask or Ray cluster, chosen by name."""

from __future__ import annotations

import argparse
import os
import re
import socket
from collections.abc import Sequence
from importlib import import_module
from typing import Any
from urllib.parse import urlsplit

from prefect.task_runners import ProcessPoolTaskRunner, TaskRunner, ThreadPoolTaskRunner

from reproduction.pools import end_with_parent
from robojoule.errors import InputError, RobojouleError
from robojoule.inputs import shown

CLUSTERS = {"dask": ("prefect_dask", "DaskTaskRunner"), "ray": ("prefect_ray", "RayTaskRunner")}
RUNNERS = ("processes", "threads", *CLUSTERS)
SCHEMES = {"dask": ("", "tcp", "tls", "ws", "wss", "ucx"), "ray": ("", "ray")}
EXAMPLES = {"dask": "such as tcp://127.0.0.1:8786", "ray": "such as 127.0.0.1:6379 or ray://127.0.0.1:10001, or auto"}

_RAY_FINDS = ("auto", "local")  # words by which Ray finds or makes a cluster
_PATIENCE_S = 10.0


def task_runner(name: str, workers: int = 1, address: str | None = None) -> TaskRunner[Any]:
    """A task runner of Prefect by its name.

    Args:
        name: One of `RUNNERS`.
        workers: Number of processes or threads here; a cluster has its own.
        address: Address of a Dask or Ray cluster; a temporary one on this machine if not given.

    Raises:
        InputError: Unknown name, no worker, an address that is none or of no cluster, or a package that is not
            installed.
        RobojouleError: Nothing answers at the address.
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
        if address is not None:
            _reach(name, address)
        return runner(address=address)  # type: ignore[no-any-return]
    if address is not None:
        raise InputError(f"the task runner '{name}' works on this machine", key="address", allowed="dask or ray")
    if name == "threads":
        return ThreadPoolTaskRunner(max_workers=workers)
    return ProcessPoolTaskRunner(max_workers=workers, initializer=end_with_parent, initargs=(os.getpid(),))


def _reach(name: str, address: str) -> None:
    """Make sure that something listens at the address of a cluster; its own library would try for long, and say much.

    Raises:
        InputError: It is not the address of such a cluster.
        RobojouleError: Nothing answers.
    """
    if name == "ray" and address in _RAY_FINDS:
        return
    place = _place(address, SCHEMES[name])
    if place is None:
        problem = f"{shown(address)} is not the address of a {name.title()} cluster"
        raise InputError(problem, key="address", allowed=EXAMPLES[name])
    try:
        socket.create_connection(place, timeout=_PATIENCE_S).close()
    except OSError:
        raise RobojouleError(f"no {name.title()} cluster answers at {address}") from None


def _place(address: str, schemes: Sequence[str]) -> tuple[str, int] | None:
    """Host and port that an address names; None if it is not SCHEME://HOST:PORT with one of some schemes, or more."""
    scheme, mark, rest = address.rpartition("://")
    if scheme not in schemes or (mark and not scheme) or not re.fullmatch(r"[^\s\x00-\x1f/?#@\\]+", rest):
        return None
    try:
        parts = urlsplit(f"//{rest}")
        host, port = parts.hostname, parts.port
        (host or "").encode("idna")  # as the search for a host does, for which labels may be too long
    except ValueError:  # also a port that is not a number
        return None
    return (host, port) if host and port else None


def add_runner(parser: argparse.ArgumentParser, default: str | None) -> None:
    """Add the choice of a task runner to a command."""
    said = "the stage's own processes" if default is None else default
    parser.add_argument("--runner", default=default, help=f"task runner: {', '.join(RUNNERS)} (default: {said})")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes or threads")
    parser.add_argument("--address", help="address of a Dask or Ray cluster")
