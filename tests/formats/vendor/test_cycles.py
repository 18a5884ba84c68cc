"""Loops without end in all languages: what a pass sets holds for the next one, and the pass that repeats is planned."""

import numpy as np
import pytest

from robojoule.formats.program import load_program
from robojoule.programs.operation_tree import PayloadOperation
from robojoule.robots import load_robot
from tests.formats.vendor.fanuc_text import listing

POINTS = {"A": (0, -90, 90, 0, 0, 0), "B": (50, -70, 80, 0, 30, 0), "C": (-20, -60, 100, 40, 0, 0)}


def krl(point):
    return "PTP {" + ",".join(f"A{axis} {value}" for axis, value in enumerate(POINTS[point], start=1)) + "}\n"


def ur(point, more=""):
    return f"movej([{','.join(repr(float(value)) for value in np.radians(POINTS[point]))}]{more})\n"


def rapid(point):
    axes = ",".join(map(str, POINTS[point]))
    return f"MoveAbsJ [[{axes}],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v1000,fine,tool0;\n"


def fanuc(speed, number):
    return f"J P[{number}] {speed} FINE"


def program_of(folder, suffix, text, robot=None):
    path = folder / f"cycle{suffix}"
    path.write_text(text)
    return load_program(path, robot)


def in_krl(folder, before, loop):
    return program_of(folder, ".src", f"DEF cycle( )\n{before}LOOP\n{loop}ENDLOOP\nEND\n")


def in_ur(folder, before, loop):
    robot = load_robot("ur_ur10e")
    return program_of(folder, ".script", f"{before}while True:\n{loop}end\n", robot)


def in_rapid(folder, before, loop, data=""):
    text = f"MODULE cycle\n{data}PROC main()\n{before}WHILE TRUE DO\n{loop}ENDWHILE\nENDPROC\nENDMODULE\n"
    return program_of(folder, ".mod", text, load_robot("kuka_kr16_r2010_2"))


def in_fanuc(folder, lines):
    return program_of(folder, ".ls", listing(lines))


def percents(program):
    return [move.speed_limit_percent for move in program.moves]


def test_a_speed_that_krl_has_set_holds_in_the_next_pass(tmp_path):
    program = in_krl(tmp_path, f"BAS(#VEL_PTP,100)\n{krl('A')}", f"{krl('B')}BAS(#VEL_PTP,30)\n{krl('C')}{krl('A')}")
    assert percents(program) == [30.0, 30.0, 30.0]
    assert program.moves[0].fixed  # it has another speed in the first pass
    assert any("line 4: the first pass of the loop differs" in note for note in program.notes)


def test_speeds_that_are_written_hold_in_all_passes_of_krl(tmp_path):
    """The number before the loop and the one in it say the speed of the same motion."""
    program = in_krl(tmp_path, f"BAS(#VEL_PTP,30)\n{krl('A')}", f"{krl('B')}BAS(#VEL_PTP,30)\n{krl('C')}{krl('A')}")
    wanted = dict(zip([move.name for move in program.moves], (20.0, 25.0, 30.0), strict=True))
    (text, *_) = program.source.texts(program.tree.with_plan(wanted))
    loop = text.split("LOOP\n", 1)[1].split("ENDLOOP")[0].splitlines()
    speed, found = None, []
    for line in [*loop, *loop]:  # as a controller runs it: the second pass counts
        if line.startswith("BAS"):
            speed = float(line.split(",")[1].strip(")"))
        elif line.startswith("PTP"):
            found.append(speed)
    assert found[3:] == [20.0, 25.0, 30.0]


def test_a_speed_in_a_variable_holds_in_the_next_pass(tmp_path):
    program = in_ur(tmp_path, f"v1=0.5\n{ur('A')}", f"{ur('B', ',v=v1')}v1=1.0\n{ur('A', ',v=v1')}")
    first, second = percents(program)
    assert first == pytest.approx(second)
    assert program.moves[0].fixed and not program.moves[1].fixed


def test_velset_holds_in_the_next_pass(tmp_path):
    first, second = percents(in_rapid(tmp_path, rapid("A"), f"{rapid('B')}VelSet 50,800;\n{rapid('A')}"))
    assert first == pytest.approx(second, rel=0.05)


def test_a_register_holds_in_the_next_pass(tmp_path):
    lines = ["R[5]=40", fanuc("100%", 1), "LBL[1]", fanuc("R[5]%", 2), "R[5]=80", fanuc("R[5]%", 3), "JMP LBL[1]"]
    assert percents(in_fanuc(tmp_path, lines)) == [80.0, 80.0]


