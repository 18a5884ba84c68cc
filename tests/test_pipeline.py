"""The whole pipeline on a toy: `dvc repro` for real, then the flow, then again with changed parameters."""

import csv
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest
import yaml

from tests.conftest import ROOT, merge, run
from tests.test_house import STAGES, entries, stages, unknown_columns


def outputs() -> list[str]:
    return [path for stage in stages().values() for path, _ in entries(stage, "outs", "plots", "metrics")]


def stages_to_run(folder: Path) -> list[str]:
    """Stages that DVC finds out of date, in order, without running them."""
    status = json.loads(run("dvc", "status", "--json", cwd=folder).stdout)
    return [name for name in STAGES if name in status]


def test_every_output_is_there(reproduced: Path):
    missing = [path for path in outputs() if not (reproduced / path).exists()]
    assert missing == []


def test_git_sees_the_small_results_only(reproduced: Path):
    lines = run("git", "status", "--porcelain", "--untracked-files=all", cwd=reproduced).stdout.splitlines()
    small = {path for stage in stages().values() for path, cached in entries(stage, "outs", "metrics") if not cached}
    results = {line[3:] for line in lines if line[3:].startswith(("data/", "models/", "reports/", "dvc", ".dvc"))}
    assert results == {"dvc.lock", *small}


def test_a_second_run_does_nothing(reproduced: Path):
    lock = (reproduced / "dvc.lock").read_bytes()
    output = run("dvc", "repro", cwd=reproduced).stdout
    assert "Running stage" not in output
    assert all(f"Stage '{name}' didn't change" in output for name in STAGES)
    assert (reproduced / "dvc.lock").read_bytes() == lock


@pytest.mark.parametrize(
    ("change", "first"),
    [
        ({"draw_figures": {"dpi": 90}}, ["draw_figures"]),
        ({"train_predictors": {"random_forest": {"n_estimators": 9}}}, ["train_predictors"]),
    ],
)
def test_a_changed_parameter_reaches_its_stage_alone(reproduced: Path, change: dict, first: list[str]):
    """What follows runs only if the outputs of the stage come out different."""
    params = reproduced / "params.yaml"
    before = params.read_text(encoding="utf-8")
    params.write_text(yaml.safe_dump(merge(yaml.safe_load(before), change), sort_keys=False), encoding="utf-8")
    try:
        assert stages_to_run(reproduced) == first
    finally:
        params.write_text(before, encoding="utf-8")


def test_every_column_stands_in_the_nomenclature(reproduced: Path):
    missing: dict[str, list[str]] = {}
    files = [*(reproduced / "data").rglob("*.parquet"), *(reproduced / "reports/tables").glob("*.csv")]
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
    params = reproduced / "params.yaml"
    before = params.read_text(encoding="utf-8")
    params.write_text(before.replace("sample_rate_hz", "sample_rate"), encoding="utf-8")
    try:
        done = run("python", "-m", "stages.simulate_motions", cwd=reproduced, code=2)
        assert len(done.stderr.strip().splitlines()) == 1
        assert "params.yaml" in done.stderr and "simulate_motions.sample_rate" in done.stderr
    finally:
        params.write_text(before, encoding="utf-8")


def test_table_6_1_is_printed(reproduced: Path):
    output = run("python", "-m", "stages.show_table", cwd=reproduced).stdout
    assert "predicted_three_segment" in output and "thesis, predicted" in output and "110 %" in output


def test_the_readme_names_the_stages():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in STAGES)
