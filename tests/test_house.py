"""Rules of the house that a machine can check: layers, file lengths, the pipeline's dependencies, column names."""

import ast
import csv
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("robojoule", "stages", "flows")
EDGES = ("robojoule.cli", "reproduction.report", "robojoule.formats")
PHYSICS = (
    "robots",
    "trajectory",
    "dynamics",
    "recursion",
    "drive",
    "quadrature",
    "simulation",
    "timing",
    "torque_limits",
)
BASE = ("errors", "documents")
# Carry or record values but make none, so no stage has to run again when they change (dvc.yaml says so too).
PLUMBING = {"robojoule/__init__.py", "robojoule/errors.py", "reproduction/config.py"} | {
    f"stages/{name}.py" for name in ("__init__", "_cli", "_tracking", "layout")
}


def python_files(*folders: str) -> list[Path]:
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def imports(path: Path) -> tuple[tuple[str, bool], ...]:
    """Imported names of a file: dotted name (module, or module.name) and whether it is imported on loading the file.

    What stands under `if TYPE_CHECKING` is no import.
    """
    found: list[tuple[str, bool]] = []

    def visit(node: ast.AST, top: bool) -> None:
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            return
        if isinstance(node, ast.Import):
            found.extend((alias.name, top) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found.extend((f"{node.module}.{alias.name}", top) for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child, top and not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))

    visit(ast.parse(path.read_text(encoding="utf-8")), True)
    return tuple(found)


@cache
def file_of(name: str) -> Path | None:
    """The project's file behind a dotted name, None for names of other packages."""
    if name.split(".")[0] not in PACKAGES:
        return None
    while name:
        base = ROOT.joinpath(*name.split("."))
        for path in (base.with_suffix(".py"), base / "__init__.py"):
            if path.exists():
                return path
        name = name.rpartition(".")[0]
    return None


def closure(path: Path) -> set[Path]:
    """Files whose code makes what `path` makes: its imports, theirs, and the packages above them, less the plumbing."""
    seen: set[Path] = set()
    stack = [path]
    while stack:
        current = stack.pop()
        if current in seen or current.relative_to(ROOT).as_posix() in PLUMBING:
            continue
        seen.add(current)
        parent = current.parent
        while parent != ROOT:
            if (parent / "__init__.py").exists():
                stack.append(parent / "__init__.py")
            parent = parent.parent
        stack.extend(target for name, _ in imports(current) if (target := file_of(name)))
    return seen


def layer(module: str) -> int:
    part = module.split(".")[1] if "." in module else ""
    if module.startswith(EDGES):
        return 3
    return 0 if part in ("", *BASE) else 1 if part in PHYSICS else 2


@pytest.mark.parametrize("path", python_files("robojoule"), ids=module_name)
def test_imports_go_one_way(path: Path):
    """Physics knows nothing of the domain, the domain nothing of the edges, nobody of orchestration."""
    module = module_name(path)
    for name, on_loading in imports(path):
        package = name.split(".")[0]
        assert package not in ("dvc", "prefect", "stages", "flows"), f"{module} imports {name}"
        if package in ("matplotlib", "mlflow"):
            assert module.startswith(EDGES) and not on_loading, f"{module} imports {name}, allowed lazily in edges only"
        target = file_of(name)
        if target is not None:
            assert layer(module_name(target)) <= layer(module), f"{module} imports {name}, a layer above"


def test_the_command_line_loads_light_modules_only():
    code = "import sys, robojoule.cli; print(*sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    heavy = {"matplotlib", "mlflow", "sklearn", "pandas", "pyomo", "highspy", "prefect", "dvc", "duckdb"}
    assert not heavy & set(out.split())


@pytest.mark.parametrize("path", python_files(*PACKAGES, "tests"), ids=lambda p: str(p.relative_to(ROOT)))
def test_files_are_short(path: Path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


@cache
def stages() -> dict[str, dict]:
    return yaml.safe_load((ROOT / "dvc.yaml").read_text(encoding="utf-8"))["stages"]


def entries(stage: dict, *keys: str) -> Iterator[tuple[str, bool]]:
    """Paths of outputs and whether DVC caches them."""
    for key in keys:
        for entry in stage.get(key, []):
            if isinstance(entry, dict):
                ((path, options),) = entry.items()
                yield path, options.get("cache", True)
            else:
                yield entry, True


STAGES = ["generate_trees", "simulate_motions", "build_features", "train_predictors", "evaluate_plans", "draw_figures"]


def test_stages_stand_in_order():
    assert list(stages()) == STAGES


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_depends_on_the_code_it_imports(name: str):
    """Neither less (stale results) nor more (needless runs) than what the import statements reach."""
    used = {path.relative_to(ROOT).as_posix() for path in closure(ROOT / f"stages/{name}.py")}
    listed: set[str] = set()
    for dep in stages()[name]["deps"]:
        path = ROOT / dep
        if path.is_dir():
            listed |= {file.relative_to(ROOT).as_posix() for file in path.rglob("*.py")}
        elif dep.endswith(".py"):
            assert path.exists(), f"{name} depends on {dep}, which does not exist"
            listed.add(dep)
    assert listed == used


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_runs_its_module_and_has_a_cached_output(name: str):
    stage = stages()[name]
    assert stage["cmd"] == f"python -m stages.{name}"
    assert any(cached for _, cached in entries(stage, "outs", "plots", "metrics"))


def test_no_two_stages_write_one_file():
    outs = [path for stage in stages().values() for path, _ in entries(stage, "outs", "plots", "metrics")]
    assert len(outs) == len(set(outs))


def test_what_dvc_caches_git_ignores_and_the_other_way_round():
    for stage in stages().values():
        for path, cached in entries(stage, "outs", "plots", "metrics"):
            code = subprocess.run(["git", "check-ignore", "-q", "--no-index", path], cwd=ROOT, check=False).returncode
            assert (code == 0) == cached, f"{path}: cached by DVC is {cached}, ignored by git is {code == 0}"


def test_a_figure_style_reaches_draw_figures_only_and_the_forest_the_last_three_stages():
    readers = {key: [n for n in STAGES if key in stages()[n].get("params", [])] for key in ("draw_figures",)}
    assert readers["draw_figures"] == ["draw_figures"]
    assert [n for n in STAGES if "train_predictors" in stages()[n].get("params", [])] == ["train_predictors"]


def described_columns() -> set[str]:
    """Names in code marks in the tables of the nomenclature; `q1_rad ..` stands for any joint number."""
    text = (ROOT / "docs/nomenclature.md").read_text(encoding="utf-8")
    return set(re.findall(r"`([a-z][a-z0-9_]*)`", text))


def unknown_columns(columns: list[str]) -> list[str]:
    """Columns that the nomenclature does not name; joint 1, 4 segments and 110 % stand there for any other number."""
    known = described_columns()

    def general(name: str) -> str:
        name = re.sub(r"^(q|start_q|end_q|j)\d+_", r"\g<1>1_", name)
        return re.sub(r"_\d{3}_j$", "_110_j", re.sub(r"^krc_polynomial_\d+_", "krc_polynomial_4_", name))

    return [name for name in columns if general(name) not in known]


def test_every_column_of_the_committed_tables_stands_in_the_nomenclature():
    for path in sorted([*(ROOT / "reports/tables").glob("*.csv"), *(ROOT / "studies/tables").glob("*.csv")]):
        with path.open(newline="", encoding="utf-8") as file:
            assert unknown_columns(next(csv.reader(file))) == [], path.name
