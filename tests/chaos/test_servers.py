"""Servers that are killed in the middle of a run: one sentence, no torn file, and the same command goes on."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from reproduction.layout import Layout
from reproduction.predictors.estimators import MODELS
from tests.conftest import ROOT, Background, answers, free_port, run, wait_for
from tests.flows.test_pipeline import STAGES, project, with_first_command  # noqa: F401  project is a fixture
from tests.flows.test_schedule import PATIENCE_S


def test_the_server_of_a_flow_is_killed(project: Path, tmp_path: Path):  # noqa: F811
    """The command started it, so nobody else would start it again."""
    hold = "touch ../begun; while test -e ../hold; do sleep 0.2; done; "
    with_first_command(project, hold + STAGES["build_features"]["cmd"])
    (tmp_path / "hold").touch()
    words = [sys.executable, "-m", "flows.pipeline", "--root", str(project)]
    environment = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
    with (tmp_path / "log").open("wb") as log:
        flow = subprocess.Popen(words, cwd=ROOT, env=environment, stdout=log, stderr=log, start_new_session=True)
    try:
        wait_for("the stage", lambda: (tmp_path / "begun").exists() or flow.poll() is not None, PATIENCE_S)
        below = psutil.Process(flow.pid).children(recursive=True)
        *_, server = (one for one in below if "uvicorn" in one.cmdline())  # not the lifeline that started it
        server.kill()
        (tmp_path / "hold").unlink()
        assert flow.wait(PATIENCE_S) == 1
    finally:
        if flow.poll() is None:
            os.killpg(flow.pid, signal.SIGKILL)
            flow.wait()
    said = (tmp_path / "log").read_text(encoding="utf-8")
    assert "flows.pipeline: the Prefect server at http://127.0.0.1:" in said.splitlines()[-1]
    assert "no longer answers; give the same command again" in said and "Traceback" not in said
    assert run("dvc", "status", "build_features", cwd=project).stdout.startswith("Data and pipelines are up to date")


def test_the_server_of_mlflow_is_killed_during_a_training(
    reproduced: Path, background: Background, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The training is made, with the bytes of an undisturbed one; the same stage records it when a server is back."""
    folder = tmp_path / "copy"
    shutil.copytree(reproduced, folder, symlinks=True, ignore=shutil.ignore_patterns(".dvc", ".git", ".desk"))
    made = [path for model in MODELS for path in (Layout(reproduced).models_dir / model).iterdir()]
    models = {path: path.read_bytes() for path in made}
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    monkeypatch.setenv("MLFLOW_TRACKING_URI", url)
    store = f"--backend-store-uri 'sqlite:///{tmp_path}/mlflow.db' --default-artifact-root '{tmp_path.as_uri()}/made'"
    command = f"mlflow server --host 127.0.0.1 --port {port} --workers 1 {store}"
    training = [sys.executable, "-m", "stages.train_predictors", "--root", str(folder)]

    server = background.start(command, tmp_path, tmp_path / "server.log")
    wait_for("the server", lambda: answers(f"{url}/health"), PATIENCE_S)
    for path in models:  # else nothing would show that they were made
        (folder / path.relative_to(reproduced)).unlink()
    stage = subprocess.Popen(training, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    first = next((line for line in stage.stdout if "recorded in MLflow" in line), "")
    os.killpg(server.pid, signal.SIGKILL)
    said = first + stage.communicate(timeout=PATIENCE_S)[0]
    assert stage.returncode == 0 and first, said
    last = said.splitlines()[-1]
    assert last.startswith("train_predictors: the trainings are made, but not all of them are recorded: "), said
    assert "a running server" in last and "Traceback" not in said
    for path, content in models.items():
        assert (folder / path.relative_to(reproduced)).read_bytes() == content

    background.start(command, tmp_path, tmp_path / "server.log")
    wait_for("the server", lambda: answers(f"{url}/health"), PATIENCE_S)
    assert "random_forest, recorded in MLflow" in run(*training, cwd=ROOT).stdout
