"""The pipeline as a Prefect flow.

DVC decides what is out of date and keeps the results; Prefect brings schedule, retries, timeouts and artifacts; MLflow
keeps the record of each training. Prefect therefore caches and persists nothing: a stage that DVC finds unchanged is
not started.
"""

from __future__ import annotations

import argparse
import csv
import os
import queue
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from prefect import flow, get_run_logger, task
from prefect.artifacts import (
    create_markdown_artifact,
    create_progress_artifact,
    create_table_artifact,
    update_progress_artifact,
)
from prefect.cache_policies import NO_CACHE
from prefect.task_runners import TaskRunner

from flows import lifeline
from flows.command import told
from flows.dvc_lock import mend_locks
from flows.fan_out import Look, fan_out
from flows.runners import add_runner, task_runner
from flows.server import prefect_server
from reproduction.layout import Layout
from reproduction.predictors.estimators import MODELS
from reproduction.profile_predictor.training import MODEL
from reproduction.settings import address
from reproduction.tracking.store import data_hash, find_run
from robojoule.documents import read_document
from robojoule.errors import InputError, RobojouleError

STAGE_TIMEOUT_S = 1800.0
MLFLOW_UI = address("mlflow")
BAD_INPUT = re.compile(r"exited with 2\b")  # what DVC says of a stage that refused its input


class StageFailed(RobojouleError):
    """A stage ended with an error.

    Args:
        stage: Name of the stage.
        bad_input: Whether the stage refused its input; then a second try would end alike.
        output: Lines that it printed; the message is the stage's own sentence among them.
    """

    def __init__(self, stage: str, bad_input: bool, output: list[str]) -> None:
        self.stage = stage
        self.bad_input = bad_input
        self.output = output
        super().__init__(_sentence(stage, output))


def _sentence(stage: str, output: list[str]) -> str:
    """Why a stage failed: the last line that begins with its name, or else the last that is not DVC's own."""
    own = [line for line in output if line.startswith(f"{stage}: ")]
    others = [line for line in output if not line.startswith(("ERROR: failed to reproduce", "Running stage", "> "))]
    if own and any("failed to reproduce" in line for line in output):
        return own[-1]
    return f"{stage}: {others[-1].removeprefix('ERROR: ') if others else 'ended without output'}"


def stage_names(root: Path, file: str = "dvc.yaml") -> list[str]:
    """Names of the stages of a file, in its order.

    Raises:
        InputError: There is no such file, or it names no stages.
    """
    found = read_document(root / file)
    stages = found.get("stages") if isinstance(found, dict) else None
    if not isinstance(stages, dict):
        raise InputError("there are no stages in it", file=root / file, allowed="the file of a pipeline of DVC")
    return [str(name) for name in stages]


def _output_lines(process: subprocess.Popen[str]) -> Iterator[str]:
    """Yield the lines of a process as they come.

    Reading goes through a queue with a timeout, as an exception that Prefect raises in this thread (timeout,
    cancellation) is seen between two Python steps only, never inside a blocked read.
    """
    lines: queue.Queue[str | None] = queue.Queue()

    def read() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.put(line.rstrip())
        lines.put(None)

    threading.Thread(target=read, daemon=True).start()
    while True:
        try:
            line = lines.get(timeout=0.5)
        except queue.Empty:
            continue
        if line is None:
            return
        if line:
            yield line


def _worth_a_retry(_task: Any, _run: Any, state: Any) -> bool:
    """Retry after a fault of the machine, never after bad input or a timeout, which would come again."""
    error = state.result(raise_on_failure=False)
    return not (isinstance(error, TimeoutError) or (isinstance(error, StageFailed) and error.bad_input))


