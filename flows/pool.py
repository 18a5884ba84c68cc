"""The work pool of the desk: `python -m flows.pool NAME`.

`prefect work-pool create` has the server fetch a list of all kinds of pools from elsewhere; this one needs none.
"""

from __future__ import annotations

import argparse

from prefect.client.orchestration import get_client
from prefect.client.schemas.actions import WorkPoolCreate
from prefect.workers.process import ProcessWorker


def make_pool(name: str) -> None:
    """Make a work pool whose runs are processes of this machine, or bring it up to date.

    Args:
        name: Its name.
    """
    template = ProcessWorker.get_default_base_job_template()
    with get_client(sync_client=True) as client:
        client.create_work_pool(WorkPoolCreate(name=name, type="process", base_job_template=template), overwrite=True)


def main() -> None:
    """Make a pool."""
    parser = argparse.ArgumentParser(prog="python -m flows.pool", description=__doc__.splitlines()[0])
    parser.add_argument("name", help="name of the work pool")
    make_pool(parser.parse_args().name)


if __name__ == "__main__":
    main()
