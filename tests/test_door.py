"""The door of the library: its names, what importing and using them loads, and the example of the README."""

import ast
import json
import os
import pkgutil
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import robojoule as rj

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
HEAVY = {"pandas", "sklearn", "mlflow", "matplotlib", "duckdb", "pyarrow", "pyomo", "highspy", "dvc", "prefect"}


def block(language: str) -> str:
    (text,) = re.findall(rf"^```{re.escape(language)}\n(.*?)^```$", README, re.M | re.S)
    return text


@pytest.fixture
def folder(tmp_path) -> Path:
    """An empty folder with the program that the README shows."""
    (tmp_path / "cycle.yaml").write_text(block("yaml operation-tree"), encoding="utf-8")
    shutil.copy(ROOT / "robojoule/examples/cell.yaml", tmp_path)
    return tmp_path


def fresh(code: str, folder: Path) -> str:
    """What code prints in a new interpreter that starts in a folder."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_example_of_the_readme_runs_in_an_empty_folder(folder):
    saving, energy, cycle_time = map(float, fresh(block("python door"), folder).split())
    robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
    given = rj.simulate(rj.load_program(folder / "cycle.yaml"), robot)
    written = rj.simulate(rj.load_program(folder / "slower.yaml"), robot)
    assert cycle_time == pytest.approx(1.1 * given.cycle_time_s, abs=1e-3)  # waits are whole milliseconds
    assert written.cycle_time_s == pytest.approx(cycle_time, abs=1e-6)
    assert written.energy_j == pytest.approx(energy, rel=1e-9)
    assert 0.0 < saving < 100.0


def test_the_readme_shows_the_example_that_is_installed(folder):
    example = rj.load_program(ROOT / "robojoule/examples/cycle.yaml")
    assert rj.load_program(folder / "cycle.yaml").tree == example.tree


def test_importing_loads_the_standard_library_only(tmp_path):
    loaded = fresh(
        "import sys; before = set(sys.modules); import robojoule; print(*(set(sys.modules) - before))", tmp_path
    )
    packages = {name.split(".")[0] for name in loaded.split()} - sys.stdlib_module_names
    assert packages == {"robojoule"}


def test_the_first_plan_loads_nothing_heavy(folder):
    loaded = fresh(f"{block('python door')}\nimport sys; print(*sys.modules)", folder)
    assert not HEAVY & set(loaded.split())


def test_no_name_is_hidden_by_a_module():
    """Importing a submodule x sets the attribute `x` of the package: no name of the door may be one."""
    assert not set(rj.__all__) & {module.name for module in pkgutil.iter_modules(rj.__path__)}


USE_EVERYTHING = """
import importlib, json, pkgutil
import robojoule as rj
for module in pkgutil.walk_packages(rj.__path__, "robojoule."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
robot = rj.load_robot("kuka_kr16_r2010_2", rj.Payload(5.0))
assert isinstance(robot, rj.Robot) and robot.name in rj.list_robots()
program = rj.load_program("cycle.yaml")
assert isinstance(program, rj.Program)
plan = rj.optimize(program, robot, cycle_time="+5%")
assert isinstance(plan, rj.Plan)
(cell,) = rj.load_cells("cell.yaml")
assert isinstance(cell, rj.Cell)
cell_plan = rj.optimize(cell, time_limit_s=60)
assert isinstance(cell_plan, rj.CellPlan) and cell_plan.status == "optimal"
start, end, *_ = program.tree.configurations_rad()
profile = rj.energy_profile(robot, start, end, points=5)
results = [plan, cell_plan, rj.simulate(program, robot), rj.pareto(program, robot), profile]
try:
    rj.identify("none.csv", robot)
except rj.errors.InputError as error:
    assert "there is no such file" in str(error)
else:
    raise AssertionError
assert rj.__version__
used = {"identify", *(name for name in rj.__all__ if callable(getattr(rj, name)))}
print(json.dumps([sorted(used), [result.to_dict() for result in results]], allow_nan=False))
"""


def test_every_name_works_after_every_module_was_imported(folder):
    used, results = json.loads(fresh(USE_EVERYTHING, folder))
    assert used == sorted(rj.__all__)
    assert all(results)


def test_the_names_are_seen_by_people_and_type_checkers():
    assert set(rj.__all__) <= set(dir(rj))
    assert (ROOT / "robojoule/py.typed").exists()
    tree = ast.parse((ROOT / "robojoule/__init__.py").read_text(encoding="utf-8"))
    checked = next(node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    shown = {alias.name: f"{node.module}" for node in checked.body for alias in node.names}
    assert shown.keys() == set(rj.__all__)
    for name, module in shown.items():
        assert getattr(rj, name) is getattr(sys.modules[module], name)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'robojoule' has no attribute 'optimise'"):
        rj.optimise  # noqa: B018
