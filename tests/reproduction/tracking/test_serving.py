"""The registered predictor as it is used: by `--model`, and served by the commands of docs/operations.md."""

import json
import os
import pickle
import shutil
import zipfile
from functools import partial
from pathlib import Path

import pytest

from reproduction.config import load_params
from reproduction.layout import Layout
from reproduction.profile_predictor.training import MODEL
from reproduction.tracking.profile_predictor import REGISTERED, record_profile_predictor
from reproduction.tracking.store import connect, store_uri
from reproduction.tracking.trainings import load_estimator
from robojoule.profile.predicted import calibrated_predictor
from robojoule.profile.predictor_file import save_profile_predictor
from tests.conftest import ROOT, Background, answers, free_port, run, wait_for
from tests.profile.test_array_file import Bomb
from tests.reproduction.tracking.test_profile_predictor import TRAINING, predictions
from tests.test_docs import snippets

PARAMS = load_params(ROOT / "params.yaml")


@pytest.fixture(scope="module")
def registered(tmp_path_factory: pytest.TempPathFactory) -> Layout:
    """A folder whose registry has a champion."""
    layout = Layout(tmp_path_factory.mktemp("registry"))
    save_profile_predictor(calibrated_predictor(PARAMS.robot.robot()), layout.profile_predictor)
    layout.data_dir.mkdir()
    layout.features.write_bytes(b"what the record hashes")
    test = predictions(**{MODEL: 1.01, "random_forest": 1.1})
    record_profile_predictor(connect(layout), PARAMS, layout, test, TRAINING, {}, ["random_forest"])
    return layout


def test_a_champion_is_planned_with(registered: Layout, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    run("robojoule", "example", "cycle.yaml", cwd=registered.root)
    plan = ["robojoule", "optimize", "cycle.yaml", "--robot", PARAMS.robot.name, "--payload", "10", "--json"]
    plan += ["--cycle-time", "+20%", "--model"]
    found, expected = (
        json.loads(run(*plan, model, cwd=registered.root).stdout)
        for model in (f"models:/{REGISTERED}@champion", "models/profile_predictor")
    )
    assert found == expected and found["profiles"] == "predicted"
    refused = run(*plan, f"models:/{REGISTERED}@challenger", cwd=registered.root, code=2).stderr
    assert f"'models:/{REGISTERED}@challenger' cannot be fetched" in refused and refused.count("\n") == 1


@pytest.mark.parametrize("place", ["predictor.npz", "python_model.pkl"])
def test_a_model_that_holds_a_bomb_runs_nothing(registered: Layout, monkeypatch: pytest.MonkeyPatch, place: str):
    """A version that somebody else registered: pickled code in place of the arrays, and beside them."""
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    harmed = registered.root / "harmed"
    folder = registered.root / f"hostile-{place}"
    shutil.copytree(registered.profile_predictor, folder)
    (folder / place).write_bytes(pickle.dumps(Bomb(harmed)))
    (folder / "MLmodel").write_text("flavors: {python_function: {loader_module: harm, python_model: python_model.pkl}}")
    client = connect(registered).MlflowClient()
    name = f"hostile-{place.partition('.')[0]}"
    client.create_registered_model(name)
    client.create_model_version(name, source=folder.as_uri())
    client.set_registered_model_alias(name, "champion", "1")
    run("robojoule", "example", "cycle.yaml", "--out", f"{place}.yaml", cwd=registered.root)
    plan = ["robojoule", "optimize", f"{place}.yaml", "--robot", PARAMS.robot.name, "--payload", "10"]
    plan += ["--cycle-time", "+20%", "--model", f"models:/{name}@champion"]
    code = 2 if place == "predictor.npz" else 0
    said = run(*plan, cwd=registered.root, code=code).stderr
    assert code == 0 or ("does not hold a predictor" in said and said.count("\n") == 1)
    assert not harmed.exists()


def test_pickled_models_and_lists_of_types_of_others_are_refused(
    registered: Layout, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    """Forests that somebody else registered; without the switch of desk.env the first one would go off."""
    import mlflow
    import skops.io

    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    client = connect(registered).MlflowClient()
    client.create_registered_model("random-forest")
    harmed = tmp_path / "harmed"
    skops.io.dump(partial(os.mkdir, str(harmed)), tmp_path / "model.skops")
    bombs = {"pickle": pickle.dumps(Bomb(harmed)), "skops": (tmp_path / "model.skops").read_bytes()}
    for number, (kind, content) in enumerate(bombs.items(), start=1):
        folder = tmp_path / kind
        folder.mkdir()
        (folder / "model.skops").write_bytes(content)
        kept = f"{{pickled_model: model.skops, serialization_format: {kind}, skops_trusted_types: [posix.mkdir]}}"
        (folder / "MLmodel").write_text(f"flavors: {{sklearn: {kept}}}", encoding="utf-8")
        client.create_model_version("random-forest", source=folder.as_uri())
        with pytest.raises(mlflow.exceptions.MlflowException, match="MLFLOW_ALLOW_PICKLE_DESERIALIZATION"):
            mlflow.sklearn.load_model(f"models:/random-forest/{number}")
        with pytest.raises((TypeError, zipfile.BadZipFile)):
            load_estimator(mlflow, f"models:/random-forest/{number}")
        assert not harmed.exists()
    monkeypatch.setenv("MLFLOW_ALLOW_PICKLE_DESERIALIZATION", "true")
    mlflow.sklearn.load_model("models:/random-forest/1")
    assert harmed.exists()


def test_it_answers_the_request_of_the_page(
    registered: Layout, background: Background, monkeypatch: pytest.MonkeyPatch
):
    (page,) = snippets(ROOT / "docs/operations.md", "console serve")
    serve, ask = page.commands
    port = free_port()
    monkeypatch.setenv("MLFLOW_TRACKING_URI", store_uri(registered))
    assert "5001" in serve and "5001" in ask and REGISTERED in serve
    log = Path(registered.root) / "serve.log"
    background.start(serve.removesuffix("&").replace("5001", str(port)), registered.root, log)
    wait_for("the model's server", lambda: answers(f"http://127.0.0.1:{port}/ping"), 180)
    (row,) = json.loads(run("bash", "-c", ask.replace("5001", str(port)), cwd=registered.root).stdout)["predictions"]
    assert set(row) == {"duration_s", "energy_j", "lower_j", "upper_j"}
    assert 0.0 < row["lower_j"] < row["energy_j"] < row["upper_j"]
    shown = json.loads(page.text.splitlines()[-1])["predictions"][0]
    assert row["duration_s"] == pytest.approx(shown["duration_s"], abs=1e-4)  # physics alone: of any predictor
