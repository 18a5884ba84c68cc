"""`robojoule profile`: JSON, drawing, warnings, bad input."""

import json

import numpy as np
import pytest

from robojoule.api import energy_profile
from robojoule.cli import main
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


def test_nothing_is_carried_unless_said_as_in_the_library(capsys):
    assert main(["profile", *MOVE, "--points", "3", "--json"]) == 0
    start, end = (list(map(float, text.split(","))) for text in (MOVE[3], MOVE[5]))
    expected = energy_profile(load_robot(MOVE[1]), start, end, points=3, degrees=True).to_dict()
    assert expected["payload_kg"] == Payload().mass_kg == 0.0
    assert json.loads(capsys.readouterr().out) == expected


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


def test_profile_refuses_a_pose_that_the_arm_cannot_hold(capsys):
    """Stretched out with its rated payload, the KR500 cannot stand; joint 1 turns it, the others rest."""
    stretched = ["--from", "0,0,0,0,0,0", "--to", "60,0,0,0,0,0", "--payload", "500"]
    assert main(["profile", "--robot", "kuka_kr500_r2800_2", *stretched]) == 2
    error = capsys.readouterr().err
    assert "joint_2 of kuka_kr500_r2800_2 cannot move the arm" in error and error.count("\n") == 1


def test_profile_does_not_warn_within_the_effort_limits(capsys):
    assert main(["profile", *MOVE, "--json"]) == 0
    assert 0.2 < json.loads(capsys.readouterr().out)["peak_torque_ratio"] <= 1.0
    assert main(["profile", *MOVE]) == 0
    assert "limit:" not in capsys.readouterr().out


BAD = {
    "unknown robot": (["--robot", "kr17", *MOVE[2:]], "unknown robot 'kr17'"),
    "joint count": ([*MOVE[:3], "0,0", *MOVE[4:]], "--from: 2 joint positions given"),
    "beyond": ([*MOVE[:3], "0,90,0,0,0,0", *MOVE[4:]], "--from: joint_2 = 1.5708 rad"),
    "not numbers": ([*MOVE[:3], "a,b", *MOVE[4:]], "--from: 'a,b' is not a list of numbers"),
    "payload": ([*MOVE, "--payload", "-3"], "--payload: -3 is not a valid payload mass"),
    "payload above the rated one": (
        [*MOVE, "--payload", "20"],
        "a payload of 20 kg is more than kuka_kr16_r2010_2 is rated for; allowed: 0 to 16 kg",
    ),
    "same ends": ([*MOVE[:4], "--to", MOVE[3]], "start and end are the same"),
    "plot": ([*MOVE, "--plot", "x.gif"], "--plot: unknown file type '.gif'; allowed: .svg"),
    "points": ([*MOVE, "--points", "1"], "--points: 1 is not a valid number of points; allowed: a whole number from 2"),
}


@pytest.mark.parametrize("arguments, message", BAD.values(), ids=BAD.keys())
def test_bad_input_ends_with_one_sentence_and_exit_code_2(capsys, arguments, message):
    assert main(["profile", *arguments]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert message in shown.err
    assert shown.err.count("\n") == 1


def test_a_move_of_a_program_by_measured_runs(program, tmp_path, capsys):
    runs = tmp_path / "runs.csv"
    rows = [
        f"{move},{limit},{0.5 * factor:.3f},{600 / factor:.0f}"
        for limit, factor in ((100, 1.0), (40, 1.6))
        for move in (1, 2, 3)
    ]
    runs.write_text("\n".join(["move,speed_limit_percent,duration_s,energy_j", *rows]) + "\n", encoding="utf-8")
    words = ["profile", str(program), "--move", "move-2", "--payload", "10", "--runs", str(runs)]
    assert main([*words, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["profiles"] == "measured"
    assert result["measured_speed_limit_percent"] == [40.0, 100.0]
    at = result["speed_limit_percent"].index(100.0)
    assert result["duration_s"][at] == pytest.approx(0.5, rel=0.05)  # all moves the same duration: no machine
    assert all(low < high for low, high in zip(result["energy_low_j"], result["energy_high_j"], strict=True))
    around = list(zip(result["duration_low_s"], result["duration_s"], result["duration_high_s"], strict=True))
    assert all(low < middle < high for low, middle, high in around)
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "  duration [s]  90 % interval [s]  energy [J]" in lines[1]
    assert "measured profile" in lines[0] and lines[1].endswith("90 % interval [J]")
    assert sum("  measured" in line for line in lines[2:]) == 2


MOVE_OF = ["profile", "PROGRAM", "--payload", "10"]


@pytest.mark.parametrize(
    "words, message",
    [
        (MOVE_OF, "--move: which move of the program is not said; allowed: move-1, move-2, move-3"),
        ([*MOVE_OF, "--move", "mve-1"], "--move: unknown move 'mve-1' (did you mean move-1"),
        ([*MOVE_OF, "--move", "move-1", "--from", "0,0"], "--from: a move of a program has its ends"),
        ([*MOVE_OF, "--move", "move-1", "--profiles", "predicted", "--plot", "p.svg"], "--plot: predicted profiles do"),
        (["profile", *MOVE, "--runs", "r.csv"], "--runs: this needs the program whose moves are meant"),
        (["profile", *MOVE[:2]], "--from: this is missing"),
        (["profile", *MOVE[2:]], "--robot: this is missing"),
    ],
)
def test_motions_and_moves_are_not_mixed(program, tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    assert main([str(program) if word == "PROGRAM" else word for word in words]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
