"""The scripts and the notebook of examples/ run, in a folder of their own, and show figures."""

import re
import shutil
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from tests.conftest import ROOT, run

FOLDER = ROOT / "examples"
SCRIPTS = sorted(path.name for path in FOLDER.glob("*.py"))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(FOLDER, tmp_path / "examples")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path / "examples"


def test_there_are_scripts_and_all_are_listed():
    listed = re.findall(r"^\| `(.+?)` \| .+ \|$", (FOLDER / "README.md").read_text(encoding="utf-8"), re.M)
    assert len(SCRIPTS) >= 6
    assert sorted(listed) == sorted([*SCRIPTS, "trade_off.ipynb"])


@pytest.mark.parametrize("name", SCRIPTS)
def test_scripts_run(name: str, folder: Path):
    said = run(sys.executable, name, cwd=folder).stdout
    assert re.search(r"\d", said)
    assert "nan" not in said


def test_a_slower_controller_costs_energy_and_the_plan_is_on_time(folder: Path):
    said = run(sys.executable, "adjust_after_trial.py", cwd=folder).stdout
    planned, trial, again = (float(x) for x in re.findall(r"([\d.]+) s", said)[:3])
    assert trial > planned
    assert again == pytest.approx(3.0, abs=2e-3)


def test_a_folder_of_programs_is_planned(folder: Path):
    run(sys.executable, "folder_of_programs.py", cwd=folder)
    assert (folder / "planned/cycle.yaml").exists()


def test_the_notebook_runs(folder: Path):
    notebook = nbformat.read(folder / "trade_off.ipynb", as_version=4)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(folder)}}).execute()
    drawn = [one for cell in notebook.cells for one in cell.get("outputs", []) if "image/png" in one.get("data", {})]
    assert len(drawn) == 2
