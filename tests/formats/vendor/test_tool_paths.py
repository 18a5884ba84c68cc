"""Linear and circular motions of programs: their path, speed and duration, and what counts as a joint motion."""

import numpy as np
import pytest

from robojoule.api import optimize, simulate
from robojoule.errors import InputError
from robojoule.formats.conversion import converted
from robojoule.formats.program import load_program
from robojoule.formats.vendor.trace import Beside
from robojoule.programs.tool_moves import tool_moves_of_tree
from robojoule.programs.tree_check import in_model_angles
from robojoule.robots import load_robot
from robojoule.robots.rigid_body import Placement
from tests.formats.vendor.test_ur import A, B, C, pose_text

UR = load_robot("ur_ur10e", payload_kg=3)
KR = load_robot("kuka_kr16_r2010_2", payload_kg=3)
TCP = "set_tcp(p[0,0,0.15,0,0,0])\n"
LINE = "pose_trans(" + pose_text(A) + ", p[{},{},0.15,0,0,0])"  # from where the tool is at A
HEAD = "&ACCESS RVP\nDEF seam()\nBAS(#INITMOV,0)\n"


def ur(tmp_path, body, **keys):
    path = tmp_path / "seam.script"
    path.write_text("\n".join(["def seam():", *(f"  {line}" for line in body.splitlines()), "end\n"]))
    return load_program(path, UR, **keys)


def krl(tmp_path, body, **keys):
    path = tmp_path / "seam.src"
    path.write_text(HEAD + body + "\nEND\n")
    return load_program(path, KR, **keys)


def tool_move(program, robot):
    """The first motion along a path of the tool."""
    return next(one for one in tool_moves_of_tree(in_model_angles(program.tree, robot)) if one is not None)


def test_a_line_takes_what_its_length_and_speed_say(tmp_path):
    """L / v + v / a + a jerk phase; 0.3 m along the tool's own x, so the tool keeps its orientation."""
    line = LINE.format(0.3, 0)
    program = ur(tmp_path, f"{TCP}movej({A})\nmovel({line}, a=0.8, v=0.2)\nmovej({B})\nmovej({A})")
    move = program.moves[0]
    assert move.fixed
    assert move.tool_path.type == "linear"
    assert move.tool_path.tool_m == (0.0, 0.0, 0.15)
    assert move.tool_path.acceleration_m_s2 == 0.8
    run = simulate(program, UR)
    assert run.durations_s[0] == pytest.approx(0.3 / 0.2 + 0.2 / 0.8 + UR.drives.filter_time_s, rel=1e-6)
    assert tool_move(program, UR).followed(UR).course.length_m == pytest.approx(0.3, abs=1e-9)
    assert any(note.endswith("the linear motion keeps its speed") for note in program.notes)
    plan = optimize(program, UR, cycle_time="+20%")
    assert plan.program.moves[0] == move.model_copy(
        update={"added_wait_after_s": plan.program.moves[0].added_wait_after_s}
    )


def test_a_duration_overrules_the_speed(tmp_path):
    line = LINE.format(0.3, 0)
    program = ur(tmp_path, f"{TCP}movej({A})\nmovel({line}, a=0.8, v=0.2, t=2.75)\nmovej({B})\nmovej({A})")
    assert simulate(program, UR).durations_s[0] == pytest.approx(2.75, rel=1e-6)


def test_too_fast_a_line_takes_longer_and_that_is_told(tmp_path):
    line = LINE.format(0.3, 0)
    program = ur(tmp_path, f"{TCP}movej({A})\nmovel({line}, t=0.2)\nmovej({B})\nmovej({A})")
    assert program.moves[0].tool_path is not None
    assert simulate(program, UR).durations_s[0] > 0.3
    assert any("by the robot's figures it takes" in note for note in program.notes)


def test_a_circle_passes_its_point(tmp_path):
    """Half a circle of 50 mm radius in the plane of the tool."""
    via, end = LINE.format(0.05, 0.05), LINE.format(0.1, 0.0)
    program = ur(tmp_path, f"{TCP}movej({A})\nmovec({via}, {end}, a=1, v=0.1)\nmovej({B})\nmovej({A})")
    length = np.pi * 0.05
    assert program.moves[0].tool_path.type == "circular"
    assert tool_move(program, UR).followed(UR).course.length_m == pytest.approx(length, abs=1e-6)
    expected = length / 0.1 + 0.1 / 1.0 + UR.drives.filter_time_s
    assert simulate(program, UR).durations_s[0] == pytest.approx(expected, rel=1e-5)


