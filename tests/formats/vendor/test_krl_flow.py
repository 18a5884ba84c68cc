"""Which lines of a KRL program run, and what is not known behind those of which nobody knows it."""

import numpy as np
import pytest

from robojoule.formats.program import load_program
from robojoule.formats.vendor.krl.program import read_krl
from robojoule.formats.vendor.trace import Beside, CycleStart, Load, Motion, PoseTarget, Unknown, Wait
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload
from tests.formats.vendor.krl_text import AT_HOME, HOME

SUB = "\nEND\nDEF sub( )\n"


def traced(folder, body, beside=None, dat=""):
    text = body if "DEF main" in body else f"DEF main( )\n{body}\nEND\n"
    (folder / "main.src").write_text(text)
    if dat:
        (folder / "main.dat").write_text(dat)
    trace = read_krl(folder / "main.src").trace(beside or Beside())
    events = [one for one in trace.events if not (isinstance(one, Wait) and one.duration_s == 0.0)]  # stops, no waits
    return events, [str(note) for note in trace.notes]


def axes(found):
    """Angles of axis 1 of all motions whose targets are known. [deg]"""
    return [
        None if one.target is None else round(float(np.degrees(one.target.angles_rad[0])), 6)
        for one in found
        if isinstance(one, Motion)
    ]


def kinds(found):
    return [type(one) for one in found]


def go(angle):
    return f"PTP {{A1 {angle}}}\n"


# Ends of loops and routines


def test_a_loop_without_end_in_a_subprogram_is_the_cycle_of_the_program(tmp_path):
    text = f"DEF main( )\nPTP {HOME}\ncyc()\n{go(99)}END\nDEF cyc( )\nLOOP\n{go(10)}{go(0)}ENDLOOP\nEND\n"
    found, _ = traced(tmp_path, text)
    assert axes(found) == [0, 10, 0] and isinstance(found[1], CycleStart)


def test_a_return_ends_its_routine_alone(tmp_path):
    found, _ = traced(tmp_path, f"DEF main( )\nsub()\n{go(2)}{SUB}{go(1)}RETURN\n{go(9)}END\n")
    assert axes(found) == [1, 2]


def test_a_loop_that_is_left_for_sure_is_not_the_cycle(tmp_path):
    found, _ = traced(tmp_path, f"PTP {HOME}\nLOOP\n{go(1)}EXIT\nENDLOOP\n{go(2)}")
    assert axes(found) == [0, 1, 2] and CycleStart not in kinds(found)


@pytest.mark.parametrize("head", ["LOOP", "WHILE TRUE"])
def test_a_loop_that_counts_its_passes_is_counted_out(tmp_path, head):
    foot = "ENDLOOP" if head == "LOOP" else "ENDWHILE"
    body = f"INT I\nI=0\n{head}\nI=I+1\nPTP {{A1 I}}\nIF I==2 THEN\nEXIT\nENDIF\n{foot}\n{go(9)}"
    found, _ = traced(tmp_path, body)
    assert axes(found) == [1, 2, 9] and CycleStart not in kinds(found)


def test_a_loop_that_is_never_left_by_its_exit_is_the_cycle(tmp_path):
    found, _ = traced(tmp_path, f"INT I\nI=0\nLOOP\n{go(1)}{go(2)}IF I==2 THEN\nEXIT\nENDIF\nENDLOOP\n{go(9)}")
    assert axes(found) == [1, 2] and isinstance(found[0], CycleStart)


def test_a_loop_of_very_many_passes_is_told_to_be_the_cycle(tmp_path):
    found, notes = traced(tmp_path, f"INT I\nI=0\nLOOP\n{go(1)}I=I+1\nIF I==9999 THEN\nEXIT\nENDIF\nENDLOOP\n{go(9)}")
    assert axes(found) == [1] and isinstance(found[0], CycleStart)
    assert any("not left within 100 passes: one of them is the cycle" in note for note in notes)


