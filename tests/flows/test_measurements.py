"""Logs of a hidden machine on their way from the inbox to the measured set, its branch and the registry."""

import shutil
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import csv

from flows.inbox import whole_logs
from flows.measurements import BRANCH, ingest_measurements
from reproduction.layout import Layout
from reproduction.tracking.measured import registered_name
from reproduction.tracking.store import RecordError, store_uri
from robojoule.errors import InputError
from tests.calibration.plant import ROBOT, Plant, make_log
from tests.conftest import run, wait_for

MACHINE = Plant(21)
REGISTERED = registered_name(ROBOT)
OTHER = "kuka_kr6_r900_2"
BELOW = f"measured/{ROBOT}"


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


def ingest(project: Path, **parameters: object) -> dict[str, str]:
    """What becomes of the logs that wait, once none of them looks as if it were being copied."""
    inbox = project / ".desk/inbox"
    waiting = [path for path in inbox.glob("[!.]*") if path.is_file()]
    wait_for("the logs", lambda: len(whole_logs(inbox, pause_s=0.1)) == len(waiting), 60)
    return ingest_measurements(root=project, **parameters)


def on_the_branch(project: Path) -> list[str]:
    return run("git", "ls-tree", "-r", "--name-only", BRANCH, "measured", cwd=project).stdout.split()


def test_logs_are_taken_in_or_rejected_with_their_reason(
    project: Path, prefect_server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    inbox = project / ".desk/inbox"
    put(inbox, "monday.csv", 21)
    put(inbox, "other-payload.csv", 23, payload_kg=2.0)
    (inbox / "broken.csv").write_text("time_s,q1_rad\n0,0\n", encoding="utf-8")
    (inbox / ".half.csv").write_text("being copied", encoding="utf-8")
    outcome = ingest(project)
    assert outcome["monday.csv"] == "accepted"
    assert "looks like a payload of about" in outcome["other-payload.csv"]
    assert set(outcome) == {"monday.csv", "other-payload.csv", "broken.csv"}
    assert [path.name for path in (inbox / "accepted").iterdir()] == ["monday.csv"]
    assert (inbox / "rejected/broken.csv.reason.txt").read_text(encoding="utf-8") == outcome["broken.csv"] + "\n"
    assert {path.name for path in inbox.iterdir() if path.is_file()} == {".half.csv"}

    # Data and their DVC files are on a branch of their own; the folder at hand and its branch are as they were.
    wanted = {f"{BELOW}/{name}" for name in ("runs.parquet.dvc", "logs.dvc", "energy_profile.dvc")}
    assert wanted | {f"{BELOW}/identified/monday.csv.json"} <= set(on_the_branch(project))
    assert run("git", "status", "--porcelain", cwd=project).stdout == ""
    assert not (project / "measured").exists()

    # What the motions teach is better than the catalog on motions that took no part, and is registered for that.
    import mlflow

    client = mlflow.MlflowClient(tracking_uri=store_uri(Layout(project)))
    first = client.get_model_version_by_alias(REGISTERED, "champion")
    figures = client.get_run(first.run_id).data.metrics
    assert figures["error_percent"] < figures["entry_error_percent"]

    # The next log is added to those before; another one of a name that is taken is rejected, and overwrites none.
    put(inbox, "tuesday.csv", 22)
    put(inbox, "monday.csv", 23)
    (inbox / "broken.csv").write_text("time_s,q2_rad\n0,0\n", encoding="utf-8")
    outcome = ingest(project)
    assert outcome["tuesday.csv"] == "accepted" and "another log of this name" in outcome["monday.csv"]
    assert {"broken.csv", "broken-2.csv", "broken-2.csv.reason.txt", "monday.csv"} <= {
        path.name for path in (inbox / "rejected").iterdir()
    }
    clone = tmp_path / "clone"
    run("git", "clone", "-q", "--branch", BRANCH, str(project), str(clone), cwd=tmp_path)
    (clone / ".dvc/config.local").write_text(f"[cache]\n    dir = {project}/.dvc/cache\n", encoding="utf-8")
    run("dvc", "checkout", f"{BELOW}/runs.parquet.dvc", f"{BELOW}/logs.dvc", cwd=clone)
    rows = pq.read_table(clone / BELOW / "runs.parquet")
    assert set(rows["log"].to_pylist()) == {"monday.csv", "tuesday.csv"} and len(rows) > 40
    assert {path.name for path in (clone / BELOW / "logs").iterdir()} == {"monday.csv", "tuesday.csv"}
    assert client.get_model_version_by_alias(REGISTERED, "previous").version == first.version
    assert ingest_measurements(root=project) == {}

    # A log that a run took in, but was killed before it moved it, is accepted; the branch stays as it is.
    commit = run("git", "rev-parse", BRANCH, cwd=project).stdout
    shutil.move(inbox / "accepted/monday.csv", inbox / "monday.csv")
    assert ingest(project) == {"monday.csv": "accepted"}
    assert run("git", "rev-parse", BRANCH, cwd=project).stdout == commit

    # A registry that fails costs the record, not the motions.
    put(inbox, "wednesday.csv", 24)
    with monkeypatch.context() as patch:
        patch.setattr(mlflow, "log_params", _no_disk)
        with pytest.raises(RecordError, match="no disk"):
            ingest(project)
    assert (inbox / "accepted/wednesday.csv").exists() and f"{BELOW}/identified/wednesday.csv.json" in (
        on_the_branch(project)
    )

    # Another machine has a set and a model of its own.
    columns, _ = make_log(Plant(5, name=OTHER), 5, motions=24, payload_kg=3.0)
    csv.write_csv(pa.table(columns), inbox / "monday.csv")
    assert ingest(project, robot=OTHER, payload_kg=3.0) == {"monday.csv": "accepted"}
    assert f"measured/{OTHER}/runs.parquet.dvc" in on_the_branch(project)
    version = client.get_model_version_by_alias(registered_name(OTHER), "champion")
    assert client.get_run(version.run_id).data.tags["robot"] == OTHER

    # While somebody looks at the branch, nothing can be added to it.
    put(inbox, "thursday.csv", 25)
    run("git", "checkout", "-q", BRANCH, cwd=project)
    with pytest.raises(InputError, match=r"branch measurements is checked out here.*allowed: another branch"):
        ingest(project)
    assert (inbox / "thursday.csv").exists()


def _no_disk(*words: object) -> None:
    raise OSError("no disk")


def test_the_command_puts_logs_into_the_inbox(project: Path, tmp_path: Path):
    (tmp_path / "log.csv").write_text("time_s\n", encoding="utf-8")
    words = ["env", "-u", "PREFECT_API_URL", sys.executable, "-m", "flows.measurements"]
    run(*words, str(tmp_path / "log.csv"), cwd=project)
    assert [path.name for path in (project / ".desk/inbox").iterdir()] == ["log.csv"]
    said = run(*words, str(tmp_path / "log.csv"), cwd=project, code=2).stderr
    assert said == "flows.measurements: .desk/inbox: a log of this name waits there; allowed: another name\n"
    (tmp_path / ".log.csv").write_text("time_s\n", encoding="utf-8")  # the inbox does not look at those
    for name in ("log.txt", ".log.csv"):
        said = run(*words, str(tmp_path / name), cwd=project, code=2).stderr
        assert said == f"flows.measurements: {tmp_path}/{name}: this is not a log; allowed: a file ending with " + (
            ".csv, .parquet, .gz, and no dot before its name\n"
        )
