"""What programs are told about: once each, with lines; what is not simulated; another vendor's robot."""

import pytest

from robojoule.api import optimize, simulate
from robojoule.cli import main
from robojoule.formats.program import load_program
from robojoule.formats.vendor.trace import Note, told
from robojoule.robots import load_robot
from tests.formats.vendor.test_damaged_programs import A, B, C, axes, jointtarget, krl, rapid, script, tp

KR, UR, FANUC = (load_robot(name, payload_kg=3) for name in ("kuka_kr16_r2010_2", "ur_ur10e", "fanuc_m20_25_18d"))


def test_what_is_the_same_for_several_lines_is_said_once():
    notes = [Note(4, "kept"), Note(5, "other"), *(Note(line, "kept") for line in range(6, 17))]
    assert told(notes) == ("12 lines (4, 6, 7, 8, 9, 10, 11, 12, ...): kept", "line 5: other")
    assert told(notes[:3]) == ("2 lines (4, 6): kept", "line 5: other")


def loaded(tmp_path, name, text, robot):
    path = tmp_path / name
    path.write_text(text)
    return load_program(path, robot)


NOT_SIMULATED = {
    "krl override": (
        "cell.src",
        krl("$OV_PRO=50", f"PTP {axes(A)}", f"PTP {axes(B)}", "$OV_PRO=80", f"PTP {axes(A)}"),
        KR,
        ["line 3: $OV_PRO is kept and not simulated: speeds are those at an override of 100 %"],
    ),
    "krl accelerations": (
        "cell.src",
        krl(*(f"$ACC_AXIS[{axis}]=50" for axis in range(1, 7)), f"PTP {axes(A)}", f"PTP {axes(B)}", f"PTP {axes(A)}"),
        KR,
        ["line 3: $ACC_AXIS is kept and not simulated: accelerations are those of the robot"],
    ),
    "krl full values": (
        "cell.src",
        krl("$OV_PRO=100", "$ACC_AXIS[1]=100", f"PTP {axes(A)}", f"PTP {axes(B)}", f"PTP {axes(A)}"),
        KR,
        [],
    ),
    "rapid": (
        "cell.mod",
        rapid("AccSet 50,50;", "PathAccLim TRUE\\AccMax:=4,FALSE;", jointtarget(A), jointtarget(B), jointtarget(A)),
        KR,
        ["line 3: AccSet 50,50 is kept and not simulated", "line 4: PathAccLim is kept and not simulated"],
    ),
    "rapid speeds": (
        "cell.mod",
        rapid("VelSet 50,800;", jointtarget(A), jointtarget(B), jointtarget(A)),
        KR,
        ["line 3: VelSet is taken to act on speeddata and not on \\T"],
    ),
    "teach pendant": (
        "cell.ls",
        tp(
            "   1:  OVERRIDE=30% ;",
            "   2:J P[1] 50% FINE ACC50 ;",
            "   3:J P[2] 50% FINE ACC50 ;",
            "   4:J P[1] 50% FINE ;",
        ),
        FANUC,
        [
            "line 5: OVERRIDE=30% is kept and not simulated: speeds of the program are shares of it",
            "2 lines (6, 7): ACC50 is kept and not simulated: accelerations are those of the robot",
        ],
    ),
}


@pytest.mark.parametrize("name, text, robot, notes", NOT_SIMULATED.values(), ids=NOT_SIMULATED)
def test_what_is_not_simulated_is_told_once(tmp_path, name, text, robot, notes):
    program = loaded(tmp_path, name, text, robot)
    said = [one for one in program.notes if "not simulated" in one or "taken to act" in one]
    assert len(said) == len(notes)
    for found, wanted in zip(said, notes, strict=True):
        assert found.startswith(wanted)


def test_joint_motions_whose_speed_cannot_be_written_are_told(tmp_path):
    text = krl("$VEL_AXIS[1]=80", *(f"PTP {axes(at)}" for at in (A, B, A)))
    program = loaded(tmp_path, "cell.src", text, KR)
    assert all(move.fixed for move in program.moves)
    assert any(
        one.startswith("2 lines (5, 6): the motion keeps its speed, which plans cannot write") for one in program.notes
    )
    free = loaded(tmp_path, "cell.src", text.replace("$VEL_AXIS[1]=80", "BAS(#VEL_PTP,80)"), KR)
    assert not any(move.fixed for move in free.moves)
    assert not any("cannot write" in one for one in free.notes)


def test_a_program_of_another_vendor_is_warned_of(tmp_path):
    text = krl(f"PTP {axes('0,-90,90,0,20,0')}", f"PTP {axes('20,-90,90,0,20,0')}", f"PTP {axes(C)}")
    program = loaded(tmp_path, "cell.src", text, UR)
    said = "the program is in the language of KUKA (KUKA KRL), but ur_ur10e is of Universal Robots"
    assert said in simulate(program, UR).warnings
    assert said in optimize(program, UR, cycle_time="+10%").warnings
    own = loaded(tmp_path, "cell.src", text, KR)
    assert not any("language" in one for one in simulate(own, KR).warnings)


def test_what_the_program_sets_to_be_carried_stands_at_the_head(tmp_path, capsys):
    lines = ["movej([0,-1,1,-1,-1,0])", "movej([1,-1,1,-1,-1,0])", "movej([0,-1,1,-1,-1,0])"]
    path = tmp_path / "cell.script"
    for set_, said in (
        (["set_payload(2.5)"], "payload 2.5 kg as the program sets it"),
        ([], "payload 0 kg"),
    ):
        path.write_text(script(*set_, *lines))
        assert main(["optimize", str(path), "--robot", "ur_ur10e", "--cycle-time", "+10%"]) == 0
        assert capsys.readouterr().out.splitlines()[0] == f"cell on ur_ur10e, {said}"
    path.write_text(script(*lines[:2], "set_payload(4)", *lines))
    assert main(["simulate", str(path), "--robot", "ur_ur10e", "--payload", "1"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "cell on ur_ur10e, payload 1 and 4 kg as the program sets it"


def test_convert_says_the_same_once(tmp_path, capsys):
    linear = "movel([{},-1.2,1.8,-2.1,-1.57,0], v=0.2)"
    text = script("movej([0,-1.2,1.8,-2.1,-1.57,0])", *(linear.format(0.1 * k) for k in (1, 2, 3, 4)))
    (tmp_path / "cell.script").write_text(text)
    assert main(["convert", str(tmp_path / "cell.script"), str(tmp_path / "cell.yaml"), "--robot", "ur_ur10e"]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "linear motion" in line]
    assert len(said) == 1
    assert "4 lines (3, 4, 5, 6): the linear motion keeps its speed" in said[0]


def test_what_the_new_format_cannot_say_of_many_moves_is_said_once(tmp_path, capsys):
    linear = "movel([{},-1.2,1.8,-2.1,-1.57,0], v=0.2)"
    text = script("movej([0,-1.2,1.8,-2.1,-1.57,0])", *(linear.format(0.05 * k) for k in range(1, 11)))
    (tmp_path / "cell.script").write_text(text)
    assert main(["convert", str(tmp_path / "cell.script"), str(tmp_path / "cell.csv"), "--robot", "ur_ur10e"]) == 0
    (said,) = [line for line in capsys.readouterr().err.splitlines() if "the path of move" in line]
    assert "takes its place (and so of 'move-2', 'move-3', 'move-4', 'move-5', 'move-6', 'move-7', and 3 more)" in said
