"""What holds where programs of any language are run: bounds of steps and calls, names of routines, each note once."""

import pytest

from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.vendor.running import DEEPEST_CALLS, MOST_STEPS, Running, own_names
from robojoule.formats.vendor.text import numbers_in_bounds
from robojoule.formats.vendor.trace import Blend, Unknown, Wait
from robojoule.formats.vendor.zones import ASSUMED_BLEND
from tests.formats.vendor.krl_text import HOME, TO

ENDLESS = {
    "an empty FOR": "DEF a( )\nINT I\nFOR I=1 TO 1E12\nENDFOR\nEND\n",
    "an empty REPEAT": "DEF a( )\nREPEAT\nUNTIL FALSE\nEND\n",
    "an empty WHILE": "DEF a( )\nWHILE 1==1\nENDWHILE\nEND\n",
}


@pytest.mark.parametrize("name", ENDLESS)
def test_a_loop_with_an_empty_body_does_not_hang(tmp_path, name):
    (tmp_path / "a.src").write_text(ENDLESS[name])
    with pytest.raises(InputError, match=f"does not end within {MOST_STEPS} steps"):
        load_program(tmp_path / "a.src")


def test_a_long_chain_of_calls_is_not_followed_to_its_end(tmp_path):
    chain = [f"DEF s{at}( )\nPTP {TO}\ns{at + 1}()\nEND\n" for at in range(400)]
    (tmp_path / "a.src").write_text(f"DEF a( )\nPTP {HOME}\nPTP {TO}\nPTP {HOME}\ns0()\nEND\n{''.join(chain)}")
    program = load_program(tmp_path / "a.src")
    assert any(f"more than {DEEPEST_CALLS} other calls" in note for note in program.notes)


def test_what_is_nested_too_deeply_is_refused(tmp_path):
    def endless():
        return endless()

    with pytest.raises(InputError, match=r"a\.src: the program is nested too deeply"), numbers_in_bounds("a.src"):
        endless()


def test_names_of_a_routine_hide_what_they_meant_outside_of_it():
    values = {"I": 1, "A[1]": 2, "A[2]": 3, "AB": 4, "N": 5}
    with own_names(values, ["I", "A", "new"]):
        assert values == {"AB": 4, "N": 5}
        values |= {"I": 7, "A[1]": 8, "new": 9, "N": 6}
    assert values == {"I": 1, "A[1]": 2, "A[2]": 3, "AB": 4, "N": 6}


def test_what_is_skipped_is_told_once_by_what_it_may_do():
    running = Running()
    running.skipped(3, 10, "IF  $IN[1]", moves=True, waits=True)
    running.skipped(4, 20, "IF $IN[1]", moves=False, waits=True)
    for _ in range(2):
        running.skipped(5, 30, "IF ($IN[1]", moves=False, waits=False)
    said = "whether this runs is not known, it may move the robot: IF $IN[1]"
    assert running.events == [Unknown(3, said, may_stand=True), Wait(20, 4, None, "IF $IN[1]")]
    (note,) = running.notes.values()
    assert str(note) == "line 5: whether this runs is not known, it is kept: IF ($IN[1] (its '(' is not closed)"


def test_only_an_assumed_zone_is_told():
    running = Running()
    running.note_zone(1, Blend(share=1.0))
    running.note_zone(1, None)
    assert not running.notes
    running.note_zone(1, ASSUMED_BLEND)
    assert [note.line for note in running.notes.values()] == [1]


def test_a_routine_that_calls_itself_is_not_followed(tmp_path):
    text = f"DEF a( )\nPTP {HOME}\nPTP {TO}\nPTP {HOME}\na()\nPTP {TO}\nPTP {HOME}\nEND\n"
    (tmp_path / "a.src").write_text(text)
    program = load_program(tmp_path / "a.src")
    assert any("A calls itself" in note for note in program.notes)
