"""Platforms without wheels of Pinocchio, coal or Ruckig: every command works, with the same results."""

import json
import subprocess
import sys

import pyarrow as pa
import pytest
from pyarrow import csv

from robojoule.cli import main
from tests.calibration.plant import ROBOT, Plant, make_log

MOVE = ["--from", "0,-90,90,0,0,0", "--to", "60,-60,90,0,30,0"]
WITHOUT = """
import json, sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("pinocchio", "eigenpy", "coal", "ruckig"):
            raise ModuleNotFoundError(f"No module named '{name}'")

sys.meta_path.insert(0, Missing())
"""
RUN = "from robojoule.cli import main\nfor words in json.loads(sys.argv[1]):\n    assert main(words) == 0\n"


def run(code, *arguments):
    """Output lines of code in a process in which the packages cannot be imported."""
    words = [sys.executable, "-c", WITHOUT + code, *arguments]
    shown = subprocess.run(words, capture_output=True, text=True, check=False)
    assert shown.returncode == 0, shown.stderr
    return shown.stdout.splitlines()


@pytest.fixture(scope="module")
def commands(program, tmp_path_factory):
    columns, _ = make_log(Plant(22), 22, motions=12)
    log = tmp_path_factory.mktemp("logs") / "log.csv"
    csv.write_csv(pa.table(columns), log)
    return {
        "profile": ["profile", "--robot", ROBOT, *MOVE, "--json"],
        "simulate": ["simulate", str(program), "--robot", ROBOT, "--json"],
        "optimize": ["optimize", str(program), "--robot", ROBOT, "--cycle-time", "+20%", "--json"],
        "pareto": ["pareto", str(program), "--robot", ROBOT, "--json"],
        "identify": ["identify", str(log), "--robot", ROBOT, "--payload", "10", "--json"],
    }


@pytest.fixture(scope="module")
def without(commands):
    """Result of every command where the packages are missing."""
    lines = run(RUN, json.dumps(list(commands.values())))
    return dict(zip(commands, (json.loads(line) for line in lines), strict=True))


def assert_equal(found, expected, where, tolerance):
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), where
        for key, value in expected.items():
            assert_equal(found[key], value, f"{where}.{key}", tolerance)
    elif isinstance(expected, list):
        assert len(found) == len(expected), where
        for index, (one, other) in enumerate(zip(found, expected, strict=True)):
            assert_equal(one, other, f"{where}[{index}]", tolerance)
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=tolerance, abs=tolerance), where
    else:
        assert found == expected, where


# A fit ends where its steps are small, which rounding of the torques shifts a little.
@pytest.mark.parametrize(
    ("command", "tolerance"),
    [("profile", 0.0), ("simulate", 0.0), ("optimize", 0.0), ("pareto", 0.0), ("identify", 1e-9)],
)
def test_commands_give_the_same_results(commands, without, capsys, command, tolerance):
    assert main(commands[command]) == 0
    expected = json.loads(capsys.readouterr().out)
    assert_equal(without[command], expected, command, tolerance)


def test_what_needs_a_package_names_it():
    lines = run(
        "from robojoule.errors import MissingPackage\n"
        "from robojoule.motion.dynamics import inverse_dynamics\n"
        "from robojoule.motion.time_laws import path_law\n"
        "from robojoule.robots import load_robot\n"
        "import numpy as np\n"
        "robot, q = load_robot('ur_ur5e'), np.zeros((1, 6))\n"
        "calls = (\n"
        "    lambda: robot.model,\n"
        "    lambda: inverse_dynamics(robot, q, q, q, engine='pinocchio'),\n"
        "    lambda: path_law(1.0, 5.0, 0.1, engine='ruckig'),\n"
        ")\n"
        "for call in calls:\n"
        "    try: call()\n"
        "    except MissingPackage as error: print(error)\n"
        "print(inverse_dynamics(robot, q, q, q).shape, path_law(1.0, 5.0, 0.1).total_s > 0)\n"
    )
    assert [(" pin, " in line, " ruckig, " in line) for line in lines[:3]] == [
        (True, False),
        (True, False),
        (False, True),
    ]
    assert all("which is not installed" in line for line in lines[:3])
    assert lines[3:] == ["(1, 6) True"]
