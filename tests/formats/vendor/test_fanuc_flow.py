"""Where a teach pendant program goes on: labels that are reached on several ways, and loops that are counted."""

import numpy as np
import pytest

from robojoule.formats.vendor.fanuc.program import read_teach_pendant
from robojoule.formats.vendor.trace import Beside, Motion, Unknown, Wait
from tests.formats.vendor.fanuc_text import listing


def traced(folder, lines):
    (folder / "cycle.ls").write_text(listing(lines))
    trace = read_teach_pendant(folder / "cycle.ls").trace(Beside())
    return list(trace.events), [str(note) for note in trace.notes]


def order(events):
    """Events as letters: the label of a motion, ? for what is not known, . for a wait."""
    marks = {Unknown: "?", Wait: "."}
    return "".join(one.label[2:-1] if isinstance(one, Motion) else marks[type(one)] for one in events)


def go(number, more=""):
    return f"J P[{number}] 100% FINE{more}"


JUMPS = {
    "a wait that takes too long": (["WAIT DI[1]=ON TIMEOUT,LBL[9]"], "1.2?3"),
    "a motion that is not skipped": ([go(4, " Skip,LBL[9]")], "14?2?3"),
    "a jump within a block": (["IF (DI[1]=ON) THEN", "JMP LBL[9]", "ENDIF"], "1?2?3"),
    "a branch within a block": (["IF (DI[1]=ON) THEN", "IF DI[2]=ON,JMP LBL[9]", "ENDIF"], "1?2?3"),
    "a jump elsewhere": (["WAIT DI[1]=ON TIMEOUT,LBL[8]"], "1.23"),
}


@pytest.mark.parametrize("name", JUMPS)
def test_where_the_robot_is_behind_a_label_that_other_ways_lead_to_is_not_known(tmp_path, name):
    lines, expected = JUMPS[name]
    assert order(traced(tmp_path, [go(1), *lines, go(2), "LBL[9]", go(3)])[0]) == expected


def test_a_wait_that_may_lead_back_leaves_the_position_behind_its_label_unknown(tmp_path):
    lines = [go(1), "LBL[9]", go(2), "WAIT DI[1]=ON TIMEOUT,LBL[9]", go(3)]
    assert order(traced(tmp_path, lines)[0]) == "1?2.3"


def test_a_jump_to_lines_that_were_jumped_over_is_told(tmp_path):
    lines = [go(1), "JMP LBL[2]", "LBL[1]", go(2), "LBL[2]", go(3), "JMP LBL[1]"]
    events, _ = traced(tmp_path, lines)
    assert order(events) == "13?" and "jumped over" in events[-1].what


COUNTERS = {
    "as it is": (["FOR R[1]=1 TO 3", go(2), "ENDFOR", go("R[1]")], [2, 2, 2, 3]),
    "downwards": (["FOR R[1]=3 DOWNTO 2", go("R[1]"), "ENDFOR", go("R[1]")], [3, 2, 2]),
    "never": (["R[1]=4", "FOR R[1]=3 TO 2", go(2), "ENDFOR", go("R[1]")], [3]),
    "set within": (["FOR R[1]=1 TO 4", go("R[1]"), "R[1]=R[1]+1", "ENDFOR"], [1, 3]),
}


@pytest.mark.parametrize("name", COUNTERS)
def test_the_counter_of_a_for_is_what_the_program_makes_of_it(tmp_path, name):
    lines, expected = COUNTERS[name]
    places = {1: 0, 2: 60, 3: 90, 4: 20}  # axis 1 of the points
    found = [one.target.angles_rad[0] for one in traced(tmp_path, lines)[0] if isinstance(one, Motion)]
    assert np.degrees(found).round(6).tolist() == [places[number] for number in expected]


def test_a_counter_that_is_set_to_what_nobody_knows_ends_what_is_known(tmp_path):
    events, _ = traced(tmp_path, ["FOR R[1]=1 TO 4", go(2), "R[1]=R[9]", "ENDFOR", go(3)])
    assert order(events) == "2?3"


def test_an_end_that_may_come_in_a_block_is_told(tmp_path):
    _, notes = traced(tmp_path, [go(1), "IF (DI[1]=ON) THEN", "END", "ENDIF", go(2)])
    assert any("whether the program ends here is not known" in note for note in notes)


@pytest.mark.parametrize("lines", [[go(1), "SPOT[SD=1,P=2,t=3.0]", go(2)], [go(1, " SPOT[1]"), go(2)]])
def test_the_time_of_a_spot_weld_is_told_not_to_be_counted(tmp_path, lines):
    events, notes = traced(tmp_path, lines)
    assert order(events) == "12" and any("spot weld is not in the file" in note for note in notes)
