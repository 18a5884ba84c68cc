"""The store of MLflow: made once, however many trainings come first."""

import multiprocessing

import pytest

from reproduction.layout import Layout
from reproduction.tracking.store import connect


def first_training(layout, start):
    start.wait()
    mlflow = connect(layout)
    with mlflow.start_run():
        mlflow.log_metric("x", 1.0)


def test_first_trainings_at_the_same_instant(tmp_path):
    """Three processes, a fresh folder: all of them record, in one experiment."""
    pytest.importorskip("fcntl")
    import mlflow  # before the processes part, as it takes long

    context = multiprocessing.get_context("fork")
    layout, start = Layout(tmp_path), context.Barrier(3)
    trainings = [context.Process(target=first_training, args=(layout, start)) for _ in range(3)]
    for training in trainings:
        training.start()
    for training in trainings:
        training.join(180)
    assert [training.exitcode for training in trainings] == [0, 0, 0]
    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{layout.mlflow_store}")
    (experiment,) = [one for one in client.search_experiments() if one.name != "Default"]
    assert len(client.search_runs([experiment.experiment_id])) == 3
