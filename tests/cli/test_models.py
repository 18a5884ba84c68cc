"""`--model`: a trained predictor from a folder or from the registry of MLflow."""

import json
import shutil
from pathlib import Path

import pytest

from robojoule.cli import main
from robojoule.profile.predicted import calibrated_predictor
from robojoule.profile.predictor_file import save_profile_predictor
from robojoule.profile.reference import TRAINED
from robojoule.robots import load_robot
from tests.conftest import ROOT

NAME = "kuka_kr16_r2010_2"
PLAN = ["optimize", "cycle.yaml", "--robot", NAME, "--payload", "10", "--cycle-time", "+20%", "--json"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    shutil.copy(ROOT / "robojoule/examples/cycle.yaml", "cycle.yaml")
    return tmp_path


def plan(capsys: pytest.CaptureFixture, *words: str) -> dict:
    assert main([*PLAN, *words]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def refused(capsys: pytest.CaptureFixture, *words: str) -> str:
    assert main([*PLAN, *words]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_the_trained_model_named_by_its_folder_plans_as_the_one_within(capsys: pytest.CaptureFixture):
    expected = plan(capsys, "--profiles", "predicted")
    assert expected["profiles"] == "predicted"
    assert plan(capsys, "--model", str(TRAINED / NAME)) == expected


def test_another_model_gives_another_plan(capsys: pytest.CaptureFixture, folder: Path):
    """That of the bare entry is less sure of itself."""
    save_profile_predictor(calibrated_predictor(load_robot(NAME, payload_kg=10.0)), folder / "entry")
    found, trained = plan(capsys, "--model", "entry"), plan(capsys, "--profiles", "predicted")
    widths = [one["outlook"]["saving_high_percent"] - one["outlook"]["saving_low_percent"] for one in (found, trained)]
    assert widths[0] > widths[1]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--model", "nowhere"], "predictor.json: there is no such file"),
        (
            ["--model", str(TRAINED / NAME), "--profiles", "simulated"],
            "a model serves predicted profiles, not simulated",
        ),
        (["--model", "models:/energy-profile@champion"], "no registry of MLflow is known; allowed: the folder of the"),
    ],
)
def test_models_that_cannot_be_had_are_one_sentence(capsys: pytest.CaptureFixture, words: list[str], message: str):
    assert message in refused(capsys, *words)


def test_a_model_of_another_robot_is_refused(capsys: pytest.CaptureFixture, folder: Path):
    save_profile_predictor(calibrated_predictor(load_robot("ur_ur10e")), folder / "ur10e")
    assert "ur_ur10e" in refused(capsys, "--model", "ur10e")


def test_without_mlflow_the_extra_is_named(capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("robojoule.errors.find_spec", lambda name: None)
    said = refused(capsys, "--model", "models:/energy-profile@champion")
    assert "needs mlflow, which is not installed: pip install 'robojoule[pipeline]'" in said


def told(capsys: pytest.CaptureFixture, *words: str) -> dict:
    assert main([*words, "--robot", NAME, "--payload", "10", "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


MOTION = ["profile", "--from", "0,-90,90,0,0,0", "--to", "45,-60,70,0,30,0"]
COMMANDS = {
    "profile of a motion": MOTION,
    "profile of a move": ["profile", "cycle.yaml", "--move", "to belt"],
    "pareto": ["pareto", "cycle.yaml"],
}


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_every_command_with_predicted_profiles_takes_a_model(
    capsys: pytest.CaptureFixture, folder: Path, words: list[str]
):
    save_profile_predictor(calibrated_predictor(load_robot(NAME, payload_kg=10.0)), folder / "entry")
    trained = told(capsys, *words, "--profiles", "predicted")
    assert told(capsys, *words, "--model", str(TRAINED / NAME)) == trained
    assert told(capsys, *words, "--model", "entry") != trained


def test_a_plan_is_adjusted_by_a_model(capsys: pytest.CaptureFixture, folder: Path):
    made = plan(capsys, "--model", str(TRAINED / NAME), "--out", "plan.yaml")
    words = ["adjust", "plan.yaml", "--measured-cycle", str(1.01 * made["cycle_time_s"])]
    assert told(capsys, *words)["profiles"] == "simulated"
    assert told(capsys, *words, "--model", str(TRAINED / NAME))["profiles"] == "predicted"
    save_profile_predictor(calibrated_predictor(load_robot("ur_ur10e")), folder / "ur10e")
    assert main([*words, "--robot", NAME, "--payload", "10", "--model", "ur10e"]) == 2
    assert "ur_ur10e" in capsys.readouterr().err


@pytest.mark.parametrize("words", [*COMMANDS.values(), ["adjust", "cycle.yaml", "--measured-cycle", "9"]])
def test_a_registry_that_is_not_there_is_one_sentence_of_every_command(capsys: pytest.CaptureFixture, words: list[str]):
    assert main([*words, "--robot", NAME, "--payload", "10", "--model", "models:/energy-profile@champion"]) == 2
    error = capsys.readouterr().err
    assert "no registry of MLflow is known" in error and error.count("\n") == 1
