"""The command line: help, JSON, errors with exit code 2, nothing heavy before it is needed."""

import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from robojoule import __version__
from robojoule.cli import COMMANDS, main
from robojoule.formats.program import load_program
from robojoule.formats.tree_files import save_tree

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command):
    shown = subprocess.run([sys.executable, "-m", "robojoule", command, "--help"], capture_output=True, text=True)
    assert shown.returncode == 0
    assert "--json" in shown.stdout


def test_the_package_runs_as_a_program():
    command = [sys.executable, "-m", "robojoule", "--version"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == f"robojoule {__version__}\n"


def test_a_reader_that_has_seen_enough_is_no_error():
    """As in `robojoule robots | head -1`."""
    command = [sys.executable, "-m", "robojoule", "robots", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.close()
        assert process.stderr.read() == ""


def shell(line: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """What a POSIX shell makes of a line in which ROBOJOULE stands for the command."""
    line = line.replace("ROBOJOULE", f"{shlex.quote(sys.executable)} -m robojoule")
    return subprocess.run(
        ["sh", "-c", line], capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )


@pytest.mark.skipif(os.name != "posix", reason="the lines are those of a POSIX shell")
@pytest.mark.parametrize(
    "line, code, said",
    [
        ("ROBOJOULE robots >&-", 0, ""),
        ("ROBOJOULE robots >&- 2>&-", 0, ""),
        ("ROBOJOULE paretto 2>&-", 2, ""),
        ("ROBOJOULE paretto 2>/dev/full", 2, ""),
        ("ROBOJOULE robots > /dev/full", 1, "the result cannot be printed (No space left on device)\n"),
    ],
    ids=["no output", "neither", "no errors", "errors full", "full"],
)
def test_closed_and_full_streams_end_without_a_traceback(line, code, said):
    done = shell(line)
    assert done.returncode == code
    assert done.stderr == (f"robojoule robots: {said}" if said else "")


def test_terminals_that_know_ascii_only_get_the_rest_escaped(program, tmp_path):
    tree = load_program(program).tree.model_copy(update={"name": "Gr\xfc\xdfe"})
    save_tree(tree, tmp_path / "cycle.json")
    words = ["optimize", "cycle.json", "--robot", "kuka_kr16_r2010_2", "--cycle-time", "4"]
    done = subprocess.run(
        [sys.executable, "-m", "robojoule", *words],
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.startswith(rb"Gr\xfc\xdfe on kuka_kr16_r2010_2")


def test_an_interrupted_command_says_so_and_writes_nothing(program, monkeypatch, capsys, tmp_path):
    """The signal comes while the files are written."""
    rename = Path.replace

    def interrupted(path: Path, target: Path) -> Path:
        signal.raise_signal(signal.SIGINT)
        return rename(path, target)

    monkeypatch.setattr(Path, "replace", interrupted)
    out = tmp_path / "curve.csv"
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # shells start jobs of scripts deaf to it
    try:
        assert main(["pareto", str(program), "--robot", "kuka_kr16_r2010_2", "--csv", str(out)]) == 130
    finally:
        signal.signal(signal.SIGINT, before)
    assert capsys.readouterr().err == "robojoule pareto: interrupted\n"
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_while_modules_are_loaded_is_one_too(monkeypatch, capsys):
    """Python 3.11 wraps it where it comes while a class is made."""

    def stopped(name: str) -> None:
        raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()

    monkeypatch.setattr("robojoule.cli.import_module", stopped)
    assert main(["robots"]) == 130
    assert capsys.readouterr().err == "robojoule robots: interrupted\n"


def test_help_loads_nothing_heavy():
    code = (
        "import sys, robojoule.cli as c\n"
        "try: c.main(['--help'])\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'pinocchio', 'pyomo', 'duckdb', 'sklearn', 'mlflow', 'matplotlib', 'pydantic'}\n"
        "print('loaded:', sorted(heavy & set(sys.modules)))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "loaded: []" in shown.stdout
