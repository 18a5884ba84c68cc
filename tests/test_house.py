"""Rules of the house that a machine can check: who may import whom, file lengths, what is heavy, column names."""

import ast
import csv
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.imports import PACKAGES, ROOT, closure, file_of, imports, module_name, python_files

# The library's rooms: each imports those before it only. The door (`robojoule/__init__.py`) opens on all of them.
ROOMS = (
    *("errors", "inputs", "arrays", "documents", "progress"),
    *("robots", "motion", "calibration", "profile", "programs", "formats", "planning"),
    *("year", "page", "plots", "checks", "calls", "profiling", "identifying", "api", "cli", "__main__"),
)
# Which buildings each of them stands on.
BUILDINGS = {
    "robojoule": {"robojoule"},
    "reproduction": {"robojoule", "reproduction"},
    "stages": {"robojoule", "reproduction", "stages"},
    "flows": {"robojoule", "reproduction", "stages", "flows"},
    "benchmarks": {"robojoule", "reproduction", "stages", "flows", "benchmarks"},
}
# Packages that the library does without, whatever is installed, and the places that import the heavy ones.
NOT_IN_THE_LIBRARY = {"dvc", "duckdb", "mlflow", "pandas", "prefect", "sklearn"}
PLOTTING = ("robojoule.plots", "reproduction.report")
RECORDING = ("reproduction.tracking", "robojoule.cli._models")  # the latter fetches from the registry
LOADED_BY_MLFLOW = "reproduction.tracking.profile_model"


def room(module: str) -> str:
    """Name of a module's room below its building."""
    return module.split(".")[1] if "." in module else ""


@pytest.mark.parametrize("path", python_files(*PACKAGES), ids=module_name)
def test_imports_go_one_way(path: Path):
    """Between buildings, and between the rooms of the library."""
    module = module_name(path)
    building = module.split(".")[0]
    for name, _ in imports(path):
        target = file_of(name)
        if target is None or name == "robojoule.__version__":
            continue
        other = module_name(target)
        assert other.split(".")[0] in BUILDINGS[building], f"{module} imports {name}"
        if building == other.split(".")[0] == "robojoule" and room(module):
            assert room(other), f"{module} imports {name} from the door"
            assert ROOMS.index(room(other)) <= ROOMS.index(room(module)), f"{module} imports {name}, a later room"


def test_every_room_of_the_library_has_its_place():
    found = {room(module_name(path)) for path in python_files("robojoule")} - {""}
    assert found <= set(ROOMS)


def test_the_rooms_of_the_reproduction_stand_in_some_order():
    """None reaches itself through others."""
    needs: dict[str, set[str]] = {}
    for path in python_files("reproduction"):
        here = room(module_name(path))
        targets = [target for name, _ in imports(path) if (target := file_of(name))]
        others = {room(module_name(one)) for one in targets if module_name(one).startswith("reproduction.")}
        needs.setdefault(here, set()).update(others - {here, ""})
    while free := {name for name, others in needs.items() if not others}:
        needs = {name: others - free for name, others in needs.items() if name not in free}
    assert not needs, f"rooms that need each other: {needs}"


@pytest.mark.parametrize("path", python_files("robojoule", "reproduction", "stages"), ids=module_name)
def test_heavy_packages_stay_at_the_edges(path: Path):
    module = module_name(path)
    for name, on_loading in imports(path):
        package = name.split(".")[0]
        if module.startswith("robojoule"):
            assert package not in NOT_IN_THE_LIBRARY or module in RECORDING, f"{module} imports {name}"
        assert package not in ("dvc", "prefect"), f"{module} imports {name}"
        places = {"matplotlib": PLOTTING, "mlflow": RECORDING}.get(package)
        if places is not None:
            assert module.startswith(places), f"{module} imports {name}, allowed in {', '.join(places)}"
            assert not on_loading or module == LOADED_BY_MLFLOW, f"{module} imports {name} when it is loaded"


def test_the_studies_hold_no_code():
    assert python_files("studies") == []


def test_a_library_of_plain_modules_is_what_its_rooms_reach():
    """No room of the library reaches a module of another building, by whatever way."""
    for path in python_files("robojoule"):
        assert {one.relative_to(ROOT).parts[0] for one in closure(path)} == {"robojoule"}


@pytest.mark.parametrize("path", sorted(set(python_files("stages")) - {ROOT / "stages/show_table.py"}), ids=module_name)
def test_stages_are_thin(path: Path):
    """They name parameters and files and leave the work to the rooms."""
    used = {name.split(".")[0] for name, _ in imports(path)} - set(sys.stdlib_module_names)
    assert used <= {"pyarrow", *PACKAGES}
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 60


def test_the_table_is_shown_without_other_packages():
    assert {name.split(".")[0] for name, _ in imports(ROOT / "stages/show_table.py")} <= set(sys.stdlib_module_names)


def test_the_command_line_loads_light_modules_only():
    code = "import sys, robojoule.cli; print(*sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    heavy = {"matplotlib", "mlflow", "sklearn", "pandas", "pyomo", "highspy", "prefect", "dvc", "duckdb"}
    assert not heavy & set(out.split())


@pytest.mark.parametrize("path", python_files("robojoule", "reproduction"), ids=module_name)
def test_no_function_is_called_as_its_module(path: Path):
    """It would hide the module from who imports it; stages and flows are called after the one thing that they run."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    assert path.stem not in {node.name for node in body if isinstance(node, ast.FunctionDef | ast.ClassDef)}


@pytest.mark.parametrize("path", python_files(*PACKAGES, "tests"), ids=lambda p: str(p.relative_to(ROOT)))
def test_files_are_short(path: Path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


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


def test_every_column_of_the_committed_tables_is_in_the_nomenclature():
    for path in sorted([*(ROOT / "reports").rglob("*.csv"), *(ROOT / "studies/tables").glob("*.csv")]):
        with path.open(newline="", encoding="utf-8") as file:
            assert unknown_columns(next(csv.reader(file))) == [], path.name