JOINT_CASES = {
    "a zone before it": (
        f"{TCP}movej({B})\nmovej({A}, r=0.02)\nmovel({LINE.format(0.2, 0)}, v=0.1)\nmovej({B})",
        ["line 5: the linear motion is kept, and counted as a joint motion of the same duration: a zone joins it"],
    ),
    "a zone behind it": (
        f"{TCP}movej({A})\nmovel({LINE.format(0.2, 0)}, v=0.1, r=0.02)\nmovej({B})",
        ["line 4: the linear motion is kept, and counted as a joint motion of the same duration: a zone joins it"],
    ),
    "another configuration": (
        f"movej({A})\nmovel({[A[0], A[1], A[2], A[3], A[4], A[5] + 6.0]}, v=0.1)\nmovej({B})",
        ["line 3: the linear motion is kept, and counted as a joint motion", "the arm gets there with wrist_3"],
    ),
    "a circle to where it starts": (
        f"{TCP}movej({A})\nmovec({LINE.format(0.1, 0)},{LINE.format(0, 0)}, v=0.1)\nmovej({B})",
        ["line 4: the circular motion is kept", "the circle ends where it starts"],
    ),
    "a circle that is none": (
        f"{TCP}movej({A})\nmovec({LINE.format(0.3, 0)},{LINE.format(0.2, 0)}, v=0.1)\nmovej({B})",
        ["line 4: the circular motion is kept", "the three points of the circle are on a line"],
    ),
}


@pytest.mark.parametrize("body, notes", JOINT_CASES.values(), ids=JOINT_CASES)
def test_what_cannot_be_followed_counts_as_a_joint_motion_and_is_told(tmp_path, body, notes):
    program = ur(tmp_path, body)
    assert not any(move.tool_path for move in program.moves)
    assert sum(move.fixed for move in program.moves) == 1
    for text in notes:
        assert any(text in note for note in program.notes), program.notes


def test_a_speed_that_the_way_is_too_short_for_does_not_count(tmp_path):
    """v = 25 m/s over 0.03 m at 1 m/s2: what is reached is 0.17 m/s, which no joint minds."""
    program = ur(tmp_path, f"{TCP}movej({A})\nmovel({LINE.format(0.03, 0)}, a=1, v=25)\nmovej({B})\nmovej({A})")
    assert program.moves[0].tool_path.type == "linear"
    filter_s = UR.drives.filter_time_s
    assert simulate(program, UR).durations_s[0] == pytest.approx(
        filter_s + 2 * np.sqrt(filter_s**2 / 4 + 0.03), rel=1e-5
    )


def test_a_negative_acceleration_is_no_speed(tmp_path):
    program = ur(tmp_path, f"{TCP}movej({A})\nmovel({LINE.format(0.03, 0)}, a=-1, v=0.2)\nmovej({B})\nmovej({A})")
    assert any("does not say how fast the linear motion is" in note for note in program.notes)


def test_joint_targets_of_lines_have_the_tool_of_the_program(tmp_path):
    """The tool turns on the way, so its line is not that of the flange."""
    program = ur(tmp_path, f"{TCP}movej({A})\nmovel({B}, v=0.2)\nmovej({C})\nmovej({A})")
    assert program.moves[0].tool_path.tool_m == (0.0, 0.0, 0.15)
    unknown = ur(tmp_path, f"movej({A})\nmovel({B}, v=0.2)\nmovej({C})\nmovej({A})")
    assert any("the flange is taken to keep to the path" in note for note in unknown.notes)
    given = Beside(tool=Placement(np.eye(3), np.array([0.0, 0.0, 0.15])))
    told = ur(tmp_path, f"movej({A})\nmovel({B}, v=0.2)\nmovej({C})\nmovej({A})", beside=given)
    assert told.moves[0].path == program.moves[0].path


def test_a_tree_keeps_the_path_and_a_table_says_what_it_does_not(tmp_path):
    line = LINE.format(0.3, 0)
    program = ur(tmp_path, f"{TCP}movej({A})\nmovel({line}, a=0.8, v=0.2)\nmovej({B})\nmovej({A})")
    converted(program, tmp_path / "seam.yaml", UR)
    again = load_program(tmp_path / "seam.yaml")
    assert again.moves[0].path == program.moves[0].path
    one, other = simulate(program, UR), simulate(again, UR)
    assert np.array_equal(one.vertex_energies_j, other.vertex_energies_j)
    for name in ("seam.csv", "seam2.src"):
        lost = converted(again, tmp_path / name, UR).lost
        assert any(
            "the path of move 'move-1' is left out: a joint motion of the same duration" in text for text in lost
        )
    table = simulate(load_program(tmp_path / "seam.csv").counted_as("pendant"), UR)
    assert table.durations_s == pytest.approx(other.durations_s, rel=1e-5)
    with pytest.raises(InputError, match="joint positions cannot hold the path of move 'move-1'"):
        again.save(tmp_path / "plain.csv")


def test_kuka_lines_turn_at_the_speed_of_their_orientation(tmp_path):
    """A turn in place of 90 degrees at 45 deg/s, about the tool's own axis."""
    home = "{A1 0,A2 -80,A3 90,A4 0,A5 60,A6 0}"
    body = f"$VEL.CP=0.5\n$VEL.ORI1=45\n$ACC.CP=1\nPTP {home}\nLIN {{A6 90}}\nPTP {{A1 40}}\nPTP {home}"
    program = krl(tmp_path, body, beside=Beside(tool=Placement(np.eye(3), np.array([0.0, 0.0, 0.2]))))
    assert program.moves[0].tool_path.acceleration_rad_s2 == pytest.approx(4.0 * np.pi)
    expected = 90.0 / 45.0 + np.radians(45.0) / (4.0 * np.pi) + KR.drives.filter_time_s
    assert simulate(program, KR).durations_s[0] == pytest.approx(expected, rel=1e-6)
