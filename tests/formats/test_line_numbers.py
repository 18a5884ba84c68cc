"""Errors of cell files name the line."""

import json

import pytest

import robojoule as rj
from robojoule.errors import InputError
from robojoule.formats.cell_files import cell_data, write_cell
from tests.planning.cells.cases import two_robots

FAULTS = {
    "unknown key": ("cycle_time_s: 9.0", "cycle_time_s: 9.0\nspeed: 3", "speed: 3", "speed: unknown key"),
    "bad value": ("cycle_time_s: 9.0", "cycle_time_s: nine", "cycle_time_s: nine", "cycle_time_s: input should be"),
    "in a list": ("least_idle_s: 1.0", "least_idle_s: -1.0", "least_idle_s: -1.0", "robots.0.modes.1.least_idle_s"),
    "an activity": ("longest_s: 0.9", "longest_s: 0.1", "name: a2\n", "activity a2: the window"),
    "a lag": ("first: b1>b0", "first: zz", "- first: zz", "lags.0: the time lag names the activity 'zz'"),
    "a lag in a robot": (
        "first: b1>b0",
        "first: a0",
        "- first: a0",
        "lags.0: the time lag joins two activities of one robot, 'a0' and 'a1'",
    ),
    "a hand-over": (
        "handovers:\n- first: a1",
        "handovers:\n- first: a0>a1",
        "- first: a0>a1",
        "handovers.0: a hand-over needs static activities, not 'a0>a1'",
    ),
    "twice": ("name: a2\n", "name: b1\n", "name: b1\n", "activity b1: the activity 'b1' appears twice"),
    "a robot": ("last: b0", "last: b0>b1", "name: B\n", "robot B: the last activity"),
}


@pytest.mark.parametrize(("good", "bad", "there", "problem"), FAULTS.values(), ids=FAULTS)
def test_the_line_is_named(tmp_path, good, bad, there, problem):
    path = tmp_path / "cell.yaml"
    write_cell(two_robots(), path)
    text = path.read_text(encoding="utf-8")
    assert good in text
    text = text.replace(good, bad, 1)
    path.write_text(text, encoding="utf-8")
    line = text[: text.index(there)].count("\n") + 1
    with pytest.raises(InputError) as raised:
        rj.load_cells(path)
    assert f"cell.yaml, line {line}, {problem}" in str(raised.value)


def test_the_line_of_a_movement_in_a_json_file_is_named(tmp_path):
    data = cell_data(two_robots())
    data["robots"][1]["dynamic"][1]["movements"][0]["terms"] = [[-1.0, -5.0]]
    path = tmp_path / "cell.json"
    text = json.dumps(data, indent=1)
    path.write_text(text, encoding="utf-8")
    inside = text.index('"pp"', text.index('"b1>b0"'))
    line = text[:inside].count("\n")  # the mapping begins a line before its name
    with pytest.raises(InputError, match=f"line {line}, activity b1>b0, movement pp: the coefficient -5"):
        rj.load_cells(path)


def test_a_missing_key_is_named_with_the_line_around_it_and_others_stay(tmp_path):
    path = tmp_path / "cell.yaml"
    path.write_text("format: robojoule-cell\nversion: 1\nrobots:\n- {name: A}\n", encoding="utf-8")
    with pytest.raises(InputError) as raised:
        rj.load_cells(path)
    said = [str(error) for error in raised.value.errors]
    assert any("line 4, robots.0.last: this key is missing" in one for one in said)
    assert any("cell.yaml, name: this key is missing" in one for one in said)  # nowhere: no line
