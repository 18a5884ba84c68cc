"""RAPID on grounds that nobody knows: what may move, leave or set something is said, and never taken as known."""

import pytest

from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.vendor.running import DEEPEST_CALLS
from robojoule.formats.vendor.trace import Beside, CycleStart, Load, Motion, Unknown, Wait
from robojoule.formats.vendor.zones import ASSUMED_BLEND
from tests.formats.vendor.rapid_text import CYCLE, DATA, events, module, motions, written

MARKS = {Unknown: "?", Wait: ".", CycleStart: "(", Load: ""}
HOME, ONE, TWO = (f"MoveAbsJ {name},v1000,fine,tool0;" for name in ("jHome", "j1", "j2"))
STATE = f"{DATA}  VAR num n:=0;\n"
PICK = f"FUNC bool pick()\n{ONE}\nRETURN TRUE;\nENDFUNC\n"


def order(found) -> str:
    """Events as letters: the target of a motion, ? for what is not known, . for a wait, ( for the cycle's beginning."""
    return "".join(event.label[-1:] if isinstance(event, Motion) else MARKS[type(event)] for event in found)


FLOW = {
    "functions in assignments": (f"{HOME}\nb:=pick();\n{TWO}", PICK, "e?2"),
    "functions in conditions": (f"{HOME}\nIF pick() THEN\nn:=1;\nENDIF\n{TWO}", PICK, "e?2"),
    "functions of functions": (
        f"{HOME}\nb:=again();\n{TWO}",
        f"{PICK}FUNC num again()\nRETURN pick();\nENDFUNC\n",
        "e?2",
    ),
    "functions that wait": (f"{HOME}\nb:=wait();\n{TWO}", "FUNC num wait()\nWaitTime 1;\nRETURN 1;\nENDFUNC\n", "e.2"),
    "functions of other files": (f"{HOME}\nb:=elsewhere();\n{TWO}", "", "e?2"),
    "functions of the language": (f"{HOME}\np:=CRobT(\\Tool:=tool0);\nn:=BitAnd(a,b);\n{TWO}", "", "e2"),
    "calls that nobody knows": (
        f"{HOME}\nIF di=1 go;\n{TWO}",
        f"PROC go()\ninner;\nENDPROC\nPROC inner()\n{ONE}\nENDPROC\n",
        "e?2",
    ),
    "calls that wait": (f"{HOME}\nIF di=1 go;\n{TWO}", "PROC go()\nWaitTime 1;\nENDPROC\n", "e.2"),
    "a return that nobody knows": (f"{HOME}\ngo;\n{TWO}", f"PROC go()\nIF di=1 RETURN;\n{ONE}\nENDPROC\n", "e1?2"),
    "a loop that is counted out": (
        f"go;\n{TWO}",
        f"PROC go()\nWHILE TRUE DO\n{ONE}\nIncr n;\nIF n=2 RETURN;\nENDWHILE\nENDPROC\n",
        "112",
    ),
    "a loop on what never changes": (f"{HOME}\nWHILE n=0 DO\n{ONE}\n{HOME}\nENDWHILE\n{TWO}", "", "e(1e"),
    "a loop that only a signal ends": (f"{HOME}\nWHILE TRUE DO\n{ONE}\nIF di=1 RETURN;\nENDWHILE\n{TWO}", "", "e(1?"),
    "a label that a GOTO names": (f"{HOME}\nIF di=1 GOTO there;\n{ONE}\nthere:\n{TWO}", "", "e?1?2"),
    "a label behind which a GOTO goes back": (f"{HOME}\nthere:\n{ONE}\nIF di=1 GOTO there;\n{TWO}", "", "e?1?2"),
    "a label that no GOTO names": (f"{HOME}\nthere:\n{ONE}", "", "e1"),
    "data behind a label": (
        f"n:=1;\nIF di=1 GOTO there;\nn:=2;\nthere:\nIF n=2 THEN\n{ONE}\nENDIF\n{TWO}",
        "",
        "??" + "?2",
    ),
    "interrupts": (f"CONNECT i WITH t;\n{HOME}\n{ONE}", "TRAP t\nn:=1;\nENDTRAP\n", "e1"),
    "a loop that moves nothing": (f"{HOME}\n{ONE}\nWHILE 1=1 DO\nENDWHILE\n{TWO}", "", "e1"),
}


