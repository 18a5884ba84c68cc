"""The flow's own behaviour, on a DVC project of three shell stages: outcomes, artifacts, retries, timeout."""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
import yaml

from flows.pipeline import StageFailed, pipeline, reproduce_stage, stage_names
from reproduction.tracking.store import data_hash
from tests.conftest import ROOT, free_port, wait_for
from tests.servers import artifacts

STAGES: dict[str, dict[str, Any]] = {
    "build_features": {
        "cmd": "mkdir -p data && echo features > data/features.parquet",
        "outs": ["data/features.parquet"],
    },
    "train_predictors": {
        "cmd": "echo model > data/model",
        "deps": ["data/features.parquet"],
        "outs": ["data/model"],
    },
    "evaluate_plans": {
        "cmd": "mkdir -p reports/tables && "
        "printf 'relaxation_percent,method,saving_percent\\n110,optimum,12.5\\n' > reports/tables/table_6_1.csv",
        "deps": ["data/model"],
        "outs": ["reports/tables/table_6_1.csv"],
    },
}


@pytest.fixture
def project(tmp_path: Path) -> Path:
    folder = tmp_path / "shell stages"
    folder.mkdir()
    (folder / ".dvc").mkdir()
    (folder / ".dvc/config").write_text("[core]\n    no_scm = true\n    analytics = false\n", encoding="utf-8")
    return with_first_command(folder, STAGES["build_features"]["cmd"])


def with_first_command(project: Path, command: str) -> Path:
    """The project with another command in its first stage."""
    stages = {**STAGES, "build_features": {**STAGES["build_features"], "cmd": command}}
    (project / "dvc.yaml").write_text(yaml.safe_dump({"stages": stages}, sort_keys=False), encoding="utf-8")
    return project


def test_stages_run_in_order_and_then_rest(project: Path, prefect_server: str):
    names = ["build_features", "train_predictors", "evaluate_plans"]
    assert stage_names(project) == names
    assert pipeline(project) == dict.fromkeys(names, "ran")
    assert pipeline(project) == dict.fromkeys(names, "unchanged")

    assert artifacts(prefect_server, "stages")[0]["data"] == 100.0
    (row,) = json.loads(artifacts(prefect_server, "table-6-1")[0]["data"])
    assert row == {"relaxation_percent": "110", "method": "optimum", "saving_percent": "12.5"}
    note = artifacts(prefect_server, "training-runs")[0]["data"]
    assert data_hash(project / "data/features.parquet") in note
    assert not (project / "mlflow.db").exists()


def test_a_record_that_cannot_be_read_costs_its_links_alone(
    project: Path, prefect_server: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("MLFLOW_TRACKING_URI", f"http://127.0.0.1:{free_port()}")
    assert set(pipeline(project).values()) == {"ran"}
    note = artifacts(prefect_server, "training-runs")[0]["data"]
    assert "They cannot be looked up: " in note and "a running server" in note


def test_a_failed_stage_is_tried_once_more(project: Path, prefect_server: str):
    count = "echo try >> ../tries; test $(wc -l < ../tries) -ge 2 || exit 1; "
    with_first_command(project, count + STAGES["build_features"]["cmd"])
    assert reproduce_stage.with_options(retry_delay_seconds=0)("build_features", project) == "ran"
    assert (project.parent / "tries").read_text().count("try") == 2


def test_bad_input_is_not_tried_again(project: Path, prefect_server: str):
    with_first_command(project, "echo try >> ../tries; echo 'params.yaml, seed: this key is missing' >&2; exit 2")
    with pytest.raises(StageFailed, match="this key is missing") as caught:
        pipeline(project)
    assert caught.value.bad_input
    assert (project.parent / "tries").read_text().count("try") == 1


def test_a_timeout_ends_the_stage_with_all_its_processes(project: Path, prefect_server: str):
    """A stage that hangs fails the run, with a sentence, and is not tried again."""
    file, limit_s = project.parent / "pids", 5.0
    with_first_command(project, "echo $$ >> ../pids; exec sleep 3600")
    while not file.exists():  # a slow machine gets the time that it takes to start DVC
        limit_s *= 2.0
        with pytest.raises(StageFailed, match=f"build_features: took longer than {limit_s:g} s") as caught:
            pipeline(project, stage_timeout_s=limit_s)
    assert not caught.value.bad_input
    (pid,) = file.read_text(encoding="utf-8").split()  # one: it was not tried again
    wait_for("end of the stage's process", lambda: not Path(f"/proc/{pid}").exists(), 60)


@pytest.mark.parametrize(("code", "tries"), [(2, 1), (255, 2)])
def test_only_exit_code_2_is_bad_input(project: Path, prefect_server: str, code: int, tries: int):
    with_first_command(project, f"echo try >> ../tries; exit {code}")
    with pytest.raises(StageFailed):
        reproduce_stage.with_options(retry_delay_seconds=0)("build_features", project)
    assert (project.parent / "tries").read_text().count("try") == tries


def test_dvcs_look_at_the_stages_ends_with_a_command_that_is_killed(tmp_path: Path):
    """Its name for the folder tells it apart from others' processes."""
    code = "import os, sys; from pathlib import Path; from flows.fan_out import Look; Look(Path(sys.argv[1]), ['a'])"
    run_here = [sys.executable, "-c", f"{code}; os.kill(os.getpid(), 9)", str(tmp_path)]
    subprocess.run(run_here, cwd=ROOT, check=False)
    end = time.monotonic() + 1.0  # DVC alone takes longer to load
    while (left := _in_folder(tmp_path)) and time.monotonic() < end:
        time.sleep(0.05)
    assert left == []


def _in_folder(folder: Path) -> list[psutil.Process]:
    return [one for one in psutil.process_iter(["cwd"]) if one.info["cwd"] == str(folder)]