PAYLOADS = {
    "krl": lambda folder: in_krl(folder, krl("A"), f"{krl('B')}$LOAD={{M 4,CM {{X 0,Y 0,Z 50}}}}\n{krl('A')}"),
    "ur": lambda folder: in_ur(folder, ur("A"), f"{ur('B')}set_payload(4,[0,0,0.05])\n{ur('A')}"),
    "rapid": lambda folder: in_rapid(
        folder,
        rapid("A"),
        f"{rapid('B')}GripLoad part;\n{rapid('A')}",
        "PERS loaddata part:=[4,[0,0,50],[1,0,0,0],0,0,0];\n",
    ),
}


@pytest.mark.parametrize("name", PAYLOADS)
def test_a_payload_that_is_never_put_down_is_carried_in_all_further_passes(tmp_path, name):
    program = PAYLOADS[name](tmp_path)
    payload, *others = program.tree.operations
    assert isinstance(payload, PayloadOperation) and payload.mass_kg == pytest.approx(4, abs=0.01)
    assert [type(one).__name__ for one in others] == ["MoveOperation", "MoveOperation"]


COUNTERS = {
    "krl": lambda folder: in_krl(
        folder, f"DECL INT I\nI=0\n{krl('A')}", f"I=I+1\nIF I>3 THEN\n{krl('C')}I=0\nENDIF\n{krl('B')}{krl('A')}"
    ),
    "ur": lambda folder: in_ur(folder, f"i=0\n{ur('A')}", f"i=i+1\nif i>3:\n{ur('C')}i=0\nend\n{ur('B')}{ur('A')}"),
    "rapid": lambda folder: in_rapid(
        folder,
        f"n:=0;\n{rapid('A')}",
        f"n:=n+1;\nIF n>3 THEN\n{rapid('C')}n:=0;\nENDIF\n{rapid('B')}{rapid('A')}",
        "VAR num n;\n",
    ),
}


@pytest.mark.parametrize("name", COUNTERS)
def test_a_pass_that_differs_is_told(tmp_path, name):
    program = COUNTERS[name](tmp_path)
    assert len(program.moves) == 2
    assert any(
        "passes of the loop are not all the same (pass 4 differs): pass 1 is planned" in n for n in program.notes
    )


def test_a_position_that_goes_on_from_pass_to_pass_is_told(tmp_path):
    lines = ["R[1]=1", fanuc("100%", 4), "LBL[1]", fanuc("100%", "R[1]"), fanuc("50%", 4), "R[1]=R[1]+1", "JMP LBL[1]"]
    notes = in_fanuc(tmp_path, lines).notes
    assert any("passes of the loop are not all the same (pass 2 differs)" in note for note in notes)


STOPS = {
    "krl": lambda folder: in_krl(
        folder, f"DECL BOOL STP\nSTP=FALSE\n{krl('A')}", f"{krl('B')}IF STP THEN\nEXIT\nENDIF\n{krl('A')}"
    ),
    "ur": lambda folder: in_ur(folder, f"stp=False\n{ur('A')}", f"{ur('B')}if stp:\n  break\nend\n{ur('A')}"),
    "rapid": lambda folder: in_rapid(
        folder, rapid("A"), f"{rapid('B')}IF stp RETURN;\n{rapid('A')}", "VAR bool stp:=FALSE;\n"
    ),
}


@pytest.mark.parametrize("name", STOPS)
def test_a_loop_whose_end_is_known_not_to_come_is_the_cycle(tmp_path, name):
    program = STOPS[name](tmp_path)
    assert len(program.moves) == 2 and not any("loop" in note for note in program.notes)


def test_a_motion_that_ran_slower_before_the_loop_keeps_its_speeds(tmp_path):
    functions = f"def go(speed):\n{ur('B', ',v=speed')}{ur('A', ',v=0.4')}end\n"
    program = in_ur(tmp_path, f"{functions}{ur('A')}go(0.2)\n", "go(0.9)\n")
    assert [move.fixed for move in program.moves] == [True, False]


def test_a_motion_that_comes_from_elsewhere_in_another_pass_gets_no_duration(tmp_path):
    """Its duration would be that of another way there; a share of the limits holds on any way."""
    loop = f"{rapid('B')}IF b THEN\n{rapid('C')}ENDIF\nb:=NOT b;\n{rapid('A')}"
    program = in_rapid(tmp_path, rapid("A"), loop, "VAR bool b:=FALSE;\n")
    assert [move.fixed for move in program.moves] == [False, True]
    loop = f"{krl('B')}IF I>0 THEN\n{krl('C')}ENDIF\nI=1-I\n{krl('A')}"
    program = in_krl(tmp_path, f"DECL INT I\nI=0\n{krl('A')}", loop)
    assert [move.fixed for move in program.moves] == [False, False]