@pytest.mark.parametrize("name", FLOW)
def test_what_nobody_knows_is_not_taken_as_known(tmp_path, name):
    body, more, wanted = FLOW[name]
    assert order(events(tmp_path, body, data=STATE, more=more)[0]) == wanted


def test_functions_that_do_not_move_are_named_beside(tmp_path):
    still = Beside(still=frozenset(["ELSEWHERE"]))
    assert order(events(tmp_path, f"{HOME}\nb:=elsewhere();\n{TWO}", still)[0]) == "e2"


SKIPPED = {
    "an increment": ("IF di=1 Incr n;", ""),
    "a procedure": ("IF di=1 THEN\ngo;\nENDIF", "PROC go()\nn:=1;\nENDPROC\n"),
    "a procedure of a procedure": ("IF di=1 go;", "PROC go()\ninner;\nENDPROC\nPROC inner()\nAdd n,1;\nENDPROC\n"),
    "a reference": ("IF di=1 go n;", "PROC go(INOUT num k)\nk:=1;\nENDPROC\n"),
    "a function": ("b:=go();", "FUNC num go()\nn:=1;\nRETURN 1;\nENDFUNC\n"),
    "a procedure that may be left": ("go;", "PROC go()\nIF di=1 RETURN;\nn:=1;\nENDPROC\n"),
}


@pytest.mark.parametrize("name", SKIPPED)
def test_what_may_have_been_set_is_not_known(tmp_path, name):
    """A motion on n=0 behind it: whether it runs is not known, so there is no motion of which that is known."""
    body, more = SKIPPED[name]
    found, _ = events(tmp_path, f"{HOME}\n{body}\nIF n=0 THEN\n{ONE}\nENDIF\n{TWO}", data=STATE, more=more)
    assert order(found) == "e?2"


SCOPES = {
    "a local of its own": ("go;\nIF n=0 THEN\n{}\nENDIF", "PROC go()\nVAR num n:=5;\nn:=6;\nENDPROC\n"),
    "a counter": ("FOR n FROM 1 TO 3 DO\nSet do1;\nENDFOR\nIF n=0 THEN\n{}\nENDIF", ""),
    "a parameter": ("go 7;\nIF n=0 THEN\n{}\nENDIF", "PROC go(num n)\nn:=8;\nENDPROC\n"),
    "a reference": ("add1 n;\nIF n=1 THEN\n{}\nENDIF", "PROC add1(INOUT num k)\nk:=k+1;\nENDPROC\n"),
    "a part of a reference": (
        "go p10;\nIF p10.trans.z=7 THEN\n{}\nENDIF",
        "PROC go(VAR robtarget p)\np.trans.z:=7;\nENDPROC\n",
    ),
    "an optional parameter": (
        "go\\k:=3,4;\nIF n=34 THEN\n{}\nENDIF",
        "PROC go(\\num k,num m)\nn:=10*k+m;\nENDPROC\n",
    ),
    "an optional parameter that is left out": (
        "go 4;\nIF n=4 THEN\n{}\nENDIF",
        "PROC go(\\num k,num m)\nn:=m;\nENDPROC\n",
    ),
}


@pytest.mark.parametrize("name", SCOPES)
def test_names_mean_what_the_controller_knows(tmp_path, name):
    body, more = SCOPES[name]
    assert order(events(tmp_path, f"{HOME}\n{body.format(ONE)}", data=STATE, more=more)[0]) == "e1"


def test_settings_that_may_have_changed_are_not_known(tmp_path):
    body = f"{ONE}\nIF di=1 VelSet 50,500;\n{TWO}\nMoveAbsJ j1,v100\\T:=2,fine,tool0;\nVelSet 100,5000;\n{TWO}"
    speeds = [one.speed for one in motions(events(tmp_path, body)[0])]
    assert [one.tool_m_s for one in speeds] == [1.0, None, None, 1.0]
    assert [one.duration_s for one in speeds] == [None, None, 2.0, None] and not speeds[1].writable
    _, notes = events(tmp_path, f"{ONE}\nIF di=1 ConfL\\Off;\n{TWO}")
    assert any("whether ConfL acts is not known behind it: taken as before" in note for note in notes)


