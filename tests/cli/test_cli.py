"""The command line: help, JSON, errors with exit code 2, nothing heavy before it is needed."""

import json
import subprocess
import sys

import numpy as np
import pinocchio as pin
import pytest

from robojoule.cli import COMMANDS, main
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload

MOVE = ["--robot", "kuka_kr16_r2010_2", "--from", "0,-90,90,0,0,0", "--to", "60,-60,90,0,30,0"]


def test_profile_prints_one_json_object(capsys):
    assert main(["profile", *MOVE, "--payload", "5", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["payload_kg"] == 5.0
    assert len(result["duration_s"]) == len(result["energy_j"]) == len(result["speed_limit_percent"])
    assert result["duration_s"] == sorted(result["duration_s"], reverse=True)
    assert min(result["energy_j"]) == pytest.approx(
        result["energy_j"][0] - (result["energy_j"][0] - min(result["energy_j"]))
    )
    assert result["optimal_duration_s"] in result["duration_s"]


def test_small_arms_carry_their_rated_payload_unless_told(capsys):
    motion = ["--from", "0,-90,90,0,0,0", "--to", "30,-80,90,0,0,0", "--points", "2", "--json"]
    assert main(["profile", "--robot", "ur_ur3e", *motion]) == 0
    assert json.loads(capsys.readouterr().out)["payload_kg"] == 3.0


def test_profile_draws_where_the_energy_goes(tmp_path, capsys):
    plot = tmp_path / "profile.svg"
    assert main(["profile", *MOVE, "--json", "--plot", str(plot)]) == 0
    result = json.loads(capsys.readouterr().out)
    total = np.sum(list(result["parts_j"].values()), axis=0)
    assert total == pytest.approx(np.array(result["energy_j"]), rel=1e-9)
    assert plot.read_text().startswith("<?xml")


def test_profile_prints_a_table(capsys):
    assert main(["profile", *MOVE]) == 0
    assert "optimum" in capsys.readouterr().out


def test_profile_warns_of_torques_beyond_the_effort_limits(capsys):
    """Stretched out with its rated payload, the KR500 cannot even stand; joint 1 turns it, the others rest."""
    stretched = ["--from", "0,0,0,0,0,0", "--to", "60,0,0,0,0,0", "--points", "2"]
    robot = load_robot("kuka_kr500_r2800_2", Payload(500.0))
    gravity = np.abs(pin.computeGeneralizedGravity(robot.model, robot.model.createData(), np.zeros(6)))
    standing = (gravity / robot.effort_nm).max()
    assert standing > 1.0
    beyond = ["profile", "--robot", robot.name, *stretched, "--payload", "500"]
    assert main([*beyond, "--json"]) == 0
    ratio = json.loads(capsys.readouterr().out)["peak_torque_ratio"]
    assert standing * (1.0 - 1e-9) <= ratio <= 1.1 * standing
    assert main(beyond) == 0
    warnings = [line for line in capsys.readouterr().out.splitlines() if "effort limit" in line]
    assert len(warnings) == 1 and f"{100.0 * ratio:.1f} %" in warnings[0]


def test_profile_does_not_warn_within_the_effort_limits(capsys):
    assert main(["profile", *MOVE, "--json"]) == 0
    assert 0.2 < json.loads(capsys.readouterr().out)["peak_torque_ratio"] <= 1.0
    assert main(["profile", *MOVE]) == 0
    assert "effort limit" not in capsys.readouterr().out


def test_robots_lists_the_catalog(capsys):
    assert main(["robots", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["robots"]
    assert "kuka_kr16_r2010_2" in [row["name"] for row in rows]
    assert main(["robots"]) == 0
    assert "kuka_kr16_r2010_2" in capsys.readouterr().out


BAD = {
    "unknown robot": (["--robot", "kr17", *MOVE[2:]], "unknown robot 'kr17'"),
    "joint count": ([*MOVE[:3], "0,0", *MOVE[4:]], "--from: 2 joint positions given"),
    "beyond": ([*MOVE[:3], "0,90,0,0,0,0", *MOVE[4:]], "--from: joint_2 = 1.5708 rad"),
    "not numbers": ([*MOVE[:3], "a,b", *MOVE[4:]], "--from: 'a,b' is not a list of joint positions"),
    "payload": ([*MOVE, "--payload", "-3"], "payload mass -3.0"),
    "payload above the rated one": (
        [*MOVE, "--payload", "20"],
        "a payload of 20 kg is more than kuka_kr16_r2010_2 is rated for; allowed: 0 to 16 kg",
    ),
    "same ends": ([*MOVE[:4], "--to", MOVE[3]], "start and end are the same"),
    "plot": ([*MOVE, "--plot", "x.gif"], "--plot: unknown file type '.gif'; allowed: .svg"),
    "points": ([*MOVE, "--points", "1"], "--points: 1 is not a number of points; allowed: 2 to 1000"),
}


@pytest.mark.parametrize("arguments, message", BAD.values(), ids=BAD.keys())
def test_bad_input_ends_with_one_sentence_and_exit_code_2(capsys, arguments, message):
    assert main(["profile", *arguments]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert message in shown.err
    assert shown.err.count("\n") == 1


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command):
    shown = subprocess.run([sys.executable, "-m", "robojoule.cli", command, "--help"], capture_output=True, text=True)
    assert shown.returncode == 0
    assert "--json" in shown.stdout


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


def test_optimize_writes_a_program_that_keeps_the_cycle_time(program, tmp_path, capsys):
    from robojoule.formats.tree_files import load_tree

    out = tmp_path / "out.yaml"
    arguments = [str(program), "--robot", "kuka_kr16_r2010_2", "--cycle-time", "+20%", "--out", str(out), "--json"]
    assert main(["optimize", *arguments]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["cycle_time_s"] == pytest.approx(1.2 * result["least_cycle_time_s"], abs=1e-6)
    assert result["energy_j"] < result["energy_unoptimized_j"]
    assert result["saving_percent"] > 5
    assert 0.0 <= result["gap_to_optimum_percent"] <= 0.01
    assert result["bound_j"] <= result["energy_j"]
    moves = load_tree(out).moves()
    assert [move.speed_limit_percent for move in moves] == [move["speed_limit_percent"] for move in result["moves"]]
    assert main(["optimize", *arguments[:-3]]) == 0
    assert "% less" in capsys.readouterr().out


def test_the_fastest_cycle_is_no_better_than_its_bound(program, capsys):
    """Rounding must not put the bound above the energy of the only plan there is."""
    assert main(["optimize", str(program), "--robot", "kuka_kr16_r2010_2", "--cycle-time", "+0%", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["bound_j"] <= result["energy_j"]
    assert result["gap_to_optimum_percent"] >= 0.0
    assert result["energy_j"] == pytest.approx(result["energy_unoptimized_j"], rel=1e-6)


BAD_CYCLES = {
    "too short": ("0.5", "the cycle time 0.5 s is shorter than the fastest cycle; allowed: at least"),
    "text": ("fast", "--cycle-time: 'fast' is not a valid cycle time; allowed: seconds (7.5), or a share above the"),
    "negative": ("-3", "is not a valid cycle time"),
    "not finite": ("nan", "is not a valid cycle time"),
}


@pytest.mark.parametrize("cycle_time, message", BAD_CYCLES.values(), ids=BAD_CYCLES.keys())
def test_bad_cycle_times_write_nothing(program, tmp_path, capsys, cycle_time, message):
    out = tmp_path / "out.yaml"
    arguments = [str(program), "--robot", "kuka_kr16_r2010_2", f"--cycle-time={cycle_time}", "--out", str(out)]
    assert main(["optimize", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()
