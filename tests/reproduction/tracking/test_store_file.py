"""The look into the store's file says what MLflow says of it."""

import sqlite3
from pathlib import Path

import pytest

from reproduction.layout import Layout
from reproduction.tracking.store import PIPELINE, RecordedRun, connect, find_run, store_uri
from reproduction.tracking.store_file import newest_run

TAGS = {"data_hash": "d" * 32, "model": "random_forest", "git_commit": "c" * 40}


def test_the_newest_finished_run_is_found_as_mlflow_finds_it(tmp_path: Path):
    layout = Layout(tmp_path)
    mlflow = connect(layout)
    client = mlflow.MlflowClient(tracking_uri=store_uri(layout))
    experiment = client.get_experiment_by_name(PIPELINE).experiment_id

    def run(start: int, status: str = "FINISHED", **tags: str) -> str:
        made = client.create_run(experiment, start_time=start, tags=TAGS | tags)
        client.set_terminated(made.info.run_id, status)
        return str(made.info.run_id)

    run(1)
    newest = run(3, git_commit="b" * 40)
    run(2)
    run(4, status="FAILED")
    run(5, data_hash="e" * 32)
    run(6, model="neural_network")
    client.delete_run(run(7))
    asked = " and ".join(f"tags.{key} = '{TAGS[key]}'" for key in ("data_hash", "model"))
    (first, *_) = client.search_runs(
        [experiment], f"{asked} and attributes.status = 'FINISHED'", order_by=["attributes.start_time DESC"]
    )
    assert first.info.run_id == newest
    expected = RecordedRun(newest, str(experiment), "random_forest", TAGS["data_hash"], "b" * 40)
    assert find_run(layout, "random_forest", TAGS["data_hash"]) == expected
    assert find_run(layout, "random_forest", TAGS["data_hash"], config="f" * 32) is None


def test_a_file_that_is_kept_otherwise_is_an_error_of_sqlite(tmp_path: Path):
    with sqlite3.connect(tmp_path / "store.db") as store:
        store.execute("CREATE TABLE runs (run_uuid TEXT)")
    with pytest.raises(sqlite3.Error):
        newest_run(tmp_path / "store.db", PIPELINE, {"model": "random_forest"}, "git_commit")
    with pytest.raises(sqlite3.Error):
        newest_run(tmp_path / "nothing.db", PIPELINE, {"model": "random_forest"}, "git_commit")
    assert not (tmp_path / "nothing.db").exists()
