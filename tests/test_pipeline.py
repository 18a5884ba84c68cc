"""The whole pipeline on a toy: `dvc repro` for real, then the flow, then again with changed parameters."""

import csv
import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pyarrow.parquet as pq
import pytest
import yaml

from tests.conftest import ROOT, run
from tests.test_dvc_files import PIPELINE, entries, pipeline
from tests.test_house import unknown_columns
from tests.toy import merge


def outputs() -> list[str]:
    return [path for stage in pipeline().values() for path, _ in entries(stage, "outs", "plots", "metrics")]


def stages_to_run(folder: Path) -> list[str]:
    """Stages that DVC finds out of date, in order, without running them."""
    status = json.loads(run("dvc", "status", "--json", cwd=folder).stdout)
    return [name for name in PIPELINE if name in status]


@contextmanager
def changed(path: Path, change: Callable[[str], str]) -> Iterator[None]:
    """A file of the project with another text for a while; one that is not there is made."""
    before = path.read_text(encoding="utf-8") if path.exists() else None
    path.write_text(change(before or ""), encoding="utf-8")
    try:
        yield
    finally:
        path.unlink() if before is None else path.write_text(before, encoding="utf-8")


def test_every_output_is_there(reproduced: Path):
    missing = [path for path in outputs() if not (reproduced / path).exists()]
    assert missing == []


def test_git_sees_the_small_results_only(reproduced: Path):
    lines = run("git", "status", "--porcelain", "--untracked-files=all", cwd=reproduced).stdout.splitlines()
    small = {path for stage in pipeline().values() for path, cached in entries(stage, "outs", "metrics") if not cached}
    results = {line[3:] for line in lines if line[3:].startswith(("data/", "models/", "reports/", "dvc", ".dvc"))}
    assert results == {"dvc.lock", *small}


def test_a_second_run_does_nothing(reproduced: Path):
    lock = (reproduced / "dvc.lock").read_bytes()
    output = run("dvc", "repro", cwd=reproduced).stdout
    assert "Running stage" not in output
    assert all(f"Stage '{name}' didn't change" in output for name in PIPELINE)
    assert (reproduced / "dvc.lock").read_bytes() == lock


@pytest.mark.parametrize(
    ("change", "first"),
    [
        ({"draw_figures": {"dpi": 90}}, ["draw_figures"]),
        ({"train_predictors": {"random_forest": {"n_estimators": 9}}}, ["train_predictors"]),
        ({"train_profile_predictor": {"runs_per_motion": 2}}, ["train_profile_predictor"]),
        ({"evaluate_plans": {"predicted_speed_limits": 40}}, ["evaluate_plans"]),
    ],
)
def test_a_changed_parameter_reaches_its_stage_alone(reproduced: Path, change: dict, first: list[str]):
    """What follows runs only if the outputs of the stage come out different."""
    with changed(reproduced / "params.yaml", lambda text: yaml.safe_dump(merge(yaml.safe_load(text), change))):
        assert stages_to_run(reproduced) == first


@pytest.mark.parametrize(
    ("file", "first"),
    [
        ("robojoule/cli/profile.py", []),
        ("robojoule/api.py", []),
        ("robojoule/plots/pareto.py", []),
        ("robojoule/plots/style.py", ["draw_figures"]),
        ("robojoule/formats/registry.py", ["evaluate_plans", "draw_figures"]),
        ("robojoule/planning/solver.py", ["evaluate_plans", "draw_figures"]),
        ("robojoule/catalog/ur_ur10e.json", ["evaluate_plans", "draw_figures"]),
        ("reproduction/report/labels.py", ["draw_figures"]),
        ("reproduction/predictors/estimators.py", ["train_predictors"]),
        ("reproduction/profile_predictor/fit.py", ["train_profile_predictor"]),
        ("reproduction/experiment/gaps.py", ["evaluate_plans"]),
        ("reproduction/study/plant.py", []),
        ("reproduction/tracking/store.py", []),
        ("robojoule/profile/trained/note.json", []),
        ("data/README.md", []),
    ],
)
def test_changed_code_reaches_the_stages_that_use_it(reproduced: Path, file: str, first: list[str]):
    (reproduced / file).parent.mkdir(exist_ok=True)
    with changed(reproduced / file, lambda text: f"{text}\n"):
        assert stages_to_run(reproduced) == first


def test_another_version_of_a_package_reaches_the_stages_that_use_it(reproduced: Path):
    with changed(reproduced / "versions.yaml", lambda text: re.sub("duckdb: .*", "duckdb: 0.1", text)):
        assert stages_to_run(reproduced) == ["build_features", "draw_figures"]


def test_every_column_is_in_the_nomenclature(reproduced: Path):
    missing: dict[str, list[str]] = {}
    files = [*(reproduced / "data").rglob("*.parquet"), *(reproduced / "reports").rglob("*.csv")]
    for path in files:
        if path.suffix == ".csv":
            with path.open(newline="", encoding="utf-8") as file:
                columns = next(csv.reader(file))
        else:
            columns = pq.read_schema(path).names
        if unknown := unknown_columns(columns):
            missing[path.relative_to(reproduced).as_posix()] = unknown
    assert missing == {}, missing


def test_bad_parameters_stop_the_pipeline_before_any_work(reproduced: Path):
    with changed(reproduced / "params.yaml", lambda text: text.replace("sample_rate_hz", "sample_rate")):
        done = run("python", "-m", "stages.simulate_motions", cwd=reproduced, code=2)
        assert len(done.stderr.strip().splitlines()) == 1
        assert "params.yaml" in done.stderr and "simulate_motions.sample_rate" in done.stderr


def test_table_6_1_is_printed(reproduced: Path):
    output = run("python", "-m", "stages.show_table", cwd=reproduced).stdout
    assert "predicted_three_segment" in output and "thesis, predicted" in output and "110 %" in output


def test_the_readme_names_the_stages():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in PIPELINE)
