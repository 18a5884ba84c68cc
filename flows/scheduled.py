"""What runs by itself: the whole pipeline every night, held against the committed results, and what people ask for.

Both work in clones of the last commit, so that the project's folder stays as it is and runs do not meet in it. They
take the pipeline's function, not its flow: a run below another one would stay open when both are killed.
"""

from __future__ import annotations

import json
import os
import shutil
import urllib.request
from datetime import UTC, datetime
from pathlib import Path

import yaml
from prefect import flow, runtime
from prefect.artifacts import create_markdown_artifact

from flows.clone import scratch_clone
from flows.pipeline import STAGE_TIMEOUT_S, pipeline
from reproduction.compare import compare_results
from reproduction.config import load_params
from reproduction.layout import Layout
from reproduction.tracking.store import trial
from robojoule.documents import read_document, write_text
from robojoule.errors import RobojouleError

KEPT = ("reports", "models", "params.yaml", "dvc.lock")


class Drift(RobojouleError):
    """Results that are made again differ from the committed ones."""


@flow(name="pipeline-nightly", persist_result=False)
def nightly(
    root: Path = Path(),
    stage_timeout_s: float = STAGE_TIMEOUT_S,
    runner: str | None = None,
    workers: int = 2,
    address: str | None = None,
) -> list[str]:
    """Run every stage of the last commit, and hold lock file, tables and metrics against the committed ones.

    Args:
        root: Folder of the project.
        stage_timeout_s: Longest time of one stage. [s]
        runner: Task runner for the simulation; see `pipeline`.
        workers: Number of processes or threads here.
        address: Address of a cluster.

    Returns:
        An empty list, as nothing differs.

    Raises:
        Drift: Something differs; the artifact `drift` names it.
        StageFailed: A stage ended with an error.
        InputError: There is no commit to clone.
    """
    with scratch_clone(root) as clone:
        pipeline.fn(clone, force=True, stage_timeout_s=stage_timeout_s, runner=runner, workers=workers, address=address)
        lines, beyond = compare_results(clone)
    said = "\n".join(f"    {line}" for line in lines) or "Every output, table and metric has the committed bytes."
    create_markdown_artifact(key="drift", markdown=said, description="Results of this night against the committed ones")
    if lines:
        kind = "by more than rounding" if beyond else "in their last digits"
        raise Drift(f"{len(lines)} results differ from the committed ones {kind}, first {lines[0].strip()}")
    return lines


@flow(name="alert", persist_result=False)
def alert(run: str, flow_name: str, state: str, message: str, root: Path = Path()) -> None:
    """Tell that a run failed: a line of `.desk/alerts.jsonl`, and a request to `ROBOJOULE_ALERT_URL` where that is set.

    Args:
        run: Name of the run.
        flow_name: Name of its flow.
        state: How it ended.
        message: Why, in one sentence.
        root: Folder of the project.
    """
    time = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
    line = json.dumps({"time": time, "flow": flow_name, "run": run, "state": state, "message": message})
    with (Layout(root.resolve()).desk_dir / "alerts.jsonl").open("a", encoding="utf-8") as file:
        file.write(line + "\n")
    if url := os.environ.get("ROBOJOULE_ALERT_URL"):
        request = urllib.request.Request(url, line.encode(), {"content-type": "application/json"}, method="POST")
        with urllib.request.urlopen(request, timeout=30):
            pass


def keep_results(clone: Path, results: Path) -> None:
    """Copy what a run made; the folder appears when it is complete."""
    copying = results.with_name(f".{results.name}")
    shutil.rmtree(copying, ignore_errors=True)  # of one that was killed
    copying.mkdir(parents=True)
    for name in KEPT:
        copy = shutil.copytree if (clone / name).is_dir() else shutil.copy
        copy(clone / name, copying / name)
    copying.rename(results)


@flow(name="pipeline-on-demand", persist_result=False)
def on_demand(
    robot: str | None = None,
    payload_kg: float | None = None,
    trees: int | None = None,
    seed: int | None = None,
    runner: str | None = None,
    workers: int = 2,
    address: str | None = None,
    stage_timeout_s: float = STAGE_TIMEOUT_S,
    root: Path = Path(),
) -> str:
    """Run the pipeline of the last commit with other parameters; what is not given is that of `params.yaml`.

    Its trainings are recorded and registered, but the registry's champions stay what they are.

    Args:
        robot: Name in the catalog.
        payload_kg: Payload, up to the rated one. [kg]
        trees: Number of trees for training and test.
        seed: Of the trees.
        runner: Task runner for the simulation; see `pipeline`.
        workers: Number of processes or threads here.
        address: Address of a cluster.
        stage_timeout_s: Longest time of one stage. [s]
        root: Folder of the project.

    Returns:
        Folder of the results: reports, models, parameters and lock file.

    Raises:
        InputError: A parameter is out of range.
        StageFailed: A stage ended with an error.
    """
    with scratch_clone(root) as clone:
        file = clone / "params.yaml"
        params = read_document(file)
        for section, key, value in (
            ("robot", "name", robot),
            ("robot", "payload_kg", payload_kg),
            ("generate_trees", "trees", trees),
            ("generate_trees", "seed", seed),
        ):
            if value is not None:
                params[section][key] = value
        write_text(file, yaml.safe_dump(params, sort_keys=False))
        load_params(file)  # refused before anything runs
        with trial(str(runtime.flow_run.name)):
            pipeline.fn(clone, stage_timeout_s=stage_timeout_s, runner=runner, workers=workers, address=address)
        results = Layout(root.resolve()).desk_dir / "results" / str(runtime.flow_run.name)
        keep_results(clone, results)
        metrics = read_document(results / "reports/headline.json")
    lines = "\n".join(f"| {name} | {value:g} |" for name, value in metrics.items())
    create_markdown_artifact(
        key="on-demand",
        markdown=f"| figure | |\n|---|---|\n{lines}\n\nReport, tables and models: `{results}`",
        description="Figures of a run that was asked for",
    )
    return str(results)
