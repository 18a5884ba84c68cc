"""`robojoule simulate`: what a program takes as it stands, the same as in the library and as a plan promised."""

import json

import numpy as np
import pytest

import robojoule as rj
from robojoule.cli import main
from robojoule.programs.operation_tree import tree_from_configurations
from tests.planning.blended_trees import there_and_back

NAME = "kuka_kr16_r2010_2"
ROBOT = ["--robot", NAME]
ONE_WAY_DEG = [[0, -90, 90, 0, 0, 0], [50, -70, 80, 0, 30, 0]]


def simulated(capsys, *words) -> dict:
    assert main(["simulate", *map(str, words), *ROBOT, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("payload_kg", [0.0, 10.0])
def test_it_gives_what_the_library_gives(program, capsys, payload_kg):
    """Without a payload, too: nothing said is nothing carried, here and there."""
    words = ["--payload", payload_kg] if payload_kg else []
    result = simulated(capsys, program, *words)
    robot = rj.load_robot(NAME, payload_kg=payload_kg) if payload_kg else rj.load_robot(NAME)
    cycle = rj.simulate(rj.load_program(program), robot).to_dict()
    carried = {"payload_kg": payload_kg, "payloads_kg": [payload_kg]}
    assert result == {"program": "pick", "robot": NAME, **carried, **cycle, "program_notes": []}


def test_a_written_plan_takes_what_was_promised(program, tmp_path, capsys):
    out = tmp_path / "slower.yaml"
    assert main(["optimize", str(program), *ROBOT, "--cycle-time", "+20%", "--out", str(out), "--json"]) == 0
    plan = json.loads(capsys.readouterr().out)
    result = simulated(capsys, out)
    assert result == {key: plan[key] for key in result}


def test_people_read_totals_moves_and_warnings(tmp_path, capsys):
    path = tmp_path / "one way.yaml"
    rj.Program(tree_from_configurations("one way", np.radians(ONE_WAY_DEG))).save(path)
    assert main(["simulate", str(path), *ROBOT]) == 0
    lines = capsys.readouterr().out.splitlines()
    result = simulated(capsys, path)
    assert lines[0] == f"one way on {NAME}, payload 0 kg"
    assert lines[1] == f"cycle time {result['cycle_time_s']:.4f} s, energy {result['energy_j']:.1f} J per cycle"
    assert lines[2].startswith(f"largest mains power {result['peak_power_w']:.1f} W, largest torque ")
    assert lines[4].split()[:2] == ["move-1", "100.00"]
    assert lines[5:] == [f"warning: {warning}" for warning in result["warnings"]]
    assert result["warnings"] == ["the cycle ends elsewhere than it starts: the way back is not part of it"]


@pytest.mark.parametrize(
    "words, message",
    [
        (["none.yaml"], "none.yaml: there is no such file"),
        (["PROGRAM", "--robot", "ur_ur10e"], "the tree is written for robot 'kuka_kr16_r2010_2', not for 'ur_ur10e'"),
        (["PROGRAM", "--payload", "17"], "a payload of 17 kg is more than kuka_kr16_r2010_2 is rated for"),
    ],
)
def test_bad_input_is_one_sentence_with_exit_code_2(program, capsys, words, message):
    assert main(["simulate", *ROBOT, *(word.replace("PROGRAM", str(program)) for word in words)]) == 2
    shown = capsys.readouterr()
    assert message in shown.err
    assert (shown.out, shown.err.count("\n")) == ("", 1)


def test_a_motion_through_coarse_zones_is_one_row(tmp_path, capsys):
    path = tmp_path / "rounded.yaml"
    there_and_back({"radius_m": 0.08}).save(path)
    assert main(["simulate", str(path), *ROBOT]) == 0
    rows = [line.split("  ")[0] for line in capsys.readouterr().out.splitlines()]
    assert "place (and 2 before)" in rows
    assert "home (and 1 before)" in rows
    assert simulated(capsys, path)["moves"][0]["through"] == ["a", "b"]
