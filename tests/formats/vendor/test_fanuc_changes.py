"""What a teach pendant program sets where nobody knows whether it does: it is not known behind it."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.vendor.fanuc.program import read_teach_pendant
from robojoule.formats.vendor.trace import Beside, JointTarget, Load, Motion, Unknown, Wait
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload
from tests.formats.vendor.fanuc_text import PLACES, joints, listing, place, written

FIRST = "J P[1] 100% FINE"
KNOWN_PR = Beside(positions_rad={"PR[1]": (0.1,) * 6, "PR[2]": (0.2,) * 6})


def traced(folder, body, beside=None, positions=PLACES):
    trace = read_teach_pendant(written(folder, listing(body, positions))).trace(beside or Beside())
    return list(trace.events), [str(note) for note in trace.notes]


def target_behind(folder, body, beside, **more):
    """Where the last motion of a program goes, whose P[2] is a place of the tool."""
    positions = joints(1, PLACES[1]) + place(2, (900, 0, 500, 180, 0, 0), **more)
    (motion,) = read_teach_pendant(written(folder, listing(body, positions))).trace(beside).events[-1:]
    return motion.target


ACTIONS = {
    "a register": ("R[1]=3", ["IF DI[1]=ON,R[1]=2", "FOR R[2]=1 TO R[1]", FIRST, "ENDFOR"]),
    "in parentheses": ("R[1]=3", ["IF (DI[1] AND DI[2]),R[1]=(2)", "FOR R[2]=1 TO R[1]", FIRST, "ENDFOR"]),
    "in a block": ("R[1]=3", ["IF (DI[1]) THEN", "R[1]=2", "ENDIF", "FOR R[2]=1 TO R[1]", FIRST, "ENDFOR"]),
    "of a loop": ("R[1]=3", ["FOR R[1]=1 TO GI[1]", "ENDFOR", "FOR R[2]=1 TO R[1]", FIRST, "ENDFOR"]),
    "by a program beside": ("R[1]=3", ["IF DI[1]=ON,CALL SETS", "FOR R[2]=1 TO R[1]", FIRST, "ENDFOR"]),
    "by one on the way": ("R[1]=3", ["J P[2] 100% FINE TB .10sec,CALL SETS", "FOR R[2]=1 TO R[1]", FIRST, "ENDFOR"]),
    "by one in a block": ("R[1]=3", ["IF (DI[1]) THEN", "CALL SETS", "ENDIF", "FOR R[2]=1 TO R[1]", FIRST, "ENDFOR"]),
}


@pytest.mark.parametrize("name", ACTIONS)
def test_a_register_that_is_set_or_not_is_not_known(tmp_path, name):
    written(tmp_path, listing(["R[1]=2"], {}), "sets.ls")
    before, body = ACTIONS[name]
    found, notes = traced(tmp_path, [FIRST, before, *body])
    assert sum(isinstance(one, Motion) for one in found) == (2 if "way" in name else 1)
    assert isinstance(found[-1], Unknown)
    assert not any("taken not to" in note for note in notes)


def test_an_action_that_sets_something_is_told_to_be_kept(tmp_path):
    found, notes = traced(tmp_path, [FIRST, "IF DI[1]=ON,R[1]=2", "IF DI[1]=ON,DO[1]=ON", FIRST])
    assert [type(one) for one in found] == [Motion, Motion]
    assert [note.split(": ", 1)[1] for note in notes] == [
        "whether it runs is not known, it is kept: IF DI[1]=ON,R[1]=2",
        "whether it runs is not known, it is kept: IF DI[1]=ON,DO[1]=ON",
    ]


@pytest.mark.parametrize(
    ("code", "kind", "said"),
    [
        ("IF DI[1]=ON,PAUSE", Wait, ""),
        ("IF DI[1]=ON,OPEN_HAND", Unknown, ""),
        ("IF DI[1]=ON,JMP LBL[9]", Motion, "taken not to: IF"),
        ("IF DI[1]=ON,END", Motion, "whether the program ends here"),
    ],
)
def test_other_actions_count_by_what_they_do(tmp_path, code, kind, said):
    found, notes = traced(tmp_path, [FIRST, code, FIRST])
    assert isinstance(found[1], kind) and said in "".join(notes)


@pytest.mark.parametrize("code", ["IF DI[1]=ON,UTOOL_NUM=2", "UTOOL_NUM=R[7]", "IF (DI[1]) THEN\nUTOOL_NUM=2\nENDIF"])
def test_a_tool_that_is_set_or_not_is_not_known(tmp_path, code):
    beside = Beside(tools={"1": Placement.of((0, 0, 0.1), (0, 0, 0)), "2": Placement.of((0, 0, 0.2), (0, 0, 0))})
    body = ["UFRAME_NUM=0", "UTOOL_NUM=1", *code.split("\n"), "J P[2] 100% FINE"]
    found = target_behind(tmp_path, body, beside, ut="F")
    assert found.tool is None and "UT" in found.unknown
    plain = target_behind(tmp_path, [*body[:2], body[-1]], beside, ut="F")
    np.testing.assert_allclose(plain.tool.origin_m, [0, 0, 0.1])


def test_frames_that_a_program_beside_sets_hold_behind_it(tmp_path):
    written(tmp_path, listing(["UFRAME_NUM=2", "UTOOL_NUM=1"], {}), "other.ls")
    frames = {"2": Placement.of((0.5, 0, 0), (0, 0, 0))}
    body = ["UFRAME_NUM=0", "UTOOL_NUM=0", "CALL OTHER", "J P[2] 100% FINE"]
    found = target_behind(tmp_path, body, Beside(bases=frames), uf="F", ut="0")
    np.testing.assert_allclose(found.base.origin_m, [0.5, 0, 0])


def test_figures_of_a_frame_that_the_program_overwrites_are_not_those_of_the_controller(tmp_path):
    frames = {"2": Placement.of((0.5, 0, 0), (0, 0, 0))}
    found = target_behind(tmp_path, ["UFRAME[2]=PR[1]", "J P[2] 100% FINE"], Beside(bases=frames), uf="2", ut="0")
    assert found.base is None and found.unknown == "UF 2"


CHANGED = ["PR[1,3]=PR[1,3]+50", "PR[1]=LPOS", "PR[R[9]]=LPOS", "IF DI[1]=ON,PR[1]=PR[2]"]


@pytest.mark.parametrize("code", [*CHANGED, "CALL SETS"])
def test_a_position_register_that_the_program_changes_is_not_that_of_the_controller(tmp_path, code):
    written(tmp_path, listing(["PR[1]=LPOS"], {}), "sets.ls")
    found, _ = traced(tmp_path, [FIRST, code, "J PR[1] 100% FINE", "J PR[2] 100% FINE"], KNOWN_PR)
    first, second = [one for one in found if isinstance(one, Motion)][1:]
    assert first.target is None and "computed" in first.reason
    assert isinstance(second.target, JointTarget) == ("R[9]" not in code)


def test_a_position_register_is_found_by_a_register(tmp_path):
    found, _ = traced(tmp_path, ["R[1]=2", "J PR[R[1]] 100% FINE"], KNOWN_PR)
    assert found[0].target.angles_rad == (0.2,) * 6


@pytest.mark.parametrize("code", ["IF (DI[1]) THEN\nP[1]=PR[1]\nENDIF", "IF DI[1]=ON,P[1]=PR[1]", "P[1]=PR[1]"])
def test_a_position_that_is_overwritten_or_not_is_not_known(tmp_path, code):
    found, _ = traced(tmp_path, [*code.split("\n"), FIRST, "J P[2] 100% FINE"])
    assert [one.target is None for one in found if isinstance(one, Motion)] == [True, False]


def test_positions_of_a_program_beside_are_its_own(tmp_path):
    written(tmp_path, listing(["P[1]=LPOS"], {}), "sets.ls")
    found, _ = traced(tmp_path, ["IF (DI[1]) THEN", "CALL SETS", "ENDIF", FIRST])
    assert isinstance(found[-1].target, JointTarget)


@pytest.mark.parametrize("code", ["IF (DI[1]) THEN\nPAYLOAD[2]\nENDIF", "IF DI[1]=ON,PAYLOAD[2]"])
def test_a_payload_that_is_set_or_not_is_told(tmp_path, code):
    found, _ = traced(tmp_path, [FIRST, *code.split("\n"), FIRST], Beside(payloads={"2": Payload(7.0)}))
    assert [(type(one), getattr(one, "payload", 0)) for one in found[1:-1]] == [(Load, None)]


def test_a_program_that_runs_beside_takes_no_time_of_the_cycle(tmp_path):
    written(tmp_path, listing(["WAIT   5.00(sec)", "R[1]=2"], {}), "other.ls")
    loop = ["FOR R[2]=1 TO R[1]", FIRST, "ENDFOR"]
    found, notes = traced(tmp_path, [FIRST, "R[1]=3", "RUN OTHER", FIRST, *loop])
    assert [type(one) for one in found] == [Motion, Motion, Unknown]
    assert any("OTHER runs beside this program and moves nothing" in note for note in notes)
    written(tmp_path, listing([FIRST]), "other.ls")
    assert isinstance(traced(tmp_path, [FIRST, "RUN OTHER"])[0][1], Unknown)


def test_programs_that_call_each_other_often_end(tmp_path):
    for at in range(12):
        written(tmp_path, listing([f"CALL S{at + 1}"] * 10 + ["WAIT   .10(sec)"] * 2, {}), f"s{at}.ls")
    written(tmp_path, listing(["WAIT   .10(sec)"], {}), "s12.ls")
    with pytest.raises(InputError, match="does not end within"):
        traced(tmp_path, [FIRST, "CALL S0"])


@pytest.mark.parametrize("zone", ["CNT R[9]", "CR R[9]"])
def test_a_zone_in_a_register_that_is_not_known_is_told(tmp_path, zone):
    found, notes = traced(tmp_path, [f"J P[1] 100% {zone}", "R[9]=20", f"J P[2] 100% {zone}"])
    assert found[0].blend.share == 1.0 and "does not say how far its zone reaches" in notes[0]
    assert (found[1].blend.share or 10 * found[1].blend.radius_m) == pytest.approx(0.2) and len(notes) == 1


@pytest.mark.parametrize("index", ["nan", "inf", "1.7", "1e0", "-1"])
def test_a_position_has_a_whole_number(tmp_path, index):
    found, _ = traced(tmp_path, [f"J P[{index}] 100% FINE", FIRST])
    assert [one.target is None for one in found] == [True, False]


def test_a_register_has_a_number_of_plain_digits(tmp_path):
    found, _ = traced(tmp_path, ["R[\u00b2]=1", "R[1]=2", "J P[R[1]] 100% FINE", "R[1]=1.5", "J P[R[1]] 100% FINE"])
    assert [one.target is None for one in found if isinstance(one, Motion)] == [False, True]
