"""Deployments for real: server, worker, a scheduled night, a failing run and its alert, kills, and systemd's units."""

import configparser
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest

from flows.service import answers
from tests.conftest import ROOT, Background, run, wait_for
from tests.flows.test_desk import desk, ports, processes  # noqa: F401  ports is a fixture
from tests.screens import LARGEST_BYTES, take_mlflow, take_prefect
from tests.servers import artifacts, ask

PATIENCE_S = 900.0  # for conditions, not a measure of anything: machines may be slow


@pytest.fixture
def project(reproduced: Path, tmp_path: Path, ports: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:  # noqa: F811
    """A copy of the reproduced project with its results committed, and the desk's addresses in the environment."""
    monkeypatch.setenv("PREFECT_WORKER_QUERY_SECONDS", "2")
    folder = tmp_path / "project"
    shutil.copytree(reproduced, folder, symlinks=True, ignore=shutil.ignore_patterns(".desk"))
    run("git", "add", "-A", cwd=folder)
    run("git", "-c", "user.name=toy", "-c", "user.email=toy@example.org", "commit", "-qm", "Results", cwd=folder)
    yield folder
    desk(folder, "down")


class Runs:
    """Runs on the desk's server."""

    def __init__(self, port: str) -> None:
        self.api = f"http://127.0.0.1:{port}/api"

    def start(self, deployment: str, at: str | None = None, **parameters: Any) -> str:
        """Ask for a run, now or at a time; returns its id."""
        (found,) = (one for one in ask(self.api, "deployments/filter", {}) if one["name"] == deployment)
        wanted: dict[str, Any] = {"parameters": parameters}
        if at is not None:
            wanted["state"] = {"type": "SCHEDULED", "state_details": {"scheduled_time": at}}
        return str(ask(self.api, f"deployments/{found['id']}/create_flow_run", wanted)["id"])

    def start_by_command(self, project: Path, deployment: str, *words: str) -> str:
        """Ask for a run as a user does; returns its id."""
        command = ["prefect", "deployment", "run", deployment, *words]
        said = run("env", f"PREFECT_API_URL={self.api}", *command, cwd=project).stdout
        return next(word for word in said.replace("/", " ").split() if word.count("-") == 4 and len(word) == 36)

    def get(self, identifier: str) -> dict[str, Any]:
        (found,) = ask(self.api, "flow_runs/filter", {"flow_runs": {"id": {"any_": [identifier]}}})
        return found

    def open(self) -> list[dict[str, Any]]:
        kinds = ["RUNNING", "PENDING", "CANCELLING"]
        return ask(self.api, "flow_runs/filter", {"flow_runs": {"state": {"type": {"any_": kinds}}}})

    def wait(self, identifier: str, *kinds: str) -> dict[str, Any]:
        wait_for(f"{' or '.join(kinds)}", lambda: self.get(identifier)["state"]["type"] in kinds, PATIENCE_S)
        return self.get(identifier)

    def scheduled(self) -> list[dict[str, Any]]:
        ended = {"state": {"type": {"any_": ["COMPLETED", "FAILED", "CRASHED"]}}}
        return [one for one in ask(self.api, "flow_runs/filter", {"flow_runs": ended}) if one["auto_scheduled"]]


def below(project: Path) -> list[psutil.Process]:
    """Processes that work in clones of the project."""
    found = []
    for process in psutil.process_iter():
        try:
            if str(project / ".desk/clones") in process.cwd():
                found.append(process)
        except (psutil.Error, OSError):
            continue
    return found


def test_nights_failures_and_kills(project: Path, ports: dict[str, str], tmp_path: Path):  # noqa: F811
    runs = Runs(ports["PREFECT_SERVER_API_PORT"])
    desk(project, "up")
    for deployment in ask(runs.api, "deployments/filter", {}):
        (step,) = deployment["pull_steps"]
        assert step["prefect.deployments.steps.set_working_directory"]["directory"] == str(project)

    # A night by its schedule: every stage runs again in a clone, and nothing differs from what is committed.
    for delay_s in (15, 60, 240):  # a slow machine may be past the first moment before the schedule is made
        soon = datetime.now(UTC) + timedelta(seconds=delay_s)
        schedule = ["--interval", "7200", "--anchor-date", f"{soon:%Y-%m-%dT%H:%M:%S}"]
        command = ["prefect", "deployment", "schedule", "create", "pipeline-nightly/pipeline-nightly", *schedule]
        run("env", f"PREFECT_API_URL={runs.api}", *command, cwd=project)
        if datetime.now(UTC) < soon - timedelta(seconds=2):
            break
    wait_for("end of the scheduled run", lambda: bool(runs.scheduled()), PATIENCE_S)
    (night,) = runs.scheduled()
    assert night["state"]["type"] == "COMPLETED", night["state"]
    assert "committed bytes" in artifacts(runs.api, "drift")[0]["data"]
    assert artifacts(runs.api, "stages")[0]["data"] == 100.0
    table = artifacts(runs.api, "table-6-1")[0]
    assert table["description"].endswith(", 3 trees") and len(json.loads(table["data"])) > 10
    assert run("git", "status", "--porcelain", cwd=project).stdout == ""
    assert "/runs/" in artifacts(runs.api, "training-runs")[0]["data"]

    # Whoever looks: both pages show the run and its figures.
    take_prefect(runs.api.removesuffix("/api"), project, tmp_path)
    take_mlflow(f"http://127.0.0.1:{ports['MLFLOW_PORT']}", project, tmp_path)
    for name in ("prefect.png", "mlflow.png"):
        assert (ROOT / f"docs/figures/{name}").stat().st_size < LARGEST_BYTES

    # Bad input: the run fails with its sentence at once, and is told of.
    asked = runs.start("pipeline-on-demand", payload_kg=99)
    failed = runs.wait(asked, "FAILED", "COMPLETED", "CRASHED")
    sentence = "robot.payload_kg: a payload of 99 kg is more than kuka_kr16_r2010_2 is rated for; allowed: 0 to 16 kg"
    assert failed["state"]["type"] == "FAILED" and sentence in failed["state"]["message"]
    alerts = project / ".desk/alerts.jsonl"
    wait_for("the alert", alerts.exists, PATIENCE_S)
    told = json.loads(alerts.read_text(encoding="utf-8").splitlines()[0])
    assert (told["run"], told["state"]) == (failed["name"], "Failed") and sentence in told["message"]

    # The process of a flow is killed: its stage ends with it, the worker closes the run.
    killed = runs.start("pipeline-nightly")
    wait_for("a stage", lambda: any("stages." in " ".join(one.cmdline()) for one in below(project)), PATIENCE_S)
    os.kill(int(runs.get(killed)["infrastructure_pid"]), signal.SIGKILL)
    runs.wait(killed, "CRASHED")
    wait_for("end of the stage", lambda: not below(project), 60)

    # Everything is killed in the middle of a run, as by a switched-off machine.
    lost = runs.start("pipeline-nightly")
    wait_for("a stage", lambda: any("stages." in " ".join(one.cmdline()) for one in below(project)), PATIENCE_S)
    for pid in (int(runs.get(lost)["infrastructure_pid"]), *processes(project).values()):
        os.kill(pid, signal.SIGKILL)
    wait_for("end of the stage", lambda: not below(project), 60)
    desk(project, "up")
    closed = runs.get(lost)
    assert closed["state"]["type"] == "CRASHED" and "was gone" in closed["state"]["message"]
    wait_for("no open run but of the alert", lambda: runs.open() == [], PATIENCE_S)

    # Its slot is free, and a worker that is ended in the middle of a run leaves neither process nor open run.
    last = runs.start("pipeline-nightly")
    wait_for("a stage", lambda: any("stages." in " ".join(one.cmdline()) for one in below(project)), PATIENCE_S)
    desk(project, "down")
    assert below(project) == []
    with closing(sqlite3.connect(project / ".desk/prefect/prefect.db")) as store:
        states = dict(store.execute("SELECT id, state_type FROM flow_run"))
    assert states[last] in ("CRASHED", "COMPLETED")  # as far as it came before the end reached it
    assert not {"RUNNING", "PENDING", "CANCELLING"} & set(states.values())


def unit(name: str, project: Path) -> dict[str, str]:
    """The service section of a unit, for a project in another folder."""
    text = (ROOT / f"deploy/{name}.service").read_text(encoding="utf-8")
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read_string(text.replace("/srv/robojoule/.venv/bin/python", sys.executable))
    return {key: value.replace("/srv/robojoule", str(project)) for key, value in parser["Service"].items()}


UNITS = ("robojoule-prefect", "robojoule-mlflow", "robojoule-worker", "robojoule-inbox")


def test_the_units_of_systemd_start_and_end_cleanly(
    project: Path,
    ports: dict[str, str],  # noqa: F811
    background: Background,
    tmp_path: Path,
):
    """Each command as systemd starts it, in the order of its dependencies; SIGTERM to the main process alone."""
    health = (
        f"http://127.0.0.1:{ports['PREFECT_SERVER_API_PORT']}/api/health",
        f"http://127.0.0.1:{ports['MLFLOW_PORT']}/health",
        f"http://127.0.0.1:{ports['PREFECT_WORKER_WEBSERVER_PORT']}/health",
    )
    ready = [*(partial(answers, url) for url in health), lambda: "looks into" in log_of("robojoule-inbox")]

    def log_of(name: str) -> str:
        return (tmp_path / f"{name}.log").read_text(encoding="utf-8")

    started = []
    for name, is_ready in zip(UNITS, ready, strict=True):
        service = unit(name, project)
        assert Path(service["EnvironmentFile"]).exists()
        folder = Path(service["WorkingDirectory"])
        process = background.start(service["ExecStart"], folder, tmp_path / f"{name}.log")
        wait_for(name, lambda ready=is_ready, process=process: ready() or process.poll() is not None, PATIENCE_S)
        assert process.poll() is None, log_of(name)[-500:]
        started.append((name, process, service))
    assert len(ask(f"{health[0].removesuffix('/health')}", "deployments/filter", {})) >= 2
    for name, process, service in reversed(started):
        assert service["KillMode"] == "mixed"
        children = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=float(service["TimeoutStopSec"]))
        assert process.returncode in (0, -signal.SIGTERM), log_of(name)[-500:]
        psutil.wait_procs(children, timeout=10)


def test_systemd_finds_nothing_wrong_with_the_units(tmp_path: Path):
    if shutil.which("systemd-analyze") is None:
        pytest.skip("there is no systemd-analyze")
    for name in UNITS:
        text = (ROOT / f"deploy/{name}.service").read_text(encoding="utf-8")
        (tmp_path / f"{name}.service").write_text(
            text.replace("/srv/robojoule/.venv/bin/python", sys.executable).replace("User=robojoule\n", ""),
            encoding="utf-8",
        )
    words = ["systemd-analyze", "verify", *(str(tmp_path / f"{name}.service") for name in UNITS)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    said = [line for line in done.stderr.splitlines() if "robojoule" in line]
    assert said == []