def test_a_loop_that_is_left_by_a_signal_is_the_cycle_if_it_moves(tmp_path):
    found, _ = traced(tmp_path, f"LOOP\n{go(1)}{go(2)}IF $IN[1] THEN\nEXIT\nENDIF\nENDLOOP\n{go(9)}")
    assert axes(found) == [1, 2] and isinstance(found[0], CycleStart)


def test_a_loop_that_waits_for_a_signal_is_a_wait(tmp_path):
    poll = "LOOP\nIF $IN[1] THEN\nEXIT\nENDIF\nENDLOOP\n"
    found, _ = traced(tmp_path, f"{go(1)}{poll}{go(2)}")
    assert kinds(found) == [Motion, Wait, Motion] and found[1].duration_s is None
    found, _ = traced(tmp_path, f"LOOP\n{go(1)}{poll}{go(2)}ENDLOOP")
    assert kinds(found) == [CycleStart, Motion, Wait, Motion]


def test_a_counted_loop_within_the_cycle_is_counted_out(tmp_path):
    inner = "I=0\nLOOP\nI=I+1\nPTP {A1 I}\nIF I==3 THEN\nEXIT\nENDIF\nENDLOOP\n"
    found, _ = traced(tmp_path, f"INT I\nLOOP\n{inner}{go(0)}ENDLOOP")
    assert axes(found) == [1, 2, 3, 0] and kinds(found)[0] is CycleStart


def test_what_may_leave_a_loop_within_does_not_leave_the_one_around_it(tmp_path):
    inner = f"FOR I=1 TO 2\n{go(1)}IF $IN[1] THEN\nEXIT\nENDIF\nENDFOR\n"
    body = f"INT I\nLOOP\nLOOP\n{inner}sub()\n{go(2)}ENDLOOP\n{go(9)}ENDLOOP{SUB}IF $IN[2] THEN\nRETURN\nENDIF\n"
    found, _ = traced(tmp_path, f"DEF main( )\n{body}END\n")
    assert axes(found) == [1, 1, 2] and isinstance(found[0], CycleStart)


def test_what_a_loop_without_a_known_end_sets_is_not_known_behind_it(tmp_path):
    found, _ = traced(tmp_path, "INT I\nI=0\nREPEAT\nI=I+1\nUNTIL $IN[1]\nPTP {A1 I}")
    assert axes(found) == [None]


# Blocks that run or not

SETTERS = {
    "a variable": ("I=1\n", "I=2", "PTP {A1 I}"),
    "a subprogram": ("I=1\n", "sets()", "PTP {A1 I}"),
    "a function": ("I=1\n", "OK=fsets()", "PTP {A1 I}"),
    "a reference": ("I=1\n", "add1(I)", "PTP {A1 I}"),
    "a counter": ("I=1\n", "FOR I=1 TO 2\nENDFOR", "PTP {A1 I}"),
    "a program elsewhere": ("I=1\n", "elsewhere(I)", "PTP {A1 I}"),
}
ROUTINES = "\nEND\nDEF sets( )\nI=2\nEND\nDEFFCT BOOL fsets( )\nI=2\nRETURN TRUE\nENDFCT\nDEF add1(N :OUT)\nN=N+1\n"


@pytest.mark.parametrize("name", SETTERS)
def test_a_variable_that_is_set_or_not_is_not_known(tmp_path, name):
    before, code, behind = SETTERS[name]
    still = Beside(still=frozenset(["ELSEWHERE"]))
    text = f"DEF main( )\nINT I\n{before}IF $IN[1] THEN\n{code}\nENDIF\n{behind}{ROUTINES}END\n"
    found, notes = traced(tmp_path, text, still)
    assert axes(found) == [None] and "it is kept" in notes[0]


