"""`dvc.yaml` and `studies/dvc.yaml` say what the code does: dependencies, parameters, versions, outputs."""

import subprocess
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
import yaml

from reproduction.config import load_params
from tests.imports import ROOT, closure, imported_files, imports, relative

# Carries or records values but makes none, so no stage has to run again when it changes (dvc.yaml says so too): modules
# outside of a room, the command line of the stages, the record in MLflow.
PLUMBING = {
    *(
        f"reproduction/{name}.py"
        for name in ("__init__", "claims", "config", "layout", "parts", "pools", "scratch", "settings", "tables")
    ),
    *("reproduction/study/config.py", "reproduction/tracking"),
    *(f"robojoule/{name}.py" for name in ("__init__", "arrays", "documents", "errors", "inputs", "progress")),
    *("stages/__init__.py", "stages/cli.py"),
    *("robojoule/formats/vendor", "robojoule/page"),  # no stage reads programs in vendors' languages, or writes pages
}
# Plumbing whose packages decide how outputs are written.
WRITERS = {"reproduction/tables.py"}
PIPELINE = (
    *("generate_trees", "simulate_motions", "build_features", "train_profile_predictor", "train_predictors"),
    *("evaluate_plans", "draw_figures"),
)
STUDIES = ("compare_predictors", "evaluate_motions", "evaluate_robots", "judge_targets", "close_the_loop", "plan_cells")
STAGES = (*PIPELINE, *STUDIES)
MOST_DEPENDENCIES = 10
# Distributions in versions.yaml by the name under which they are imported, where that is another one or more than one:
# scikit-learn builds on SciPy, Pyomo solves with HiGHS.
DISTRIBUTIONS = {"pinocchio": {"pin"}, "sklearn": {"scikit-learn", "scipy"}, "pyomo": {"pyomo", "highspy"}}


@cache
def pipeline() -> dict[str, dict]:
    return yaml.safe_load((ROOT / "dvc.yaml").read_text(encoding="utf-8"))["stages"]


@cache
def studies() -> dict[str, dict]:
    return yaml.safe_load((ROOT / "studies/dvc.yaml").read_text(encoding="utf-8"))["stages"]


@cache
def both() -> dict[str, dict]:
    return pipeline() | studies()


@cache
def versions() -> dict[str, str | list[str]]:
    return yaml.safe_load((ROOT / "versions.yaml").read_text(encoding="utf-8"))


def entries(stage: dict, *keys: str) -> Iterator[tuple[str, bool]]:
    """Paths of outputs and whether DVC caches them."""
    for key in keys:
        for entry in stage.get(key, []):
            if isinstance(entry, dict):
                ((path, options),) = entry.items()
                yield path, options.get("cache", True)
            else:
                yield entry, True


def outputs(name: str) -> list[str]:
    return [path for path, _ in entries(both()[name], "outs", "plots", "metrics")]


@cache
def folder_files(folder: str) -> frozenset[str]:
    """Files that a dependency on a folder takes in, as DVC walks it."""
    from dvc.repo import Repo

    with Repo(str(ROOT)) as repo:
        found = repo.dvcignore.find(repo.fs, str(ROOT / folder))
        return frozenset(Path(path).relative_to(ROOT).as_posix() for path in found)


def taken_in(dependency: str) -> set[str]:
    """Modules behind a dependency."""
    files = folder_files(dependency) if (ROOT / dependency).is_dir() else {dependency}
    return {file for file in files if file.endswith(".py")}


def is_code(dependency: str) -> bool:
    return dependency.startswith(("robojoule", "reproduction", "stages")) and "/catalog/" not in dependency


def stage_modules(name: str) -> set[str]:
    """Modules whose code makes what a stage writes; an empty package makes nothing."""
    return {
        file
        for file in relative(closure(ROOT / f"stages/{name}.py", PLUMBING))
        if not (file.endswith("__init__.py") and not imports(ROOT / file) and is_docstring(ROOT / file))
    }


def is_docstring(path: Path) -> bool:
    import ast

    return all(isinstance(node, ast.Expr) for node in ast.parse(path.read_text(encoding="utf-8")).body)


