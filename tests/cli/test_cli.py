"""The command line: help, JSON, errors with exit code 2, nothing heavy before it is needed."""

import subprocess
import sys

import pytest

from robojoule import __version__
from robojoule.cli import COMMANDS


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command):
    shown = subprocess.run([sys.executable, "-m", "robojoule.cli", command, "--help"], capture_output=True, text=True)
    assert shown.returncode == 0
    assert "--json" in shown.stdout


def test_the_package_runs_as_a_program():
    command = [sys.executable, "-m", "robojoule", "--version"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == f"robojoule {__version__}\n"


def test_a_reader_that_has_seen_enough_is_no_error():
    """As in `robojoule robots | head -1`."""
    command = [sys.executable, "-m", "robojoule.cli", "robots", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.close()
        assert process.stderr.read() == ""


def test_help_loads_nothing_heavy():
    code = (
        "import sys, robojoule.cli as c\n"
        "try: c.main(['--help'])\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'pinocchio', 'pyomo', 'duckdb', 'sklearn', 'mlflow', 'matplotlib', 'pydantic'}\n"
        "print('loaded:', sorted(heavy & set(sys.modules)))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "loaded: []" in shown.stdout