def test_names_of_a_routine_that_may_run_are_its_own(tmp_path):
    text = f"DEF main( )\nINT I\nI=1\nIF $IN[1] THEN\nsub()\nENDIF\nPTP {{A1 I}}{SUB}INT I\nI=2\nEND\n"
    assert axes(traced(tmp_path, text)[0]) == [1]


TOOLS = Beside(
    tools={"1": Placement.of((0, 0, 0.1), (0, 0, 0)), "2": Placement.of((0, 0, 0.2), (0, 0, 0))},
    bases={"1": Placement.of((0.1, 0, 0), (0, 0, 0)), "2": Placement.of((0.2, 0, 0), (0, 0, 0))},
)
FRAMES = [
    *("BAS(#TOOL,2)", "BAS(#BASE,2)", "$TOOL=TOOL_DATA[2]", "$BASE=BASE_DATA[2]", "$BASE=$NULLFRAME", "frames()"),
    *("BAS(#INITMOV,0)", "TOOL_DATA[1]={X 0,Y 0,Z 1}\n$TOOL=TOOL_DATA[1]", "BAS(word,2)"),
]


@pytest.mark.parametrize("code", FRAMES)
def test_a_frame_that_is_set_or_not_is_not_known(tmp_path, code):
    text = f"DEF main( )\nBAS(#TOOL,1)\nBAS(#BASE,1)\nIF $IN[1] THEN\n{code}\nENDIF\nPTP {{X 1,Y 2,Z 3,A 0,B 0,C 0}}"
    (motion,), _ = traced(tmp_path, f"{text}\nEND\nDEF frames( )\nBAS(#TOOL,2)\nEND\n", TOOLS)
    assert isinstance(motion.target, PoseTarget)
    assert motion.target.tool is None or motion.target.base is None
    assert motion.target.unknown


def test_a_tool_whose_figures_the_program_may_change_is_not_known(tmp_path):
    text = (
        "IF $IN[1] THEN\nTOOL_DATA[1]={X 0,Y 0,Z 1}\nENDIF\nBAS(#TOOL,1)\nBAS(#BASE,1)\nPTP {X 1,Y 2,Z 3,A 0,B 0,C 0}"
    )
    (motion,), _ = traced(tmp_path, text, TOOLS)
    assert motion.target.tool is None and motion.target.base is not None


@pytest.mark.parametrize("code", ["BAS(#VEL_PTP,20)", "BAS(#INITMOV,0)", "$VEL_AXIS[1]=20", "I=6\n$VEL_AXIS[I]=20"])
def test_a_speed_that_is_set_or_not_is_not_known(tmp_path, code):
    found, _ = traced(tmp_path, f"BAS(#VEL_PTP,50)\nIF $IN[1] THEN\n{code}\nENDIF\n{go(1)}")
    assert found[-1].speed.percent is None and not found[-1].speed.writable


def test_only_what_a_call_of_bas_sets_is_forgotten(tmp_path):
    found, _ = traced(tmp_path, f"BAS(#VEL_PTP,50)\nIF $IN[1] THEN\nBAS(#VEL_CP,0.2)\nENDIF\n{go(1)}")
    assert found[-1].speed.percent == 50


def test_speeds_of_the_tool_that_are_set_or_not_are_not_known(tmp_path):
    found, _ = traced(tmp_path, "$VEL.CP=0.5\nIF $IN[1] THEN\nBAS(#VEL_CP,0.2)\nENDIF\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}")
    assert found[-1].speed.tool_m_s is None


def test_a_payload_that_is_set_or_not_is_told(tmp_path):
    found, _ = traced(tmp_path, f"$LOAD={{M 5}}\n{go(1)}IF $IN[1] THEN\n$LOAD={{M 9}}\nENDIF\n{go(2)}$LOAD=XLOAD\n")
    assert [one.payload for one in found if isinstance(one, Load)] == [Payload(5.0, (0.0, 0.0, 0.0)), None, None]


