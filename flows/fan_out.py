"""The parts of a stage on a task runner, such as a cluster.

A stage that is cut into parts has a function `compute`, which takes an executor and keeps what it computes where the
stage looks for it (`reproduction.parts`). Here it gets one of Prefect's task runners; then DVC runs the stage, which
finds its parts and writes its outputs. It knows nothing of Prefect, and the bytes are the same.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from prefect import flow
from prefect.task_runners import TaskRunner
from threadpoolctl import threadpool_limits

from flows import lifeline
from flows.executor import TaskExecutor
from reproduction.config import load_params
from reproduction.layout import Layout
from reproduction.study.config import load_study_params

# Stages that are cut, and how each reads its parameters.
PIPELINE = dict.fromkeys(("simulate_motions", "evaluate_plans"), ("params.yaml", load_params))
STUDIES = dict.fromkeys(
    ("compare_predictors", "evaluate_motions", "evaluate_robots", "close_the_loop", "plan_cells"),
    ("studies/params.yaml", load_study_params),
)
FANNED: dict[str, tuple[str, Callable[[Path], Any]]] = {**PIPELINE, **STUDIES}


@flow(name="fan-out", persist_result=False)
def compute_parts(stage: str, root: Path) -> None:
    """Compute the parts of a stage on this flow's task runner.

    Args:
        stage: One of `FANNED`.
        root: Folder of `dvc.yaml`; of all that workers write nothing but the shards of `simulate_motions` is in it.

    Raises:
        InputError: Bad parameters, or inputs that are missing.
    """
    file, load = FANNED[stage]
    compute = import_module(f"stages.{stage}").compute
    with threadpool_limits(1):  # also holds while threads end one after another
        compute(load(root / file), Layout(root), TaskExecutor())


def fan_out(stage: str, target: str, root: Path, tasks: TaskRunner[Any], force: bool = False) -> bool:
    """Compute the parts of a stage, if it is cut into parts and would run.

    Args:
        stage: Its name.
        target: Its name for DVC, with its file.
        root: Folder of `dvc.yaml`.
        tasks: Task runner.
        force: Whether the stage runs in any case.

    Returns:
        Whether it did.
    """
    if stage not in FANNED or not (force or Look(root, [target]).outdated()):
        return False
    compute_parts.with_options(name=f"fan-out-{stage}", task_runner=tasks)(stage, root.resolve())
    return True


class Look:
    """DVC's look at some stages, on its way: it takes seconds, in which other things can be done.

    Args:
        root: Folder of `dvc.yaml`.
        targets: The stages, named as DVC takes them.
    """

    def __init__(self, root: Path, targets: Sequence[str]) -> None:
        self._targets = targets
        words = [sys.executable, "-m", "dvc", "status", "--json", *targets]
        self._process = subprocess.Popen(
            [sys.executable, str(Path(lifeline.__file__)), *words],
            cwd=root,
            stdin=subprocess.PIPE,  # held open: when this process is gone, DVC ends
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            process_group=0,
        )

    def outdated(self) -> set[str]:
        """Those that DVC finds out of date; all where it fails: so will they."""
        assert self._process.stdout is not None
        said = self._process.stdout.read()
        if self._process.wait() != 0:
            return set(self._targets)
        found = json.loads(said.strip() or "{}")
        return {target for target in self._targets if target in found}

    def end(self) -> None:
        """End it, where nobody asked for what it finds."""
        lifeline.cut(self._process)
