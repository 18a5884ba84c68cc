"""`robojoule example`: what it writes is what the package holds, and works."""

import json
import os
import subprocess
import sys

import pytest

import robojoule as rj
from robojoule.cli import main
from robojoule.cli.example import ABOUT
from tests.conftest import ROOT

FOLDER = ROOT / "robojoule/examples"


def write(capsys, *words) -> dict:
    assert main(["example", *map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_all_examples_are_listed(capsys):
    assert set(ABOUT) == {path.name for path in FOLDER.iterdir() if path.is_file()}
    assert write(capsys) == {"examples": ABOUT, "out": None}
    assert main(["example"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(maxsplit=1) for line in lines] == [list(one) for one in ABOUT.items()]


@pytest.mark.parametrize("name", ABOUT)
def test_an_example_is_written_as_it_is_in_the_package(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    assert write(capsys, name)["out"] == name
    assert write(capsys, name, "--out", tmp_path / "new" / name)["out"] == str(tmp_path / "new" / name)
    expected = (FOLDER / name).read_text(encoding="utf-8")
    assert (tmp_path / name).read_text(encoding="utf-8") == expected
    assert (tmp_path / "new" / name).read_text(encoding="utf-8") == expected


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("examples")
    for name in ABOUT:
        assert main(["example", name, "--out", str(path / name)]) == 0
    return path


def script(folder, name) -> list[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, name], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_energy_is_saved(folder):
    given, planned, *moves = script(folder, "save_energy.py")
    robot = rj.load_robot("kuka_kr16_r2010_2", payload_kg=10)
    slower = rj.simulate(rj.load_program(folder / "slower.yaml"), robot)
    assert given.startswith("as given: ") and len(moves) == len(slower.moves)
    assert planned.startswith(f"planned:  {slower.cycle_time_s:.2f} s, {slower.energy_j:.0f} J, ")
    assert 1.0 < float(planned.split(", ")[2].split()[0]) < 40.0


def test_a_cycle_time_is_chosen(folder):
    _, *rows, last = script(folder, "choose_cycle_time.py")
    energies = [int(row.split()[2]) for row in rows]
    assert len(energies) == 6 and energies[:3] == sorted(energies[:3], reverse=True)
    assert int(last.split()[2]) <= min(energies)


def test_a_cell_is_planned(folder):
    first, *lines = script(folder, "plan_cell.py")
    (cell,) = rj.load_cells(folder / "cell.yaml")
    assert first.endswith("% above the optimum") and "16 s" in first
    robots = [line.split(": ") for line in lines if not line.startswith(" ")]
    assert [name for name, _ in robots] == [robot.name for robot in cell.robots]
    assert sum(int(energy.removesuffix(" J")) for _, energy in robots) == pytest.approx(int(first.split()[0]), abs=2)


def test_joint_positions_hold_the_moves_of_the_tree(folder):
    table, tree = (rj.load_program(folder / name) for name in ("positions.csv", "cycle.yaml"))
    assert (table.tree.configurations_rad() == tree.tree.configurations_rad()).all()
    assert [move.name for move in table.moves] == [move.name for move in tree.moves]


@pytest.mark.parametrize(
    "words, message",
    [
        (["cycle.yml"], "unknown example 'cycle.yml'; allowed: cycle.yaml, "),
        (["cycle.yaml"], "cycle.yaml: the file exists already; allowed: a new file, named by --out"),
        (["positions.csv", "--out", "cycle.yaml"], "cycle.yaml: the file exists already"),
        (["--out", "new.yaml"], "--out: no example is named; allowed: with one of cycle.yaml, "),
    ],
)
def test_nothing_is_overwritten_or_guessed(tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cycle.yaml").write_text("mine", encoding="utf-8")
    assert main(["example", *words]) == 2
    shown = capsys.readouterr()
    assert message in shown.err
    assert (shown.out, shown.err.count("\n")) == ("", 1)
    assert [path.name for path in tmp_path.iterdir()] == ["cycle.yaml"]
    assert (tmp_path / "cycle.yaml").read_text(encoding="utf-8") == "mine"
