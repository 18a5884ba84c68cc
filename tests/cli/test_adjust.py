"""`robojoule adjust`, and what `optimize` and `identify` make of a table of runs."""

import json

import numpy as np
import pytest

from robojoule.cli import main
from robojoule.formats.program import load_program
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot
from tests.calibration.machines import joint_controller
from tests.core_cases import kr16

ROBOT = ["--robot", "kuka_kr16_r2010_2", "--payload", "10"]


def said(capsys, *words) -> dict:
    assert main([*map(str, words), *ROBOT, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.fixture
def runs(program, tmp_path):
    """Runs of the program's moves at two speeds, as a spreadsheet of another country writes them."""
    read = load_program(program)
    points = read.tree.configurations_rad()
    machine = MotionPaths(kr16(), points[:-1], points[1:]).with_controller(joint_controller(kr16()))
    lines = ["move;speed_limit_percent;duration_s;energy_j"]
    for limit in (1.0, 0.3):
        found = machine.simulate([limit])
        for move, duration, energy in zip(read.moves, found.duration_s[:, 0], found.energy_j[:, 0], strict=True):
            lines.append(f"{move.name};{100 * limit:g};{np.round(duration / 0.004) * 0.004:.3f};{energy:.0f}")
    path = tmp_path / "runs.csv"
    path.write_text("\n".join(lines).replace(".", ",") + "\n", encoding="utf-8")
    return path


def test_a_measured_cycle_gives_a_faster_plan(program, tmp_path, capsys):
    out = tmp_path / "plan.yaml"
    plan = said(capsys, "optimize", program, "--cycle-time", "+30%", "--out", out)
    again = said(capsys, "adjust", out, "--measured-cycle", 1.04 * plan["cycle_time_s"], "--out", tmp_path / "new.yaml")
    assert again["cycle_time_s"] == pytest.approx(plan["cycle_time_s"], abs=2e-3)  # waits are written in 1 ms
    faster = [
        a["speed_limit_percent"] >= b["speed_limit_percent"] for a, b in zip(again["moves"], plan["moves"], strict=True)
    ]
    assert all(faster)
    assert load_program(tmp_path / "new.yaml").moves[0].speed_limit_percent == again["moves"][0]["speed_limit_percent"]


def test_plans_on_runs_say_how_sure_they_are(program, runs, capsys):
    asked = ["optimize", program, "--runs", runs, "--cycle-time", "6", "--reserve", "0.05s", "--profiles", "predicted"]
    result = said(capsys, *asked)
    assert result["reserve_s"] == pytest.approx(0.05)
    assert result["cycle_time_s"] == pytest.approx(6.0, abs=2e-3)  # waits are written in 1 ms
    assert 0.0 <= result["outlook"]["late_probability"] < 0.5
    assert main([*map(str, asked), *ROBOT]) == 0
    shown = capsys.readouterr().out
    assert "reserve 0.0500 s" in shown and "(90 % interval)" in shown and "controller: " in shown


@pytest.mark.parametrize("suffix", [".yaml", ".json"])
def test_a_plan_on_runs_says_what_it_was_made_for(program, runs, tmp_path, capsys, suffix):
    """The machine is slower than its entry: the cycle that the robot's file simulates is not the one that was asked."""
    out, better = tmp_path / f"plan{suffix}", tmp_path / f"better{suffix}"
    plan = said(capsys, "optimize", program, "--cycle-time", "3.4", "--runs", runs, "--out", out)
    by_the_file = said(capsys, "simulate", out)["cycle_time_s"]
    assert by_the_file < 3.3
    again = said(capsys, "adjust", out, "--measured-cycle", "3.5", "--out", better)
    assert again["cycle_time_s"] == pytest.approx(plan["cycle_time_s"], abs=2e-3)
    assert load_program(better).tree.planned_cycle_s == pytest.approx(plan["cycle_time_s"], abs=1e-6)
    by_runs = said(capsys, "adjust", out, "--runs", runs)
    assert by_runs["cycle_time_s"] == pytest.approx(plan["cycle_time_s"], abs=2e-3)


def test_a_table_has_no_place_for_it(program, tmp_path, capsys):
    out = tmp_path / "plan.csv"
    said(capsys, "optimize", program, "--cycle-time", "+10%", "--out", out)
    assert main(["adjust", str(out), "--measured-cycle", "7", *ROBOT]) == 2
    assert "does not say for which cycle time it was planned; allowed: seconds (7.5)" in capsys.readouterr().err


def test_timing_is_identified_from_the_same_table(program, runs, tmp_path, capsys):
    out = tmp_path / "mine.json"
    result = said(capsys, "identify", runs, "--program", program, "--out", out)
    assert result["timing"]["runs"] == 2 * len(load_program(program).moves)
    assert result["timing"]["nominal_error_percent"] > 3.0
    assert json.loads(out.read_text(encoding="utf-8"))["derived_from"] == "kuka_kr16_r2010_2"
    assert main(["identify", str(runs), "--program", str(program), *ROBOT]) == 0
    assert "timing from" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["adjust", "PROGRAM"], "neither a measured cycle nor runs are given"),
        (
            ["adjust", "PROGRAM", "--measured-cycle", "7", "--runs", "RUNS"],
            "both a measured cycle and runs are given",
        ),
        (["adjust", "PROGRAM", "--runs", "RUNS"], "--cycle-time: the program does not say for which cycle time it was"),
        (["adjust", "PROGRAM", "--measured-cycle", "7"], "--cycle-time: the program does not say for which cycle time"),
        (["optimize", "PROGRAM", "--cycle-time", "9", "--reserve", "10s"], "is not a valid reserve"),
        (["optimize", "PROGRAM", "--cycle-time", "9", "--reserve", "-1%"], "is not a valid reserve"),
        (["optimize", "PROGRAM", "--cycle-time", "9", "--profiles", "true"], "unknown source of profiles"),
        (
            ["optimize", "PROGRAM", "--cycle-time", "9", "--profiles", "measured"],
            "measured profiles need measured runs",
        ),
        (["optimize", "PROGRAM", "--cycle-time", "9", "--profiles", "simulated", "--cautious"], "no interval"),
        (["identify", "RUNS"], "needs the program whose moves it names"),
        (["identify", "RUNS", "--program", "PROGRAM", "--window", "0.1"], "goes with a log"),
    ],
)
def test_what_does_not_go_together_is_refused(program, runs, capsys, words, message):
    named = {"PROGRAM": str(program), "RUNS": str(runs)}
    assert main([*(named.get(word, word) for word in words), *ROBOT]) == 2
    assert message in capsys.readouterr().err


