"""The wheel as a user gets it: the library alone, in an environment of its own, far from this folder."""

import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from dataclasses import dataclass
from email import message_from_bytes
from pathlib import Path

import pyarrow as pa
import pytest
import yaml
from pyarrow import csv, parquet

from robojoule import __version__
from robojoule.cli import COMMANDS
from robojoule.robots import list_robots
from tests.calibration.plant import ROBOT, Plant, make_log
from tests.conftest import ROOT, run
from tests.test_docs import snippets

HEAVY = {"dvc", "duckdb", "matplotlib", "mlflow", "pandas", "prefect", "pyarrow", "sklearn"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = ["uv", "build", "--wheel", "--no-build-isolation", "--python", sys.executable]
    run(*build, "--out-dir", str(folder), cwd=ROOT)
    (path,) = folder.glob("*.whl")
    return path


@dataclass(frozen=True)
class Installed:
    """An environment that holds the wheel and its core dependencies, and an empty folder to work in."""

    programs: Path
    folder: Path

    def run(self, *command: str, code: int = 0) -> subprocess.CompletedProcess[str]:
        """Run a program of the environment, in the folder, without a trace of this project's environment."""
        variables = {key: os.environ[key] for key in ("HOME", "LANG", "TMPDIR") if key in os.environ}
        program = str(self.programs / command[0])
        words = [program, *command[1:]]
        done = subprocess.run(words, cwd=self.folder, env=variables, capture_output=True, text=True, check=False)
        assert done.returncode == code, f"{command}: exit {done.returncode}\n{done.stdout}{done.stderr}"
        return done


@pytest.fixture(scope="module")
def programs(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Dependencies come as uv.lock pins them; that they are those of the wheel is checked."""
    environment = tmp_path_factory.mktemp("environment") / "user"
    sync = ["uv", "sync", "--frozen", "--no-default-groups", "--no-install-project", "--python", sys.executable]
    run("env", f"UV_PROJECT_ENVIRONMENT={environment}", *sync, cwd=ROOT)
    python = ["--python", str(environment / "bin/python")]
    run("uv", "pip", "install", "--no-deps", *python, str(wheel), cwd=wheel.parent)
    run("uv", "pip", "check", *python, cwd=wheel.parent)
    return environment / "bin"


@pytest.fixture
def installed(programs: Path, tmp_path: Path) -> Installed:
    return Installed(programs, tmp_path)


def test_the_wheel_holds_the_library_alone(wheel: Path):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert {name.split("/")[0] for name in names} == {"robojoule", f"robojoule-{__version__}.dist-info"}
    files = subprocess.run(["git", "ls-files", "robojoule"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert sorted(name for name in names if name.startswith("robojoule/")) == sorted(files.stdout.split())
    assert "robojoule/py.typed" in names


def test_the_metadata_is_complete(wheel: Path):
    with zipfile.ZipFile(wheel) as archive:
        metadata = message_from_bytes(archive.read(f"robojoule-{__version__}.dist-info/METADATA"))
    assert metadata["Version"] == __version__
    assert metadata["License-Expression"] == "Apache-2.0"
    assert all(metadata[key] for key in ("Summary", "Keywords", "Author", "Requires-Python"))
    assert "Typing :: Typed" in metadata.get_all("Classifier", [])
    assert metadata.get_all("Provides-Extra") == [
        "auth",
        "cells",
        "dask",
        "parquet",
        "pipeline",
        "plot",
        "postgres",
        "ray",
    ]
    core = {re.match(r"[\w-]+", text)[0] for text in metadata.get_all("Requires-Dist", []) if "extra ==" not in text}
    assert not HEAVY & core and {"numpy", "pyomo"} <= core


def test_the_citation_agrees_with_the_package():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert (citation["title"], citation["license"]) == (project["name"], project["license"])
    assert [author["name"] for author in citation["authors"]] == [author["name"] for author in project["authors"]]
    assert "version" not in citation, "the version stands in robojoule/__init__.py alone"


def test_every_command_works_in_an_empty_environment(installed: Installed):
    (block,) = snippets(ROOT / "docs/operation-tree.md", "yaml operation-tree")
    (installed.folder / "cycle.yaml").write_text(block.text, encoding="utf-8")
    columns, _ = make_log(Plant(21), 21, motions=20)
    csv.write_csv(pa.table(columns), installed.folder / "log.csv")
    (installed.folder / "cell.yaml").write_bytes((ROOT / "robojoule/examples/cell.yaml").read_bytes())
    robot = ["--robot", ROBOT, "--payload", "10", "--json"]
    motion = ["--from", "0,-90,90,0,0,0", "--to", "60,-60,90,0,30,0"]
    calls = {
        "example": ["positions.csv", "--json"],
        "robots": ["--json"],
        "profile": [*robot, *motion],
        "simulate": ["positions.csv", *robot],
        "optimize": ["cycle.yaml", *robot, "--cycle-time", "+10%", "--out", "slower.yaml"],
        "adjust": ["slower.yaml", *robot, "--measured-cycle", "4.3"],
        "pareto": ["cycle.yaml", *robot, "--csv", "pareto.csv"],
        "identify": ["log.csv", *robot, "--out", "identified.json"],
        "convert": ["cycle.yaml", "cycle.src", "--robot", ROBOT, "--json"],
        "cell": ["solve", "cell.yaml", "--out", "cell_plan.json", "--json"],
    }
    assert calls.keys() == COMMANDS.keys()
    results = {name: json.loads(installed.run("robojoule", name, *words).stdout) for name, words in calls.items()}
    assert [row["name"] for row in results["robots"]["robots"]] == list_robots()
    assert 0.0 < results["optimize"]["saving_percent"] < 40.0
    assert results["identify"]["held_out"]["rmse_percent"] < 5.0
    written = {
        "positions.csv",
        "slower.yaml",
        "pareto.csv",
        "identified.json",
        "cell_plan.json",
        "cycle.src",
        "cycle.dat",
    }
    assert {path.name for path in installed.folder.iterdir()} == {"cycle.yaml", "log.csv", "cell.yaml", *written}


def test_the_example_of_the_readme_works_in_an_empty_environment(installed: Installed):
    (example,) = snippets(ROOT / "README.md", "python door")
    assert installed.run("python", "-m", "robojoule", "example", "cycle.yaml").stdout == "written to cycle.yaml\n"
    saving, energy, _ = map(float, installed.run("python", "-c", example.text).stdout.split())
    assert 0.0 < saving < 40.0 < energy
    assert (installed.folder / "slower.yaml").exists()


def test_a_missing_extra_is_said_in_one_sentence(installed: Installed):
    parquet.write_table(pa.table({"time_s": [0.0, 1.0]}), installed.folder / "log.parquet")
    motion = ["--from", "0,-90,90,0,0,0", "--to", "60,-60,90,0,30,0"]
    plot = installed.run("robojoule", "profile", "--robot", ROBOT, *motion, "--plot", "energy.svg", code=2)
    assert plot.stderr == (
        "robojoule profile: --plot needs matplotlib, which is not installed: pip install 'robojoule[plot]'\n"
    )
    log = installed.run("robojoule", "identify", "log.parquet", "--robot", ROBOT, code=2)
    assert log.stderr == (
        "robojoule identify: reading Parquet needs pyarrow, which is not installed: pip install 'robojoule[parquet]'\n"
    )
    assert not (installed.folder / "energy.svg").exists()


def test_importing_the_library_loads_no_heavy_module(installed: Installed):
    loaded = installed.run("python", "-c", "import sys, robojoule; print(robojoule.__file__, *sys.modules)").stdout
    assert str(installed.programs.parent) in loaded.split()[0]
    assert not (HEAVY | {"pinocchio", "pyomo", "scipy"}) & set(loaded.split())
