"""Runs whose process is gone: closed, so that pages tell the truth and the slot of their deployment is free.

A worker closes the runs of processes that end while it and the server live. What was cut off together with the worker,
by a kill or a switched-off machine, or ended while no server could be told, would count as running until leases and
heartbeats run out.
"""

from __future__ import annotations

import socket

import psutil
from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import FlowRunFilter, WorkPoolFilter
from prefect.client.schemas.objects import FlowRun, State, StateType
from prefect.states import Crashed

OPEN = [StateType.PENDING, StateType.RUNNING, StateType.CANCELLING]


def close_lost_runs(pool: str, worker_runs: bool = False) -> list[str]:
    """Set the runs of a work pool of this machine to crashed that have no process.

    Args:
        pool: Name of the work pool.
        worker_runs: Whether a worker of the pool runs. Then a run that it has just taken has no process for a moment,
            so that only those are closed that ran in a process which is noted.

    Returns:
        Names of the runs.
    """
    closed = []
    with get_client(sync_client=True) as client:
        kinds = [StateType.RUNNING] if worker_runs else OPEN
        wanted = FlowRunFilter.model_validate({"state": {"type": {"any_": kinds}}})
        of_pool = WorkPoolFilter.model_validate({"name": {"any_": [pool]}})
        found = client.read_flow_runs(flow_run_filter=wanted, work_pool_filter=of_pool)
        runs = [*found, *_children(client, found)]
        for run in runs:
            if not _has_process(run) and (run.infrastructure_pid or not worker_runs):
                state: State[None] = Crashed(message="The process of this run was gone at the next look.")
                client.set_flow_run_state(run.id, state, force=True)
                closed.append(str(run.name))
    return closed


def _children(client: object, runs: list[FlowRun]) -> list[FlowRun]:
    """Open runs of flows that these runs called; they are in no pool."""
    found: list[FlowRun] = []
    for run in runs:
        wanted = FlowRunFilter.model_validate(
            {"state": {"type": {"any_": OPEN}}, "parent_flow_run_id": {"any_": [run.id]}}
        )
        below = client.read_flow_runs(flow_run_filter=wanted)  # type: ignore[attr-defined]
        for child in below:
            child.infrastructure_pid = run.infrastructure_pid
        found += [*below, *_children(client, below)]
    return found


def _has_process(run: FlowRun) -> bool:
    """Whether the process that executes a run lives here, or is another machine's."""
    host, _, pid = (run.infrastructure_pid or "").rpartition(":")
    if host and host != socket.gethostname():
        return True
    if not pid.isdigit() or not psutil.pid_exists(int(pid)):
        return False
    try:
        process = psutil.Process(int(pid))
        began = run.start_time.timestamp() if run.start_time else process.create_time()
        return bool(process.status() != psutil.STATUS_ZOMBIE and process.create_time() <= began + 60.0)
    except psutil.Error:
        return False