@task(
    retries=1,
    retry_delay_seconds=5,
    retry_condition_fn=_worth_a_retry,
    timeout_seconds=STAGE_TIMEOUT_S,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def reproduce_stage(target: str, root: Path, force: bool = False) -> str:
    """Bring one stage up to date with `dvc repro --single-item`.

    Args:
        target: Name of the stage, with its file if that is not `dvc.yaml`: `studies/dvc.yaml:NAME`.
        root: Folder of `dvc.yaml`.
        force: Run it even if nothing changed.

    Returns:
        "ran" or "unchanged".

    Raises:
        StageFailed: The stage or DVC ended with an error.
        TimeoutError: It took longer than this task may.
    """
    logger = get_run_logger()
    # The stage's command says `python`: that is the interpreter which runs this flow.
    paths = [str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)]
    command = [sys.executable, "-m", "dvc", "repro", "--single-item", *(["--force"] if force else []), target]
    process = subprocess.Popen(
        [sys.executable, str(Path(lifeline.__file__)), *command],
        cwd=root,
        stdin=subprocess.PIPE,  # held open: when this process is gone, the stage ends
        env={**os.environ, "PATH": os.pathsep.join(paths), "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="replace",
        start_new_session=True,
    )
    output: list[str] = []
    try:
        for line in _output_lines(process):
            output.append(line)
            logger.info(line)
        code = process.wait()
    finally:
        # After a timeout or a cancellation neither DVC nor the stage below it may live on.
        lifeline.cut(process)
    if code != 0:
        stage = target.rpartition(":")[2]
        raise StageFailed(stage, bad_input=any(BAD_INPUT.search(line) for line in output), output=output)
    return "ran" if any(line.startswith("Running stage") for line in output) else "unchanged"


@task(cache_policy=NO_CACHE, persist_result=False)
def publish_table(root: Path) -> int:
    """Show Table 6.1 as an artifact.

    Returns:
        Number of rows.
    """
    with (Layout(root).tables_dir / "table_6_1.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    trees = sorted({row["trees"] for row in rows if row.get("trees")}, key=float)
    counted = f", {' to '.join(trees)} trees" if trees else ""
    create_table_artifact(
        key="table-6-1", table=rows, description=f"Table 6.1: energy saved at equal cycle time (Eq. 6.1){counted}"
    )
    return len(rows)


@task(cache_policy=NO_CACHE, persist_result=False)
def publish_training_runs(root: Path, mlflow_ui: str = MLFLOW_UI) -> list[str]:
    """Link the newest MLflow run of each model on this data, though the training may lie long back.

    Args:
        root: Folder of `dvc.yaml`.
        mlflow_ui: Address at which MLflow's server will listen.

    Returns:
        Ids of the runs.
    """
    layout = Layout(root)
    data = data_hash(layout.features)
    try:
        runs = [run for model in (*MODELS, MODEL) if (run := find_run(layout, model, data))]
        lines = [f"- [{run.model}]({mlflow_ui}{run.page}), commit `{run.git_commit}`" for run in runs]
    except InputError as error:  # the results are there all the same
        runs, lines = [], [f"They cannot be looked up: {error}"]
    text = "\n".join(
        [
            f"Training runs on features with MD5 `{data}`:",
            "",
            *(lines or ["None in this folder's store: the predictors came out of DVC's cache."]),
            "",
            "`make up` opens the store.",
        ]
    )
    create_markdown_artifact(key="training-runs", markdown=text, description="MLflow runs of the predictors in use")
    return [run.run_id for run in runs]


def reproduce(
    targets: list[str],
    root: Path,
    force: bool,
    stage_timeout_s: float,
    tasks: TaskRunner[Any] | None,
    outdated: list[str] | None = None,
) -> dict[str, str]:
    """Bring stages up to date, one after another, and publish progress; see `pipeline`.

    Args:
        targets: Their names for DVC.
        root: Folder of `dvc.yaml`.
        force: Run every stage even if nothing changed.
        stage_timeout_s: Longest time of one stage. [s]
        tasks: Task runner on which parts are computed; the stages compute theirs themselves if not given.
        outdated: Those of the targets that are known to be out of date; DVC is asked if not given.

    Raises:
        StageFailed: A stage ended with an error, also on its second try, or took too long.
    """
    progress: Any = create_progress_artifact(key="stages", progress=0.0, description=f"0 of {len(targets)} stages")
    mend_locks(root)
    # One look at all costs as much as one at a single stage. After a stage that ran, each is looked at anew.
    if outdated is None:
        outdated = targets if force else sorted(Look(root, targets).outdated())
    outcome: dict[str, str] = {}
    for done, target in enumerate(targets, start=1):
        name = target.rpartition(":")[2]
        if "ran" not in outcome.values() and target not in outdated:
            outcome[name] = "unchanged"
            continue
        if tasks is not None:
            fan_out(name, target, root, tasks, force)
        stage = reproduce_stage.with_options(name=name, timeout_seconds=stage_timeout_s)
        try:
            outcome[name] = stage(target, root, force)
        except TimeoutError:
            # Prefect would give the run a state of its own for that, without a word on the stage.
            raise StageFailed(name, bad_input=False, output=[f"took longer than {stage_timeout_s:g} s"]) from None
        update_progress_artifact(
            progress,
            progress=100.0 * done / len(targets),
            description=f"{done} of {len(targets)} stages: {name} {outcome[name]}",
        )
    if "ran" not in outcome.values():
        update_progress_artifact(progress, progress=100.0, description=f"all {len(targets)} stages are up to date")
    return outcome


@flow(name="pipeline", persist_result=False, validate_parameters=True)
def pipeline(
    root: Path = Path(),
    force: bool = False,
    stage_timeout_s: float = STAGE_TIMEOUT_S,
    mlflow_ui: str = MLFLOW_UI,
    runner: str | None = None,
    workers: int = 2,
    address: str | None = None,
    outdated: list[str] | None = None,
) -> dict[str, str]:
    """Bring all stages up to date and publish progress, Table 6.1 and the training runs.

    Args:
        root: Folder of `dvc.yaml`.
        force: Run every stage even if nothing changed.
        stage_timeout_s: Longest time of one stage. [s]
        mlflow_ui: Address at which MLflow's server will listen, for the links.
        runner: Task runner on which the parts of `simulate_motions` and `evaluate_plans` are computed: processes,
            threads, dask or ray. The stages compute them themselves if not given.
        workers: Number of processes or threads here.
        address: Address of a Dask or Ray cluster that sees this folder.
        outdated: Stages that are known to be out of date; DVC is asked if not given.

    Returns:
        Stage -> "ran" or "unchanged".

    Raises:
        StageFailed: A stage ended with an error, also on its second try.
        InputError: Bad runner, or bad parameters.
    """
    tasks = None if runner is None else task_runner(runner, workers, address)
    outcome = reproduce(stage_names(root), root, force, stage_timeout_s, tasks, outdated)
    publish_table(root)
    publish_training_runs(root, mlflow_ui)
    return outcome


def main() -> None:
    """Run the flow once from the command line."""
    parser = argparse.ArgumentParser(prog="python -m flows.pipeline", description="The pipeline as a Prefect flow.")
    parser.add_argument("--root", type=Path, default=Path(), help="folder of dvc.yaml (default: .)")
    parser.add_argument("--force", action="store_true", help="run every stage even if nothing changed")
    add_runner(parser, None)
    arguments = parser.parse_args()
    root = arguments.root
    with told("flows.pipeline"):
        names = stage_names(root)
        if arguments.runner is not None:
            task_runner(arguments.runner, arguments.workers, arguments.address)  # both: before a server is started
        mend_locks(root)
        look = None if arguments.force else Look(root, names)  # while the server starts
        try:
            with prefect_server(Layout(root)):
                pipeline(
                    root,
                    force=arguments.force,
                    runner=arguments.runner,
                    workers=arguments.workers,
                    address=arguments.address,
                    outdated=None if look is None else sorted(look.outdated()),
                )
        finally:
            if look is not None:
                look.end()


if __name__ == "__main__":
    main()
