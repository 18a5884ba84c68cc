"""What events start, with server and worker: a log that arrives, a night that differs, a stage that fails."""

import http.server
import json
import os
import signal
import socket
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mlflow
import psutil
import pyarrow as pa
import pytest
from pyarrow import csv

from tests.calibration.plant import Plant, make_log
from tests.conftest import free_port, run, wait_for
from tests.flows.test_desk import desk, desk_status, ports, processes  # noqa: F401  ports is a fixture
from tests.flows.test_schedule import PATIENCE_S, Runs, below, project  # noqa: F401  project is a fixture
from tests.servers import artifacts, ask


class Receiver(http.server.ThreadingHTTPServer):
    """A place on the network that alerts are sent to; keeps what it got."""

    def __init__(self) -> None:
        self.got: list[dict[str, Any]] = []
        super().__init__(("127.0.0.1", free_port()), Request)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/alerts"


class Request(http.server.BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        assert isinstance(self.server, Receiver) and self.path == "/alerts"
        self.server.got.append(json.loads(self.rfile.read(int(self.headers["content-length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *words: object) -> None:
        pass


@pytest.fixture
def receiver(monkeypatch: pytest.MonkeyPatch) -> Iterator[Receiver]:
    server = Receiver()
    monkeypatch.setenv("ROBOJOULE_ALERT_URL", server.url)
    yield server
    server.shutdown()
    server.server_close()


def commit(project: Path) -> None:  # noqa: F811
    words = ["-c", "user.name=toy", "-c", "user.email=toy@example.org", "commit", "-qam", "Changed"]
    run("git", *words, cwd=project)


def told(receiver: Receiver, name: str) -> dict[str, Any]:
    """What the receiver got of a run."""
    wait_for(f"the alert of {name}", lambda: any(one["run"] == name for one in receiver.got), PATIENCE_S)
    return next(one for one in receiver.got if one["run"] == name)


def test_a_log_a_drift_and_a_failure(
    project: Path,  # noqa: F811
    ports: dict[str, str],  # noqa: F811
    receiver: Receiver,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
):
    runs = Runs(ports["PREFECT_SERVER_API_PORT"])
    desk(project, "up")

    # A log arrives: the trigger starts the flow, long before the schedule would.
    columns, _ = make_log(Plant(21), 21, motions=24)
    csv.write_csv(pa.table(columns), tmp_path / "monday.csv")
    words = ["env", f"PREFECT_API_URL={runs.api}", sys.executable, "-m", "flows.measurements"]
    run(*words, str(tmp_path / "monday.csv"), cwd=project)
    accepted = project / ".desk/inbox/accepted/monday.csv"
    wait_for("the log among the accepted ones", accepted.exists, PATIENCE_S)
    wait_for("its artifact", lambda: bool(artifacts(runs.api, "measurements")), PATIENCE_S)
    (taken,) = artifacts(runs.api, "measurements")
    assert json.loads(taken["data"]) == [{"log": "monday.csv", "outcome": "accepted"}]
    assert runs.get(taken["flow_run_id"])["created_by"]["type"] == "AUTOMATION"

    # Somebody asks for another robot. Meanwhile the server is killed and started again; the run and its worker wait.
    words = ["-p", 'robot="ur_ur10e"', "-p", "payload_kg=5", "-p", "trees=5"]
    other = runs.start_by_command(project, "pipeline-on-demand/pipeline-on-demand", *words)
    wait_for("a stage", lambda: bool(_clones_with_stages(project)), PATIENCE_S)
    before = processes(project)
    os.kill(before["prefect-server"], signal.SIGKILL)
    wait_for("its end", lambda: "was killed" in desk_status(project), PATIENCE_S)
    desk(project, "up")
    assert {name for name, pid in processes(project).items() if pid != before[name]} == {"prefect-server"}

    # A night over a table that somebody changed: it says which one, to file and network.
    table = project / "reports/tables/table_6_1.csv"
    table.chmod(0o644)
    text = table.read_text(encoding="utf-8")
    table.unlink()  # it may be a link into the cache
    table.write_text(text.replace("110,", "111,", 1), encoding="utf-8")
    commit(project)
    asked = runs.start("pipeline-nightly")
    night = runs.wait(asked, "FAILED", "COMPLETED", "CRASHED")
    assert night["state"]["type"] == "FAILED" and "differ from the committed" in night["state"]["message"], night[
        "state"
    ]
    assert "table_6_1" in artifacts(runs.api, "drift")[0]["data"]
    assert "differ from the committed" in told(receiver, night["name"])["message"]

    # What was asked for is there: of that robot, with other figures than the project's.
    done = runs.wait(other, "COMPLETED", "FAILED", "CRASHED")
    assert done["state"]["type"] == "COMPLETED", done["state"]
    results = project / ".desk/results" / done["name"]
    assert json.loads((results / "models/profile_predictor/predictor.json").read_text())["robot"] == "ur_ur10e"
    figures = [json.loads((folder / "reports/headline.json").read_text()) for folder in (results, project)]
    assert figures[0].keys() == figures[1].keys() and figures[0] != figures[1]
    assert done["name"] in artifacts(runs.api, "on-demand")[0]["data"]
    # Tried with another robot, so that nobody plans with it unasked.
    address = f"http://127.0.0.1:{ports['MLFLOW_PORT']}"
    client = mlflow.MlflowClient(address, address)
    experiments = [one.experiment_id for one in client.search_experiments()]
    trials = {one.info.run_id for one in client.search_runs(experiments, f"tags.trial = '{done['name']}'")}
    aliases = {model.name: model.aliases for model in client.search_registered_models()}
    champions = {
        client.get_model_version(name, str(version)).run_id
        for name, of_model in aliases.items()
        for version in of_model.values()
    }
    assert trials and "random-forest" in aliases and not trials & champions

    # A stage that fails: its own sentence.
    stages = project / "dvc.yaml"
    command = "python -m stages.generate_trees"
    stages.write_text(stages.read_text(encoding="utf-8").replace(command, f"{command} --params nowhere.yaml", 1))
    commit(project)
    failed = runs.wait(runs.start("pipeline-nightly"), "FAILED", "COMPLETED", "CRASHED")
    sentence = "generate_trees: nowhere.yaml: there is no such file"
    assert failed["state"]["type"] == "FAILED" and sentence in failed["state"]["message"]
    alert = told(receiver, failed["name"])
    assert (alert["flow"], alert["state"]) == ("pipeline-nightly", "Failed") and sentence in alert["message"]
    lines = (project / ".desk/alerts.jsonl").read_text(encoding="utf-8").splitlines()
    assert alert in [json.loads(line) for line in lines]

    # A run whose process ended while no server could be told is closed by the next look; one without a process is not.
    gone, waiting = (_claimed_to_run(runs, pid) for pid in (f"{socket.gethostname()}:999999999", None))
    desk(project, "up")
    assert [runs.get(one)["state"]["type"] for one in (gone, waiting)] == ["CRASHED", "RUNNING"]


def _clones_with_stages(project: Path) -> set[str]:  # noqa: F811
    """Clones in which stages run."""
    found = set()
    for process in below(project):
        try:
            if any(word.startswith("stages.") for word in process.cmdline()):
                found.add(process.cwd())
        except (psutil.Error, OSError):
            continue
    return found


def _claimed_to_run(runs: Runs, pid: str | None) -> str:
    """A run that the server believes to run; no worker takes it."""
    made = runs.start("pipeline-on-demand", at="2100-01-01T00:00:00Z")
    if pid is not None:
        ask(runs.api, f"flow_runs/{made}", {"infrastructure_pid": pid}, "PATCH")
    ask(runs.api, f"flow_runs/{made}/set_state", {"state": {"type": "RUNNING", "name": "Running"}, "force": True})
    return made