URSCRIPT = """def prog():
  set_tcp(p[0,0,0.1,0,0,0])
  movej([0,-1.57,1.57,-1.57,-1.57,0],a=1.4,v=1.05)
  movej(p[0.4,0.1,0.5,0,3.14,0],a=1.4,v=1.05)
  movej([0.5,-1.2,1.2,-1.57,-1.57,0],a=1.4,v=1.05)
  movej([0.9,-1.2,1.5,-1.57,-1.57,0],a=1.4,v=1.05)
  movej([0,-1.57,1.57,-1.57,-1.57,0],a=1.4,v=1.05)
end
"""


def test_timing_of_a_program_with_poses_is_identified(tmp_path, capsys):
    """Poses of the tool need the robot, which is given."""
    script, table = tmp_path / "v.script", tmp_path / "runs.csv"
    script.write_text(URSCRIPT, encoding="utf-8")
    robot = load_robot("ur_ur10e")
    known = load_program(script).for_robot(robot)
    points = known.tree.configurations_rad()
    durations = MotionPaths(robot, points[:-1], points[1:]).durations([1.0, 0.5])
    lines = ["move,speed_limit_percent,duration_s"]
    for place, limit in enumerate((100, 50)):
        seconds = zip(known.moves, 1.05 * durations[:, place], strict=True)
        lines += [f"{move.name},{limit},{taken:.3f}" for move, taken in seconds]
    table.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert main(["identify", str(table), "--program", str(script), "--robot", "ur_ur10e", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["timing"]["motions"] == len(known.moves)


def test_runs_that_the_entry_explains_leave_it_as_it_is(program, tmp_path, capsys):
    table, out = tmp_path / "runs.csv", tmp_path / "mine.json"
    read = load_program(program)
    points = read.tree.configurations_rad()
    lines = ["move,speed_limit_percent,duration_s"]
    for limit in (1.0, 0.3):
        seconds = MotionPaths(kr16(), points[:-1], points[1:]).durations([limit])[:, 0]
        lines += [f"{move.name},{100 * limit:g},{taken:.3f}" for move, taken in zip(read.moves, seconds, strict=True)]
    table.write_text("\n".join(lines) + "\n", encoding="utf-8")
    words = ["identify", str(table), "--program", str(program), "--out", str(out), *ROBOT]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert ": the entry's own" in shown and "so it is kept" in shown
    assert json.loads(out.read_text(encoding="utf-8"))["controller"] is None