def test_the_load_of_a_tool_without_figures_is_told(tmp_path):
    body = f"LOAD_DATA[1]={{M 5}}\nBAS(#TOOL,1)\n{go(1)}BAS(#TOOL,2)\n{go(2)}"
    found, _ = traced(tmp_path, body)
    assert [one.payload for one in found if isinstance(one, Load)] == [Payload(5.0, (0.0, 0.0, 0.0)), None]


def test_a_motion_that_is_not_understood_counts_in_a_block_that_may_run(tmp_path):
    found, _ = traced(tmp_path, f"{go(1)}IF $IN[1] THEN\nLIN @@@\nENDIF\n{go(2)}")
    assert kinds(found) == [Motion, Unknown, Motion]


def test_a_routine_that_moves_nothing_keeps_the_position_known(tmp_path):
    text = f"DEF main( )\n{go(1)}IF $IN[1] THEN\nsub()\nENDIF\n{go(2)}{SUB}"
    assert kinds(traced(tmp_path, f"{text}$OUT[1]=TRUE\nEND\n")[0]) == [Motion, Motion]
    assert kinds(traced(tmp_path, f"{text}WAIT SEC 1\nEND\n")[0]) == [Motion, Wait, Motion]
    assert kinds(traced(tmp_path, f"{text}{go(3)}END\n")[0]) == [Motion, Unknown, Motion]


# Functions in expressions


@pytest.mark.parametrize(
    "code",
    [*("OK=PICK()\n", "IF PICK() THEN\nENDIF\n", "IF NOT PICK() THEN\nENDIF\n"), "WAIT FOR PICK()\n", "sub(PICK())\n"],
)
def test_functions_of_other_files_may_move_the_robot(tmp_path, code):
    text = f"DEF main( )\n{go(1)}{code}{go(2)}\nEND\nDEF sub(X :IN)\nBOOL X\nEND\n"
    found, _ = traced(tmp_path, text)
    assert [one.what for one in found if isinstance(one, Unknown)] == [
        "PICK() is not in this file, it may move the robot"
    ]
    found, _ = traced(tmp_path, text, Beside(still=frozenset(["PICK"])))
    assert not any(isinstance(one, Unknown) for one in found)


PICK = f"\nEND\nDEFFCT BOOL PICK( )\n{go(5)}RETURN TRUE\nENDFCT\n"


@pytest.mark.parametrize(
    "code", ["OK=PICK()\n", "IF PICK() THEN\nENDIF\n", "IF NOT PICK() THEN\nPTP {A1 9}\nENDIF\n", "WAIT FOR PICK()\n"]
)
def test_functions_of_the_file_run_where_they_are_called(tmp_path, code):
    found, _ = traced(tmp_path, f"DEF main( )\nBOOL OK\n{go(1)}{code}{go(2)}{PICK}")
    assert axes(found) == [1, 5, 2]


def test_a_function_returns_its_value(tmp_path):
    text = "DEF main( )\nPTP {A1 half(half(20))+1}\nEND\nDEFFCT REAL half(X :IN)\nREAL X\nRETURN X/2.0\nENDFCT\n"
    assert axes(traced(tmp_path, text)[0]) == [6]


def test_functions_of_the_controller_move_nothing(tmp_path):
    found, _ = traced(tmp_path, f"{go(1)}X=ATAN2(1,2)\nX=SIN(30)\nSPTP {{A1 2}} WITH $VEL_AXIS[1]=SVEL_JOINT(50)\n")
    assert kinds(found) == [Motion, Motion]


# Names of routines


def test_what_a_routine_declares_hides_what_its_caller_has(tmp_path):
    text = f"DEF main( )\nINT I\nI=1\nsub()\nPTP {{A1 I}}{SUB}DECL INT I\nI=7\nPTP {{A1 I}}\nEND\n"
    assert axes(traced(tmp_path, text)[0]) == [7, 1]


