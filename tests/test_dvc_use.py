"""DVC as people use it: a remote and a fresh clone, a sweep, figures that fit a screen, a checkout without Git."""

import json
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from tests.conftest import ROOT, run
from tests.reproduction.study.cases import small_study
from tests.test_kernels import ALL_STAGES

IDENTITY = ("-c", "user.name=toy", "-c", "user.email=toy@example.org")


@pytest.fixture(scope="module")
def pushed(reproduced: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A clone of the reproduced project with the results of the pipeline pulled from the store beside it."""
    project = tmp_path_factory.mktemp("pushed") / "project"
    shutil.copytree(reproduced, project, symlinks=True)
    run("git", "add", "-A", cwd=project)
    run("git", *IDENTITY, "commit", "-qm", "Results", cwd=project)
    run("dvc", "push", "dvc.yaml", cwd=project)
    assert (project.parent / "robojoule-store").is_dir()
    clone = project.with_name("clone")
    run("git", "clone", "-q", str(project), str(clone), cwd=project)
    run("dvc", "pull", "dvc.yaml", cwd=clone)
    return clone


def test_a_fresh_clone_has_the_results_and_nothing_to_do(pushed: Path, reproduced: Path):
    assert "up to date" in run("dvc", "status", "dvc.yaml", cwd=pushed).stdout
    assert (pushed / "reports/index.html").read_bytes() == (reproduced / "reports/index.html").read_bytes()
    assert run("git", "status", "--porcelain", cwd=pushed).stdout == ""


def test_push_and_pull_without_a_target_bring_the_studies_too(reproduced: Path, tmp_path: Path):
    """After both were run; of the studies one is enough here."""
    project, clone = tmp_path / "project", tmp_path / "clone"
    shutil.copytree(reproduced, project, symlinks=True)
    studies = project / "studies"
    stages = yaml.safe_load((studies / "dvc.yaml").read_text(encoding="utf-8"))["stages"]
    one = {"stages": {"evaluate_robots": stages["evaluate_robots"]}}
    (studies / "dvc.yaml").write_text(yaml.safe_dump(one, sort_keys=False), encoding="utf-8")
    params = small_study().model_dump(mode="json")
    params["evaluate_robots"] |= {"robots": ["ur_ur5e", "kuka_kr16_r1610_2"], "test_trees": 1, "measured_motions": [0]}
    (studies / "params.yaml").write_text(yaml.safe_dump(params), encoding="utf-8")
    (studies / "dvc.lock").unlink()
    for words in (["repro", "studies/dvc.yaml"], ["repro"], ["push"]):
        run("dvc", *words, cwd=project)
    run("git", "add", "-A", cwd=project)
    run("git", *IDENTITY, "commit", "-qm", "Results and studies", cwd=project)
    run("git", "clone", "-q", str(project), str(clone), cwd=project)
    run("dvc", "pull", cwd=clone)
    assert "up to date" in run("dvc", "status", cwd=clone).stdout
    for file in ("studies/data/robots_plans.parquet", "data/plans.parquet"):
        assert (clone / file).read_bytes() == (project / file).read_bytes()
    assert run("git", "status", "--porcelain", cwd=clone).stdout == ""


def test_metrics_fit_a_screen(pushed: Path):
    lines = run("dvc", "metrics", "show", cwd=pushed).stdout.splitlines()
    assert len(lines) == 2
    assert max(map(len, lines)) <= 80
    figures = json.loads((pushed / "reports/headline.json").read_text(encoding="utf-8"))
    assert lines[0].split()[1:] == sorted(figures)


def test_plots_load_nothing_from_elsewhere(pushed: Path, tmp_path: Path):
    run("dvc", "plots", "show", "--out", str(tmp_path / "plots"), cwd=pushed)
    page = (tmp_path / "plots/index.html").read_text(encoding="utf-8")
    assert page.count("<img") == len(list((pushed / "reports/figures").iterdir()))
    assert re.findall(r"""(?:src|href)=["']?https?:""", page) == []


def test_a_sweep_shows_its_runs_beside_each_other(pushed: Path):
    run("dvc", "exp", "run", "-n", "small", "-S", "train_predictors.random_forest.n_estimators=3", cwd=pushed)
    table = run("dvc", "exp", "show", "--json", cwd=pushed).stdout
    (baseline,) = [one for one in json.loads(table) if one["rev"] != "workspace"]
    (small,) = [found for one in baseline["experiments"] for found in one["revs"]]

    def values(row: dict, kind: str, file: str) -> dict:
        return row["data"][kind][file]["data"]

    forests = [values(row, "params", "params.yaml")["train_predictors"]["random_forest"] for row in (baseline, small)]
    assert [forest["n_estimators"] for forest in forests] == [8, 3]
    errors = [values(row, "metrics", "reports/headline.json")["forest_error"] for row in (baseline, small)]
    assert errors[0] != errors[1]


def test_another_robot_runs_at_once(reproduced: Path, tmp_path: Path):
    """Its payloads above the rating are left out with a note, and what the thesis says of a KUKA is not judged."""
    folder = tmp_path / "other robot"
    shutil.copytree(reproduced / "studies", folder / "studies")
    shutil.copy(reproduced / "params.yaml", folder)
    params = yaml.safe_load((folder / "params.yaml").read_text(encoding="utf-8"))
    params["robot"]["name"] = "ur_ur10e"
    params["evaluate_plans"] |= {"payload_sensitivity_kg": [10, 16], "relaxations_percent": [120]}
    (folder / "params.yaml").write_text(yaml.safe_dump(params, sort_keys=False), encoding="utf-8")
    said = run(sys.executable, "-c", ALL_STAGES, str(folder), cwd=ROOT).stdout  # by DVC: tests/flows/test_events.py
    assert "ur_ur10e is not rated for 16 kg: left out of the sensitivity to the payload" in said
    assert (folder / "reports/tables/claims.csv").read_text(encoding="utf-8").count("\n") == 1
    assert (folder / "reports/tables/energy_model.csv").read_text(encoding="utf-8").count("\n") == 1
    page = (folder / "reports/index.html").read_text(encoding="utf-8")
    assert "No claims are judged" in page and "ur_ur10e" in page


def test_a_checkout_without_git_runs(reproduced: Path, tmp_path: Path):
    """As from a downloaded archive: `make` tells DVC once."""
    folder = tmp_path / "archive"
    shutil.copytree(reproduced, folder, symlinks=True, ignore=shutil.ignore_patterns(".git", "tmp"))
    shutil.copy(ROOT / "Makefile", folder)
    assert run("dvc", "status", "dvc.yaml", cwd=folder, code=None).returncode != 0
    run("make", ".dvc/config.local", cwd=folder)
    assert "up to date" in run("dvc", "status", "dvc.yaml", cwd=folder).stdout
    assert "Running stage 'generate_trees'" in run("dvc", "repro", "-f", "-s", "generate_trees", cwd=folder).stdout


def test_with_git_nothing_is_told():
    assert "no_scm" not in run("make", "-n", "repro", cwd=ROOT).stdout