def test_the_stages_are_in_order():
    assert tuple(pipeline()) == PIPELINE
    assert tuple(studies()) == STUDIES


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_depends_on_the_code_that_it_imports(name: str):
    """Not on less (stale results), and on no room or file of which it imports nothing (needless runs)."""
    used = stage_modules(name)
    listed = {dep: taken_in(dep) for dep in both()[name]["deps"] if is_code(dep)}
    assert used - set().union(*listed.values()) == set()
    assert [dep for dep, files in listed.items() if not files & used] == []


@pytest.mark.parametrize("name", STAGES)
def test_dependencies_are_few_and_exist(name: str):
    deps = both()[name]["deps"]
    assert len(deps) <= MOST_DEPENDENCIES
    made = {path for one in STAGES for path in outputs(one)}
    for dep in deps:
        place = dep.replace("${robot.name}", load_params(ROOT / "params.yaml").robot.name)
        there = (ROOT / place).exists() or place in made or any(path.startswith(f"{place}/") for path in made)
        assert there, f"{name} depends on {dep}, which does not exist"


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_depends_on_the_versions_of_the_packages_that_it_imports(name: str):
    files = closure(ROOT / f"stages/{name}.py", PLUMBING)
    files |= {ROOT / one for one in WRITERS & relative(target for file in files for target in imported_files(file))}
    packages = {imported.split(".")[0] for file in files for imported, _ in imports(file)}
    used = {one for package in packages for one in DISTRIBUTIONS.get(package, {package})} & set(versions())
    (listed,) = (params["versions.yaml"] for params in both()[name]["params"] if "versions.yaml" in params)
    assert listed == sorted(used)


def test_versions_are_those_of_the_lock_file():
    """After `uv lock` with another version: say it in versions.yaml too."""
    lock = tomllib.loads((ROOT / "uv.lock").read_text(encoding="utf-8"))
    locked: dict[str, list[str]] = {}
    for package in lock["package"]:
        if "version" in package:  # the project itself has none there
            locked.setdefault(package["name"], []).append(package["version"])
    listed = {name: found if isinstance(found, list) else [found] for name, found in versions().items()}
    assert listed == {name: sorted(locked[name]) for name in sorted(versions())}


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_runs_its_module_and_has_a_cached_output(name: str):
    stage = both()[name]
    assert stage["cmd"] == f"python -m stages.{name}"
    assert any(cached for _, cached in entries(stage, "outs", "plots", "metrics"))
    assert stage["desc"]


def test_every_module_of_the_stages_is_a_stage():
    modules = {path.stem for path in (ROOT / "stages").glob("*.py")}
    assert modules == {*STAGES, "__init__", "cli", "show_table"}


def test_no_two_stages_write_one_file():
    outs = [path for name in STAGES for path in outputs(name)]
    assert len(outs) == len(set(outs))


def test_what_git_keeps_of_the_results_a_stage_writes():
    """No table stays behind when the stage that wrote it is gone or writes another one."""
    made = {path for name in STAGES for path in outputs(name)}
    listed = subprocess.run(["git", "ls-files", "reports", "studies/tables"], cwd=ROOT, capture_output=True, text=True)
    kept = {path for path in listed.stdout.split() if (ROOT / path).exists()} - {"reports/.gitignore"}
    assert kept
    assert kept - made == set()


def test_what_dvc_caches_git_ignores_and_the_other_way_round():
    for stage in both().values():
        for path, cached in entries(stage, "outs", "plots", "metrics"):
            code = subprocess.run(["git", "check-ignore", "-q", "--no-index", path], cwd=ROOT, check=False).returncode
            assert (code == 0) == cached, f"{path}: cached by DVC is {cached}, ignored by git is {code == 0}"


def test_the_stages_use_all_parameters():
    used = {key.split(".")[0] for stage in pipeline().values() for key in stage["params"] if isinstance(key, str)}
    assert used == set(yaml.safe_load((ROOT / "params.yaml").read_text(encoding="utf-8")))
    params = [one for stage in studies().values() for one in stage["params"]]
    of_studies = {key for one in params for key in one.get("studies/params.yaml", [])}
    assert of_studies == set(yaml.safe_load((ROOT / "studies/params.yaml").read_text(encoding="utf-8")))