def test_parameters_hide_what_the_caller_has(tmp_path):
    text = "DEF main( )\nREAL Q\nQ=1\nsub(5)\nPTP {A1 Q}\nEND\nDEF sub(Q :IN)\nREAL Q\nPTP {A1 Q}\nQ=3\nEND\n"
    assert axes(traced(tmp_path, text)[0]) == [5, 1]


@pytest.mark.parametrize(("mode", "wanted"), [(" :OUT", 1), (" :IN", 0), ("", None)])
def test_results_are_handed_back_where_that_is_said(tmp_path, mode, wanted):
    text = f"DEF main( )\nINT N\nN=0\nadd1(N)\nPTP {{A1 N}}\nEND\nDEF add1(V{mode})\nINT V\nV=V+1\nEND\n"
    assert axes(traced(tmp_path, text)[0]) == [wanted]


def test_arrays_that_are_handed_over_are_not_known_behind_it(tmp_path):
    text = "DEF main( )\nINT N[2]\nN[1]=4\nset(N[])\nPTP {A1 N[1]}\nEND\nDEF set(V[] :OUT)\nINT V[]\nV[1]=9\nEND\n"
    assert axes(traced(tmp_path, text)[0]) == [None]


# Figures that no program means


def test_indices_may_be_nested_deeply(tmp_path):
    found, _ = traced(tmp_path, f"A1={'A[' * 2000}1{']' * 2000}\n{go(1)}")
    assert axes(found) == [1]


def test_a_tool_with_two_indices_is_none(tmp_path):
    found, _ = traced(tmp_path, "$TOOL=TOOL_DATA[1,2]\n$BASE=BASE_DATA[1.5]\nPTP {X 1,Y 2,Z 3,A 0,B 0,C 0}", TOOLS)
    assert found[0].target.tool is None and found[0].target.base is None


def test_a_subprogram_that_is_planned_is_written(tmp_path):
    """The whole way: a function that moves is part of the cycle, as the program's own lines are."""
    (tmp_path / "main.src").write_text(f"DEF main( )\nPTP {HOME}\nOK=PICK()\nPTP {HOME}{PICK}")
    program = load_program(tmp_path / "main.src")
    assert np.degrees(program.tree.configurations_rad()).round(6).tolist() == [AT_HOME, [5, *AT_HOME[1:]], AT_HOME]


# Labels, the advance run, and what WITH sets


@pytest.mark.parametrize("jump", ["before", "behind"])
def test_behind_a_label_that_a_goto_names_nothing_is_known_that_lines_between_set(tmp_path, jump):
    goto = "IF $IN[1] THEN\nGOTO L1\nENDIF\n"
    between = f"{go(2)}I=1\nBAS(#VEL_PTP,40)\n"
    body = {"before": f"{goto}{between}L1:\n", "behind": f"L1:\n{between}{goto}"}[jump]
    found, _ = traced(tmp_path, f"DECL INT I\nI=0\nBAS(#VEL_PTP,60)\n{go(1)}{body}IF I==0 THEN\n{go(7)}ENDIF\n{go(3)}")
    assert axes(found) == [1, 2, 3]
    label = next(at for at, one in enumerate(found) if isinstance(one, Unknown) and "several places" in one.what)
    following = next(one for one in found[label:] if isinstance(one, Motion))
    assert following.speed.percent is None  # that of 60 or 40 %


def test_a_label_that_no_goto_names_is_nothing(tmp_path):
    found, notes = traced(tmp_path, f"{go(1)}L1:\n{go(2)}")
    assert kinds(found) == [Motion, Motion] and not notes


@pytest.mark.parametrize("line", ["PULSE($OUT[1],TRUE,0.2)", "$OUT[1]=TRUE", "B=$IN[3]", "IF $IN[3] THEN\nI=1\nENDIF"])
@pytest.mark.parametrize("is_continued", [False, True])
def test_inputs_and_outputs_stop_the_robot_unless_continue_is_before_them(tmp_path, line, is_continued):
    between = f"CONTINUE\n{line}" if is_continued else line
    text = f"$APO.CPTP=50\nPTP {HOME}\nPTP {{A1 9}} C_PTP\n{between}\nPTP {{A1 20}}\nPTP {{A1 0}}"
    (tmp_path / "main.src").write_text(f"DEF main( )\n{text}\nEND\n")
    first = load_program(tmp_path / "main.src").moves[0]
    assert first.is_fine != is_continued


