"""The desk for real: Prefect server, MLflow server and worker, brought up and down, each twice."""

import json
import os
import shutil
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
import yaml

from tests.conftest import free_port, run, wait_for
from tests.servers import ask


@pytest.fixture
def ports(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    found = {
        name: str(free_port()) for name in ("PREFECT_SERVER_API_PORT", "PREFECT_WORKER_WEBSERVER_PORT", "MLFLOW_PORT")
    }
    for name, port in found.items():
        monkeypatch.setenv(name, port)
    return found


def desk(project: Path, command: str, code: int = 0) -> str:
    """As a script starts it in the background: deaf to SIGINT."""
    words = ("env", "--ignore-signal=INT", sys.executable, "-m", "flows.desk", command)
    return run(*words, cwd=project, code=code).stdout


@pytest.fixture
def project(toy_project: Path, ports: dict[str, str]) -> Iterator[Path]:
    yield toy_project
    desk(toy_project, "down")


WATCH = """
import os, sys

def note(event, words):
    if event == "socket.getaddrinfo" and words[0]:
        name = words[0].decode() if isinstance(words[0], bytes) else str(words[0])
        if name not in ("localhost", "::1", "0.0.0.0") and not name.startswith("127."):
            with open({place!r}, "a") as file:
                print(name, *sys.argv[:4], file=file)

sys.addaudithook(note)
"""


@pytest.fixture
def looked_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """File that gets a line for every address that a Python program looks up and that is not this machine's."""
    place = tmp_path / "looked-up"
    (tmp_path / "sitecustomize.py").write_text(WATCH.format(place=str(place)), encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    ask = "import socket\ntry: socket.getaddrinfo('host.invalid', 80)\nexcept OSError: pass"
    subprocess.run([sys.executable, "-c", ask], check=True)
    assert place.read_text(encoding="utf-8").startswith("host.invalid")  # it would be seen
    place.unlink()
    return place


def processes(project: Path) -> dict[str, int]:
    files = (project / ".desk/run").glob("*.json")
    return {path.stem: json.loads(path.read_text(encoding="utf-8"))["pid"] for path in files}


def test_up_and_down(project: Path, ports: dict[str, str], looked_up: Path):
    names = ["prefect-server", "mlflow-server", "prefect-worker", "inbox-watch"]
    assert desk(project, "status", code=3).count("does not run") == len(names)
    said = desk(project, "up").splitlines()
    assert [line.split(maxsplit=1) for line in said[:4]] == [[name, "started"] for name in names]
    api, mlflow = (f"http://127.0.0.1:{ports[name]}" for name in ("PREFECT_SERVER_API_PORT", "MLFLOW_PORT"))
    assert f"Prefect  {api}" in said and f"MLflow   {mlflow}" in said
    assert desk(project, "status").count("runs since") == len(names)

    expected = yaml.safe_load((project / "prefect.yaml").read_text(encoding="utf-8"))["deployments"]
    found = ask(f"{api}/api", "deployments/filter", {})
    assert {one["name"] for one in found} == {one["name"] for one in expected}
    assert {one["work_pool_name"] for one in found} == {"local"}
    with urllib.request.urlopen(f"{mlflow}/", timeout=30) as page:
        assert b"MLflow" in page.read()

    # Only this machine reaches them: whatever they listen on is a loopback address.
    family = [one for pid in processes(project).values() for one in _with_children(psutil.Process(pid))]
    listening = {c.laddr.ip for one in family for c in one.net_connections("inet") if c.status == psutil.CONN_LISTEN}
    assert listening == {"127.0.0.1"}

    first = processes(project)
    os.kill(first["mlflow-server"], signal.SIGKILL)
    wait_for("its end", lambda: "was killed" in desk_status(project), 30)
    said = desk(project, "up").splitlines()
    assert [line.split(maxsplit=1)[1] for line in said[:4]] == [
        "runs already",
        "started",
        "runs already",
        "runs already",
    ]
    assert {name for name, pid in processes(project).items() if pid != first[name]} == {"mlflow-server"}

    with subprocess.Popen(["sleep", "120"], start_new_session=True) as other:  # not of the desk: it stays
        begun = (project / ".desk/log/prefect-worker.log").read_text(encoding="utf-8")
        assert desk(project, "down").count("ended") == len(names)
        said = (project / ".desk/log/prefect-worker.log").read_text(encoding="utf-8").removeprefix(begun)
        assert "Worker 'desk' stopped!" in said  # by itself, not killed when its time was up
        assert other.poll() is None
        other.kill()
    assert [one for one in family if one.is_running() and one.status() != psutil.STATUS_ZOMBIE] == []
    assert desk(project, "down").count("does not run") == len(names)
    ignored = run("git", "status", "--porcelain", "--ignored=no", ".desk", cwd=project).stdout
    assert ignored == ""
    assert not looked_up.exists(), looked_up.read_text(encoding="utf-8")


@pytest.mark.parametrize("text", ["deployments: [", None], ids=["garbled", "missing"])
def test_a_damaged_file_of_deployments_is_one_sentence_before_anything_starts(
    toy_project: Path, tmp_path: Path, text: str | None
):
    project = tmp_path / "project"
    shutil.copytree(toy_project, project, symlinks=True)
    (project / "prefect.yaml").unlink()
    if text is not None:
        (project / "prefect.yaml").write_text(text, encoding="utf-8")
    failed = run(sys.executable, "-m", "flows.desk", "up", cwd=project, code=2)
    assert failed.stderr.startswith("flows.desk: ") and "prefect.yaml" in failed.stderr
    assert failed.stderr.count("\n") == 1
    assert processes(project) == {}


def _with_children(process: psutil.Process) -> list[psutil.Process]:
    return [process, *process.children(recursive=True)]


def desk_status(project: Path) -> str:
    return run(sys.executable, "-m", "flows.desk", "status", cwd=project, code=None).stdout
