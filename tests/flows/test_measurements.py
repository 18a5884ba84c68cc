"""Logs of a hidden machine on their way from the inbox to the measured set, its branch and the registry."""

import shutil
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import csv

from flows.measurements import BRANCH, ingest_measurements
from reproduction.layout import Layout
from reproduction.tracking.measured import REGISTERED
from reproduction.tracking.store import store_uri
from tests.calibration.plant import Plant, make_log
from tests.conftest import run

MACHINE = Plant(21)


@pytest.fixture
def project(toy_project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    folder = tmp_path / "project"
    run("git", "clone", "-q", str(toy_project), str(folder), cwd=tmp_path)
    (folder / ".desk/inbox").mkdir(parents=True)
    return folder


def put(folder: Path, name: str, seed: int, **options: object) -> None:
    columns, _ = make_log(MACHINE, seed, motions=24, **options)
    csv.write_csv(pa.table(columns), folder / name)


def on_the_branch(project: Path) -> list[str]:
    return run("git", "ls-tree", "-r", "--name-only", BRANCH, "measured", cwd=project).stdout.split()


def test_logs_are_taken_in_or_rejected_with_their_reason(project: Path, prefect_server: str, tmp_path: Path):
    inbox = project / ".desk/inbox"
    put(inbox, "monday.csv", 21)
    put(inbox, "other-payload.csv", 23, payload_kg=2.0)
    (inbox / "broken.csv").write_text("time_s,q1_rad\n0,0\n", encoding="utf-8")
    (inbox / ".half.csv").write_text("being copied", encoding="utf-8")
    outcome = ingest_measurements(root=project)
    assert outcome["monday.csv"] == "accepted"
    assert "looks like a payload of about" in outcome["other-payload.csv"]
    assert set(outcome) == {"monday.csv", "other-payload.csv", "broken.csv"}
    assert [path.name for path in (inbox / "accepted").iterdir()] == ["monday.csv"]
    assert (inbox / "rejected/broken.csv.reason.txt").read_text(encoding="utf-8") == outcome["broken.csv"] + "\n"
    assert {path.name for path in inbox.iterdir() if path.is_file()} == {".half.csv"}

    # Data and their DVC files are on a branch of their own; the folder at hand and its branch are as they were.
    wanted = {"measured/runs.parquet.dvc", "measured/logs.dvc", "measured/energy_profile.dvc"}
    assert wanted | {"measured/identified/monday.json"} <= set(on_the_branch(project))
    assert run("git", "status", "--porcelain", cwd=project).stdout == ""
    assert not (project / "measured").exists()

    # What the motions teach is better than the catalog on motions that took no part, and is registered for that.
    import mlflow

    client = mlflow.MlflowClient(tracking_uri=store_uri(Layout(project)))
    first = client.get_model_version_by_alias(REGISTERED, "champion")
    figures = client.get_run(first.run_id).data.metrics
    assert figures["error_percent"] < figures["entry_error_percent"]

    # The next log is added to those before; one that is there already is refused.
    put(inbox, "tuesday.csv", 22)
    shutil.copy(inbox / "accepted/monday.csv", inbox / "monday.csv")
    outcome = ingest_measurements(root=project)
    assert outcome["tuesday.csv"] == "accepted" and "was taken in before" in outcome["monday.csv"]
    clone = tmp_path / "clone"
    run("git", "clone", "-q", "--branch", BRANCH, str(project), str(clone), cwd=tmp_path)
    (clone / ".dvc/config.local").write_text(f"[cache]\n    dir = {project}/.dvc/cache\n", encoding="utf-8")
    run("dvc", "checkout", "measured/runs.parquet.dvc", "measured/logs.dvc", cwd=clone)
    rows = pq.read_table(clone / "measured/runs.parquet")
    assert set(rows["log"].to_pylist()) == {"monday.csv", "tuesday.csv"} and len(rows) > 40
    assert {path.name for path in (clone / "measured/logs").iterdir()} == {"monday.csv", "tuesday.csv"}
    assert client.get_model_version_by_alias(REGISTERED, "previous").version == first.version
    assert ingest_measurements(root=project) == {}


def test_the_command_puts_logs_into_the_inbox(project: Path, tmp_path: Path):
    (tmp_path / "log.csv").write_text("time_s\n", encoding="utf-8")
    words = ["env", "-u", "PREFECT_API_URL", sys.executable, "-m", "flows.measurements"]
    run(*words, str(tmp_path / "log.csv"), cwd=project)
    assert [path.name for path in (project / ".desk/inbox").iterdir()] == ["log.csv"]
    said = run(*words, str(tmp_path / "log.txt"), cwd=project, code=1).stderr
    assert said == f"flows.measurements: {tmp_path}/log.txt: this is not a log; allowed: a file ending with " + (
        ".csv, .parquet, .gz\n"
    )
