"""The store of MLflow: made once and whole, however many trainings come first and whenever one of them is killed."""

import importlib
import multiprocessing
import os
import signal
import sqlite3
from pathlib import Path

import pytest

from reproduction.layout import Layout
from reproduction.tracking.store import TRIAL, connect, figures_of, open_store, promote, store_uri, trial
from robojoule.errors import InputError
from tests.conftest import ROOT, free_port, wait_for


def first_training(layout, start):
    importlib.import_module("mlflow")  # before the start, as it takes long
    start.wait()
    mlflow = connect(layout)
    with mlflow.start_run():
        mlflow.log_metric("x", 1.0)


def runs_in(layout: Layout) -> int:
    import mlflow

    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{layout.mlflow_store}")
    (experiment,) = [one for one in client.search_experiments() if one.name != "Default"]
    return len(client.search_runs([experiment.experiment_id]))


def test_first_trainings_at_the_same_instant(tmp_path, monkeypatch):
    """Three processes, a fresh folder: all of them record, in one experiment."""
    pytest.importorskip("fcntl")
    context = multiprocessing.get_context("spawn")  # nothing of what other tests left in this process
    for name in ("TRACKING_URI", "REGISTRY_URI", "EXPERIMENT_ID", "EXPERIMENT_NAME", "RUN_ID"):
        monkeypatch.delenv(f"MLFLOW_{name}", raising=False)  # MLflow itself leaves them there
    layout, start = Layout(tmp_path), context.Barrier(3)
    trainings = [context.Process(target=first_training, args=(layout, start)) for _ in range(3)]
    for training in trainings:
        training.start()
    for training in trainings:
        training.join(180)
    assert [training.exitcode for training in trainings] == [0, 0, 0]
    assert runs_in(layout) == 3


def tables_of(path: Path) -> int:
    """Tables that a store has so far."""
    try:
        with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as store:
            return store.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    except sqlite3.Error:
        return 0


@pytest.mark.parametrize("tables", [1, 12, 30])
def test_one_that_is_killed_while_it_makes_the_store_leaves_none(tmp_path, tables):
    """In the middle of MLflow's migrations, told by the tables that are there; the next one starts afresh."""
    pytest.importorskip("fcntl")
    import mlflow  # noqa: F401

    layout = Layout(tmp_path)
    maker = multiprocessing.get_context("fork").Process(target=open_store, args=(layout,))
    maker.start()

    def begun() -> bool:
        return any(tables_of(path) >= tables for path in layout.desk_dir.glob(".*.db"))

    wait_for("the first tables", lambda: begun() or not maker.is_alive(), 60)
    os.kill(maker.pid, signal.SIGKILL)
    maker.join()
    assert not layout.mlflow_store.exists(), "killed too late to show anything"
    with connect(layout).start_run():
        pass
    assert runs_in(layout) == 1
    assert not list(layout.desk_dir.glob(".*.db"))


def test_a_store_whose_making_was_cut_short_elsewhere_is_one_sentence(tmp_path):
    """As older versions left it: some tables are there, and the migration cannot make them again."""
    layout = Layout(tmp_path)
    open_store(layout)
    with sqlite3.connect(layout.mlflow_store) as store:
        store.execute("UPDATE alembic_version SET version_num = (SELECT '451aebb31d03')")
        store.execute("DROP TABLE trace_info")
    with pytest.raises(InputError, match=r"mlflow\.db: the record of MLflow cannot be used \(.*move it away") as caught:
        connect(layout)
    assert "\n" not in str(caught.value)


def test_an_older_store_is_told_with_the_command_that_mends_it(tmp_path):
    layout = Layout(tmp_path)
    open_store(layout)
    with sqlite3.connect(layout.mlflow_store) as store:
        store.execute("UPDATE alembic_version SET version_num = '451aebb31d03'")
    with pytest.raises(
        InputError, match=f"of an older version; allowed: it after `mlflow db upgrade {store_uri(layout)}"
    ):
        connect(layout)


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    (tmp_path / ".desk").write_text("a file", encoding="utf-8")
    with pytest.raises(InputError, match="folder of MLflow's store cannot be written"):
        connect(Layout(tmp_path))


def test_a_server_that_does_not_answer_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv("MLFLOW_TRACKING_URI", f"http://127.0.0.1:{free_port()}")
    with pytest.raises(InputError, match=r"cannot be used .*; allowed: a running server, or MLFLOW_TRACKING_URI unset"):
        connect(Layout(tmp_path))


def test_the_champion_before_is_kept_by_name(tmp_path):
    mlflow = connect(Layout(tmp_path))
    client = mlflow.MlflowClient()
    client.create_registered_model("energy-profile")
    for number in ("1", "2", "3"):
        client.create_model_version("energy-profile", source=tmp_path.as_uri())
        promote(mlflow, "energy-profile", number)
        promote(mlflow, "energy-profile", number)  # twice: it does not become its own predecessor
    found = client.get_registered_model("energy-profile").aliases
    assert {name: str(version) for name, version in found.items()} == {"champion": "3", "previous": "2"}


def test_a_registry_that_fails_is_told(tmp_path):
    """Else the champion before would be lost in silence."""
    mlflow = connect(Layout(tmp_path))
    with pytest.raises(mlflow.exceptions.MlflowException, match="energy-profile"):
        promote(mlflow, "energy-profile", "1")  # no such model


@pytest.mark.parametrize("variable", ["ROBOJOULE_TRIAL", "DVC_EXP_NAME"])
def test_a_trial_does_not_change_what_others_plan_with(tmp_path, monkeypatch, variable):
    mlflow = connect(Layout(tmp_path))
    client = mlflow.MlflowClient()
    client.create_registered_model("energy-profile")
    for number in ("1", "2"):
        client.create_model_version("energy-profile", source=tmp_path.as_uri())
        promote(mlflow, "energy-profile", number)
        monkeypatch.setenv(variable, "other robot")
    aliases = client.get_registered_model("energy-profile").aliases
    assert {name: str(version) for name, version in aliases.items()} == {"champion": "1"}


def test_a_trial_is_one_as_long_as_it_lasts(monkeypatch):
    monkeypatch.delenv(TRIAL, raising=False)
    with trial("other robot"):
        assert os.environ[TRIAL] == "other robot"
    assert TRIAL not in os.environ


def test_figures_are_named_as_in_the_metrics_file():
    """Each name leads to its value in reports/metrics.json."""
    import json

    metrics = json.loads((ROOT / "reports/metrics.json").read_text(encoding="utf-8"))
    found = figures_of("random_forest", metrics["predictors"])
    assert len(found) > 30
    for name, value in found.items():
        place = metrics
        for key in name.split("."):
            place = place[key]
        assert place == value
