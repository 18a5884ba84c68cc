"""The studies as a Prefect flow: robots, payloads, folds, hidden machines and cells on a task runner.

As in `flows.pipeline`, DVC decides what is out of date and keeps the results.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from prefect import flow

from flows.command import told
from flows.pipeline import reproduce, stage_names
from flows.runners import add_runner, task_runner
from flows.server import prefect_server
from reproduction.layout import Layout
from robojoule.errors import InputError

FILE = "studies/dvc.yaml"
STAGE_TIMEOUT_S = 4 * 3600.0


@flow(name="studies", persist_result=False, validate_parameters=True)
def studies(
    root: Path = Path(),
    stages: list[str] | None = None,
    force: bool = False,
    stage_timeout_s: float = STAGE_TIMEOUT_S,
    runner: str | None = None,
    workers: int = 2,
    address: str | None = None,
) -> dict[str, str]:
    """Bring studies up to date.

    Args:
        root: Folder of `dvc.yaml`.
        stages: Which of `studies/dvc.yaml`; all if not given.
        force: Run them even if nothing changed.
        stage_timeout_s: Longest time of one. [s]
        runner: Task runner on which their parts are computed: processes, threads, dask or ray; the stages compute them
            themselves if not given.
        workers: Number of processes or threads here.
        address: Address of a Dask or Ray cluster.

    Returns:
        Stage -> "ran" or "unchanged".

    Raises:
        StageFailed: A stage ended with an error, also on its second try.
        InputError: Unknown stage, bad runner, or bad parameters.
    """
    tasks = None if runner is None else task_runner(runner, workers, address)
    targets = [f"{FILE}:{name}" for name in _chosen(root, stages)]
    return reproduce(targets, root, force, stage_timeout_s, tasks)


def _chosen(root: Path, stages: list[str] | None) -> list[str]:
    names = stage_names(root, FILE)
    for name in stages or []:
        if name not in names:
            raise InputError(f"unknown study '{name}'", key="stages", allowed=", ".join(names))
    return [name for name in names if not stages or name in stages]


def main() -> None:
    """Run studies once from the command line."""
    parser = argparse.ArgumentParser(prog="python -m flows.studies", description="The studies as a Prefect flow.")
    parser.add_argument("stages", nargs="*", metavar="STAGE", help="of studies/dvc.yaml (default: all)")
    parser.add_argument("--root", type=Path, default=Path(), help="folder of dvc.yaml (default: .)")
    parser.add_argument("--force", action="store_true", help="run them even if nothing changed")
    add_runner(parser, None)
    arguments = parser.parse_args()
    with told("flows.studies"):
        _chosen(arguments.root, arguments.stages)
        if arguments.runner is not None:
            task_runner(arguments.runner, arguments.workers, arguments.address)  # both: before a server is started
        with prefect_server(Layout(arguments.root)):
            studies(
                arguments.root,
                arguments.stages,
                force=arguments.force,
                runner=arguments.runner,
                workers=arguments.workers,
                address=arguments.address,
            )


if __name__ == "__main__":
    main()
