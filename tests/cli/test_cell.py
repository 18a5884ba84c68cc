"""`robojoule cell`: solve and check, JSON, files, Ctrl-C, bad input."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from robojoule.cli import main
from robojoule.formats.cell_files import write_cell
from tests.formats.cell_text import XML
from tests.planning.cells.cases import generated, two_robots


@pytest.fixture
def cell(tmp_path):
    path = tmp_path / "cell.yaml"
    write_cell(two_robots(), path)
    return path


def test_a_plan_is_made_written_and_checked(cell, tmp_path, capsys):
    out = tmp_path / "plan.csv"
    assert main(["cell", "solve", str(cell), "--out", str(out), "--json"]) == 0
    shown = capsys.readouterr()
    result = json.loads(shown.out)
    assert result["status"] == "optimal"
    assert 0.0 <= result["gap_percent"] <= 0.01
    assert result["bound_j"] <= result["energy_j"]
    assert result["energy_j"] == pytest.approx(sum(step["energy_j"] for step in result["steps"]))
    assert result["runtime_s"] > 0.0
    assert shown.err == ""  # no terminal
    assert main(["cell", "check", str(cell), str(out), "--json"]) == 0
    check = json.loads(capsys.readouterr().out)
    assert check["feasible"] and check["plans"][0]["energy_j"] == pytest.approx(result["energy_j"])
    out.write_text(out.read_text(encoding="utf-8").replace(",brakes,", ",on,", 1), encoding="utf-8")
    assert main(["cell", "check", str(cell), str(out)]) == 2
    assert "not feasible" in capsys.readouterr().out


def test_a_file_of_several_cells_gives_a_list(tmp_path, capsys):
    start, end = XML.index("<instance>"), XML.index("</instance>") + len("</instance>")
    short = XML[start:end].replace("<production-cycle-time>12<", "<production-cycle-time>2<")
    path = tmp_path / "many.xml"
    path.write_text(XML[:end] + short + XML[end:], encoding="utf-8")
    assert main(["cell", "solve", str(path), "--json", "--quiet"]) == 0
    shown = capsys.readouterr()
    first, second = json.loads(shown.out)["instances"]
    assert first["status"] == "optimal" and first["cell"] == "many_0"
    assert second["status"] == "failed" and "forced by robot" in second["message"]
    assert not shown.err
    assert main(["cell", "solve", str(path), "--instance", "0", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["energy_j"] == pytest.approx(first["energy_j"])
    assert main(["cell", "solve", str(path), "--instance", "2"]) == 2


def test_a_file_of_cells_that_all_have_no_plan_fails_and_writes_nothing(tmp_path, capsys):
    start, end = XML.index("<instance>"), XML.index("</instance>") + len("</instance>")
    short = XML[start:end].replace("<production-cycle-time>12<", "<production-cycle-time>2<")
    path, out = tmp_path / "none.xml", tmp_path / "plan.json"
    path.write_text(XML[:start] + short + short + XML[end:], encoding="utf-8")
    assert main(["cell", "solve", str(path), "--out", str(out), "--quiet"]) == 1
    assert "none_0: the cycle time 2 s is shorter" in capsys.readouterr().out
    assert not out.exists()


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["solve", "none.xml"], "there is no such file"),
        (["solve", "CELL", "--time-limit", "-3"], "--time-limit"),
        (["solve", "CELL", "--gap", "x"], "--gap"),
        (["solve", "CELL", "--out", "plan.pdf"], "unknown file type '.pdf'"),
        (["check", "CELL", "none.json"], "there is no such file"),
        (["draw", "CELL"], "invalid choice"),
        ([], "ACTION"),
    ],
)
def test_bad_input_is_refused(cell, capsys, words, problem):
    assert main(["cell", *(str(cell) if word == "CELL" else word for word in words)]) == 2
    error = capsys.readouterr().err
    assert problem in error and len(error.splitlines()) == 1


def test_a_plan_of_another_cell_is_refused(cell, tmp_path, capsys):
    other, out = tmp_path / "other.yaml", tmp_path / "plan.json"
    write_cell(generated(2, 1, (3, 4)), other)
    assert main(["cell", "solve", str(other), "--out", str(out), "--quiet"]) == 0
    assert main(["cell", "check", str(cell), str(out)]) == 2
    assert "the plan is for cell 'generated_2_1'" in capsys.readouterr().err


def test_a_plan_is_drawn(cell, tmp_path, capsys):
    out, plot = tmp_path / "plan.json", tmp_path / "plan.svg"
    assert main(["cell", "solve", str(cell), "--out", str(out), "--quiet"]) == 0
    words = ["cell", "gantt", str(cell), str(out), "--plot", str(plot)]
    assert main(words) == 0
    first = plot.read_text(encoding="utf-8")
    assert "<svg" in first
    assert main(words) == 0
    assert plot.read_text(encoding="utf-8") == first
    assert main(["cell", "gantt", str(cell), str(out), "--plot", str(tmp_path / "plan.png")]) == 2
    assert main([*words, "--cell", "another"]) == 2
    out.write_text(out.read_text(encoding="utf-8").replace('"brakes"', '"on"', 1), encoding="utf-8")
    assert main(words) == 2
    assert "the plan is not feasible" in capsys.readouterr().err


def test_a_cell_of_robots_is_planned_checked_and_drawn(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["example", "robot_cell.yaml"]) == 0
    capsys.readouterr()
    words = ["cell", "solve", "robot_cell.yaml", "--gap", "1", "--quiet", "--time-limit", "900"]
    assert main([*words, "--out", "plan.json", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["programs"] == ["plan.loader.yaml", "plan.welder.yaml", "plan.unloader.yaml"]
    assert result["bound_j"] <= result["energy_j"] < result["energy_given_j"] and result["clearance_m"] >= 0.03
    assert {path.name for path in tmp_path.iterdir()} == {"robot_cell.yaml", "plan.json", *result["programs"]}
    assert main(["cell", "check", "robot_cell.yaml", "plan.json", "--json"]) == 0
    check = json.loads(capsys.readouterr().out)
    assert check["feasible"] and check["plans"][0]["energy_j"] == pytest.approx(result["energy_j"])
    draw = ["cell", "gantt", "robot_cell.yaml", "plan.json", "--plot", "plan.svg"]
    assert main(draw) == 0
    assert "<svg" in (tmp_path / "plan.svg").read_text(encoding="utf-8")
    program = (tmp_path / "plan.welder.yaml").read_text(encoding="utf-8")
    (tmp_path / "plan.welder.yaml").write_text(program.replace("duration_s: 1.2", "duration_s: 0.2"), encoding="utf-8")
    capsys.readouterr()
    assert main(["cell", "check", "robot_cell.yaml", "plan.json"]) == 2
    assert "not feasible" in capsys.readouterr().out
    assert main(draw) == 2
    assert "the plan is not feasible" in capsys.readouterr().err
    assert main([*words, "--out", "plan.csv"]) == 2
    assert "unknown file type '.csv'" in capsys.readouterr().err


def test_what_goes_with_cells_of_robots_only_is_refused(cell, capsys):
    assert main(["cell", "solve", str(cell), "--profiles", "predicted"]) == 2
    assert "--profiles" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="Windows has other signals")
def test_an_interrupt_keeps_the_best_plan(tmp_path):
    path, out = tmp_path / "cell.json", tmp_path / "plan.json"
    write_cell(generated(3, 0, (5, 7)), path)
    command = [sys.executable, "-m", "robojoule", "cell", "solve", str(path), "--gap", "0", "--time-limit", "300"]
    terminal, end = os.openpty()
    with subprocess.Popen([*command, "--out", str(out)], stdout=subprocess.PIPE, stderr=end, text=True) as run:
        os.close(end)
        told = b""
        while b" J, gap" not in told:
            told += os.read(terminal, 4096)
        begun = time.monotonic()
        run.send_signal(signal.SIGINT)
        shown, _ = run.communicate(timeout=60)
    os.close(terminal)
    assert run.returncode == 0
    assert time.monotonic() - begun < 30
    assert "feasible" in shown and out.exists()
    assert main(["cell", "check", str(path), str(out)]) == 0