def test_what_may_be_gripped_is_not_known(tmp_path):
    data = f"{DATA}  PERS loaddata part:=[2,[0,0,50],[1,0,0,0],0,0,0];\n"
    body = "{0}\nIF di=1 GripLoad part;\n{0}\nGripLoad load0;\n{0}".format("MoveAbsJ j1,v100,fine,tGrip;")
    found = [event.payload for event in events(tmp_path, body, data=data)[0] if isinstance(event, Load)]
    assert [None if one is None else one.mass_kg for one in found] == [5, None, 5]


def test_a_zone_that_nobody_knows_is_assumed_and_told(tmp_path):
    found, notes = events(tmp_path, "MoveAbsJ j1,v100,zMine,tool0;\nMoveAbsJ j2,v100,z10\\Z:=nMine,tool0;")
    assert [one.blend for one in motions(found)] == [ASSUMED_BLEND, ASSUMED_BLEND]
    assert sum("how far its zone reaches" in note for note in notes) == 2


@pytest.mark.parametrize("deep", ["-" * 3000 + "1", "[" * 3000 + "1" + "]" * 3000, "Abs(" * 900 + "1" + ")" * 900])
def test_hostile_nesting_is_survived(tmp_path, deep):
    """Brackets and signs that the grammar keeps as trees within each other, unlike those of `(1)`."""
    try:
        load_program(written(tmp_path, module(f"    VAR num n:={deep};\n{CYCLE}")))
    except InputError as error:
        assert "nested too deeply" in str(error)


def test_a_chain_of_calls_is_followed_so_far(tmp_path):
    chain = "".join(f"PROC f{at}()\nf{at + 1};\nENDPROC\n" for at in range(400))
    found, _ = events(tmp_path, f"{HOME}\nf0;\n{TWO}", more=f"{chain}PROC f400()\n{ONE}\nENDPROC\n")
    assert order(found) == "e?2" and f"within more than {DEEPEST_CALLS} other calls" in found[1].what


PLACE = "[[1000,0,1000],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


@pytest.mark.parametrize("setting", ["PDispSet [[0,0,9],[1,0,0,0]];", "PDispOn p,tool0;", "IF di=1 PDispOn p,tool0;"])
def test_places_of_the_tool_that_are_displaced_are_not_known(tmp_path, setting):
    to = f"MoveJ {PLACE},v100,fine,tool0;"
    found = motions(events(tmp_path, f"{HOME}\n{setting}\n{to}\n{ONE}\nPDispOff;\n{to}")[0])
    assert [one.target is not None for one in found] == [True, False, True, True]
    assert "PDispOn" in found[1].reason


@pytest.mark.parametrize(
    ("declared", "is_told"),
    [
        ("PERS num k:=0;", True),
        ("LOCAL PERS num k:=0;", False),
        ("VAR num k:=0;", False),
        ("PERS num other:=0;", False),
    ],
)
def test_pers_data_that_others_may_change_are_told(tmp_path, declared, is_told):
    _, notes = events(tmp_path, f"IF k=0 THEN\n{HOME}\nENDIF\n{ONE}", data=f"{DATA}  {declared}\n")
    assert any("other modules and tasks may change them" in str(note) for note in notes) is is_told


def test_what_a_trap_sets_is_never_known_and_its_motions_are_told(tmp_path):
    trap = f"TRAP stopped\nn:=1;\n{ONE}\nENDTRAP\n"
    body = f"CONNECT i WITH stopped;\nn:=0;\n{HOME}\nWHILE n=0 DO\n{TWO}\nENDWHILE"
    found, notes = events(tmp_path, body, more=trap, data=STATE)
    assert order(found) == "e?"
    assert any("the trap STOPPED may move the robot" in note for note in notes)


def test_what_a_statement_that_is_not_understood_names_is_not_known_behind_it(tmp_path):
    body = f"n:=0;\n{HOME}\nn @ v1000;\n{ONE}\nIF n=0 THEN\n{TWO}\nENDIF"
    found, _ = events(tmp_path, body, data=STATE)
    assert order(found) == "e?1?"
    assert motions(found)[-1].speed.tool_m_s == 1.0  # nothing changes v1000
