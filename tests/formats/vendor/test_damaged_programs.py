"""Programs that people have edited by hand: brackets that are not closed, numbers of lines that are not in order."""

import pytest

from robojoule.api import optimize
from robojoule.formats.program import load_program
from robojoule.formats.vendor.lines import flaw_of
from robojoule.robots import load_robot

KR, UR, FANUC = (load_robot(name, payload_kg=3) for name in ("kuka_kr16_r2010_2", "ur_ur10e", "fanuc_m20_25_18d"))
A, B, C = ("0,-90,90,0,20,0", "30,-80,90,0,20,0", "60,-70,80,0,30,0")
POS = """/POS
P[1]{
   GP1:
\tUF : 0, UT : 0,
\tJ1=    0.000 deg,\tJ2=    0.000 deg,\tJ3=    0.000 deg,
\tJ4=    0.000 deg,\tJ5=    -90.000 deg,\tJ6=    0.000 deg
};
P[2]{
   GP1:
\tUF : 0, UT : 0,
\tJ1=    30.000 deg,\tJ2=    0.000 deg,\tJ3=    0.000 deg,
\tJ4=    0.000 deg,\tJ5=    -90.000 deg,\tJ6=    0.000 deg
};
/END
"""


def axes(values: str) -> str:
    return "{" + ",".join(f"A{axis} {value}" for axis, value in enumerate(values.split(","), start=1)) + "}"


def krl(*lines: str) -> str:
    return "\n".join(["DEF cell()", "BAS(#INITMOV,0)", *lines, "END", ""])


def rapid(*lines: str) -> str:
    return "\n".join(["MODULE cell", "PROC main()", *lines, "ENDPROC", "ENDMODULE", ""])


def jointtarget(values: str, speed_s: float = 1.0) -> str:
    return f"MoveAbsJ [[{values}],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v1000\\T:={speed_s:g},fine,tool0;"


def script(*lines: str) -> str:
    return "\n".join(["def cell():", *(f"  {line}" for line in lines), "end", ""])


def tp(*lines: str) -> str:
    return "\n".join(["/PROG  CELL", "/ATTR", "DEFAULT_GROUP\t= 1,*,*,*,*;", "/MN", *lines, POS])


@pytest.mark.parametrize(
    "code, flaw",
    [
        ("PTP {A1 0, A2 10", " (its '{' is not closed)"),
        ("movej([0, 1, 2, 3, 4, 5, a=1)", " (its '[' is not closed)"),
        ("movej([0, 1, 2, 3, 4, 5], a=1))", " (nothing opens its ')')"),
        ('TPWrite "a ( in a text";', ""),
        ("PTP {A1 0,A2 (10+5)*2}", ""),
        ("", ""),
    ],
)
def test_the_bracket_that_lacks_its_other_half_is_named(code, flaw):
    assert flaw_of(code) == flaw


DAMAGED = {
    "krl brace": (
        "cell.src",
        krl(f"PTP {axes(A)}", f"PTP {axes(B)[:-1]}", f"PTP {axes(A)}", f"PTP {axes(C)}"),
        KR,
        "line 4: the motion is not understood (its '{' is not closed): PTP {A1 30",
    ),
    "rapid bracket": (
        "cell.mod",
        rapid(jointtarget(A), jointtarget(B).replace("9E9]]", "9E9]"), jointtarget(A), jointtarget(C)),
        KR,
        "line 4: not understood (its '[' is not closed), it may move the robot: MoveAbsJ [[30",
    ),
    "urscript parenthesis": (
        "cell.script",
        script(
            "movej([0,-1,1,-1,-1,0])", "movej([1,-1,1,-1,-1,0]", "movej([0,-1,1,-1,-1,0])", "movej([1,-1,1,-1,-1,1])"
        ),
        UR,
        "line 3: the motion is not understood (its '(' is not closed): movej([1",
    ),
    "teach pendant bracket": (
        "cell.ls",
        tp("   1:J P[1] 50% FINE ;", "   2:J P[2 50% FINE ;", "   3:J P[1] 50% FINE ;", "   4:J P[2] 50% FINE ;"),
        FANUC,
        "line 6: the motion is not understood (its '[' is not closed): J P[2",
    ),
}


