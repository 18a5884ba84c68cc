"""The work pool of the desk, made and without lost runs: `python -m flows.pool NAME`.

Both by one command, as half of the time of either is that of loading Prefect.

`prefect work-pool create` has the server fetch a list of all kinds of pools from elsewhere; this one needs none.
"""

from __future__ import annotations

import argparse

from prefect.client.orchestration import get_client
from prefect.client.schemas.actions import WorkPoolCreate
from prefect.workers.process import ProcessWorker

from flows.lost import close_lost_runs


def make_pool(name: str) -> None:
    """Make a work pool whose runs are processes of this machine, or bring it up to date.

    Args:
        name: Its name.
    """
    template = ProcessWorker.get_default_base_job_template()
    with get_client(sync_client=True) as client:
        client.create_work_pool(WorkPoolCreate(name=name, type="process", base_job_template=template), overwrite=True)


def main() -> None:
    """Make a pool and close its lost runs."""
    parser = argparse.ArgumentParser(prog="python -m flows.pool", description=__doc__.splitlines()[0])
    parser.add_argument("name", help="name of the work pool")
    parser.add_argument("--worker-runs", action="store_true", help="a worker of the pool runs")
    arguments = parser.parse_args()
    make_pool(arguments.name)
    for run in close_lost_runs(arguments.name, arguments.worker_runs):
        print(f"closed the run {run}, whose process is gone")


if __name__ == "__main__":
    main()