def test_tool_and_base_behind_with_hold_for_one_motion(tmp_path):
    place = "{X 1000,Y 0,Z 1000,A 0,B 90,C 0}"
    with_tool = "WITH $TOOL={X 0,Y 0,Z 50,A 0,B 0,C 0}, $BASE=BASE_DATA[2]"
    known = "TOOL_DATA[1]={X 0,Y 0,Z 10,A 0,B 0,C 0}\nBASE_DATA[2]={X 7,Y 0,Z 0,A 0,B 0,C 0}\n"
    data = "FP1={TOOL_NO 1,BASE_NO 0}\n"
    motions = [f"SPTP {place}", f"SPTP {place} {with_tool}", f"SPTP {place} WITH $TOOL=STOOL2(FP1)", f"SPTP {place}"]
    found, _ = traced(tmp_path, f"{known}{data}$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n" + "\n".join(motions))
    targets = [one.target for one in found if isinstance(one, Motion)]
    heights = [round(1e3 * float(one.tool.origin_m[2])) for one in targets]
    assert heights == [0, 50, 10, 0]
    assert [round(1e3 * float(one.base.origin_m[0])) for one in targets] == [0, 7, 0, 0]


def test_a_for_goes_on_with_the_counter_that_its_lines_set(tmp_path):
    assert axes(traced(tmp_path, "DECL INT I\nFOR I=1 TO 4\nPTP {A1 I}\nI=I+1\nENDFOR")[0]) == [1, 3]
    found, _ = traced(tmp_path, f"DECL INT I\nFOR I=1 TO 4\n{go(1)}I=ELSEWHERE\nENDFOR\n{go(2)}")
    assert kinds(found) == [Motion, Unknown, Motion]


@pytest.mark.parametrize(
    "line", ["TRIGGER WHEN DISTANCE=0 DELAY=0 DO I=1", "TRIGGER WHEN PATH=5 DELAY=0 DO sub() PRIO=-1"]
)
def test_what_a_trigger_sets_is_not_known_behind_it(tmp_path, line):
    text = f"DEF main( )\nI=0\nIF I==0 THEN\n{go(1)}ENDIF\n{line}\n{go(2)}IF I==0 THEN\n{go(3)}ENDIF{SUB}I=1\nEND\n"
    assert kinds(traced(tmp_path, text)[0]) == [Motion, Motion, Unknown]


def test_what_an_interrupt_sets_is_never_known_and_its_motions_are_told(tmp_path):
    text = f"DEF main( )\nGLOBAL INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO sub()\nI=0\n{go(1)}IF I==0 THEN\n{go(3)}ENDIF"
    found, notes = traced(tmp_path, f"{text}{SUB}I=1\n{go(4)}END\n")
    assert kinds(found) == [Motion, Unknown]
    assert any("line 2: the interrupt may move the robot" in note for note in notes)


def test_the_interrupt_of_every_controller_needs_no_note(tmp_path):
    lines = "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )\nINTERRUPT ON 3\n"
    assert traced(tmp_path, f"{lines}{go(1)}")[1] == []


def test_what_a_line_that_is_not_understood_names_is_not_known_behind_it(tmp_path):
    text = f"R=1\nS=1\n{go(1)}ANIN ON R=1.0*$ANIN[1]\nIF S==1 THEN\n{go(2)}ENDIF\nIF R==1 THEN\n{go(3)}ENDIF"
    assert kinds(traced(tmp_path, text)[0]) == [Motion, Motion, Unknown]