@pytest.mark.parametrize("name, text, robot, note", DAMAGED.values(), ids=DAMAGED)
def test_a_motion_with_an_open_bracket_is_kept_and_named(tmp_path, name, text, robot, note):
    """The motion behind it starts somewhere, so only the last one is planned."""
    path = tmp_path / name
    path.write_text(text)
    program = load_program(path, robot)
    assert any(one.startswith(note) for one in program.notes), program.notes
    assert len(program.moves) == 1


HEADS = {
    "krl": (
        "cell.src",
        krl(f"PTP {axes(A)}", "IF ($IN[1] THEN", f"PTP {axes(B)}", "ENDIF", f"PTP {axes(C)}", f"PTP {axes(A)}"),
        KR,
    ),
    "rapid": (
        "cell.mod",
        rapid(jointtarget(A), "IF (di1=1 THEN", jointtarget(B), "ENDIF", jointtarget(C), jointtarget(A)),
        KR,
    ),
    "urscript": (
        "cell.script",
        script(
            "movej([0,-1,1,-1,-1,0])",
            "if (get_digital_in(1):",
            "movej([1,-1,1,-1,-1,0])",
            "end",
            "movej([1,-1,1,-1,-1,1])",
            "movej([0,-1,1,-1,-1,0])",
        ),
        UR,
    ),
    "teach pendant": (
        "cell.ls",
        tp(
            "   1:J P[1] 50% FINE ;",
            "   2:  IF (DI[1]=ON,THEN ;",
            "   3:J P[2] 50% FINE ;",
            "   4:  ENDIF ;",
            "   5:J P[2] 50% FINE ;",
            "   6:J P[1] 50% FINE ;",
        ),
        FANUC,
    ),
}


@pytest.mark.parametrize("name, text, robot", HEADS.values(), ids=HEADS)
def test_what_stands_in_a_damaged_block_is_not_taken_to_run(tmp_path, name, text, robot):
    path = tmp_path / name
    path.write_text(text)
    program = load_program(path, robot)
    said = "whether this runs is not known, it may move the robot: IF ("
    assert any(said.lower() in one.lower() and "its '(' is not closed" in one for one in program.notes), program.notes
    assert len(program.moves) == 1  # the last one: the one before it starts where nobody knows


@pytest.mark.parametrize(
    "numbers",
    [
        ["  10", "  20", "  30", "  40"],
        ["1", "20", "300", "4000"],
        ["   1", "   2", "   2", "   7"],
        ["   4", "3", "  2", " 1"],
        ["1", "   2", "      3", " 4"],
        ["\t1", "\t2", "\t\t3", "4"],
        ["   1", "      1", "   2", "   3"],
    ],
    ids=["tens", "growing", "doubled", "falling", "set in", "tabs", "set in and doubled"],
)
def test_numbers_of_lines_may_be_irregular(tmp_path, numbers):
    path = tmp_path / "cell.ls"
    points = (1, 2, 1, 2)
    path.write_text(tp(*(f"{number}:J P[{at}] 50% FINE    ;" for number, at in zip(numbers, points, strict=True))))
    program = load_program(path, FANUC)
    assert len(program.moves) == 3
    plan = optimize(program, FANUC, cycle_time="+30%")
    plan.program.save(tmp_path / "planned.ls")
    again = load_program(tmp_path / "planned.ls", FANUC)
    assert again.tree.operations == plan.program.tree.operations
    before, after = (one.read_text().splitlines() for one in (path, tmp_path / "planned.ls"))
    kept = [line for line in after if "WAIT" not in line and "!Wait" not in line]
    assert [line.split(":")[0] for line in kept] == [line.split(":")[0] for line in before]
