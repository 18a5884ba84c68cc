"""Plans written into a file's own text: numbers change, all else stays as people wrote it."""

import json
import re

import pytest

from robojoule.formats.program import load_program
from robojoule.formats.tree_text import number_text

YAML = """\
# a cycle of the cell on the left \U0001f600
format: robojoule-operation-tree   # do not touch
version: 1
name: pick
start_deg: [0, -90, 90, 0, 0, 0]   # home
operations:
  - {type: move, name: to part, target_deg: [50, -70, 80, 0, 30, 0]} # in one line
  - {type: process, name: grip, duration_s: 0.4, power_w: 50}
  - type: compound
    name: belt
    operations:
      # over the guard
      - type: move
        name: to belt   # slow?
        speed_limit_percent: &slow 80  # as the pendant shows
        target_deg:
          - -20
          - -60
          - 100
          - 40
          - 0
          - 0
      # and on

      - target_deg: [-30, -60, 100, 40, 0, 0]
        wait_after_s: 0.25
        speed_limit_percent: *slow
        type: move
        name: to bin
  - {type: wait, name: part leaves, duration_s: 0.5}
  - {type: move, name: home,
     target_deg: [0, -90, 90, 0, 0, 0],}
"""
JSON = """{"format": "robojoule-operation-tree", "version": 1, "name": "pi\\/ck\\u00e9 \U0001f600\\ud83d\\ude00",
\t"start_deg": [0, -90, 90, 0, 0, 0],
\t"operations": [
\t\t{"type":"move","name":"to part","target_deg":[50, -70, 80, 0, 30, 0]},
\t\t{
\t\t\t"type": "move",
\t\t\t"name": "home", "target_deg": [0, -90, 90, 0, 0, 0]
\t\t}
\t]
}
"""
CSV = """\
wait_after_s,name,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,speed_limit_percent

,,0,-90,90,0,0,0,
0.4,"to, part",50,-70,80,0,30,0,
 0.5 ,to belt,-20,-60,100,40,0,0, 80
,home,0,-90,90,0,0,0,"""
CSV_PLANNED = """\
wait_after_s,name,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,speed_limit_percent,added_wait_after_s

,,0,-90,90,0,0,0,,
0.4,"to, part",50,-70,80,0,30,0,36,
 0.5 ,to belt,-20,-60,100,40,0,0,41.5,
,home,0,-90,90,0,0,0,,0.001656907"""
LIMITS = {"to part": 36.0, "to, part": 36.0, "to belt": 41.5, "to bin": 21.0}
ADDED = {"home": 0.001656907}


def planned(path):
    """The program of a file with a plan for those moves that it has."""
    program = load_program(path)
    names = {move.name for move in program.moves}
    limits, added = ({k: v for k, v in of.items() if k in names} for of in (LIMITS, ADDED))
    return type(program)(
        program.tree.with_plan(limits, added_waits_after_s=added), path, program.format, program.places, program.text
    )


@pytest.mark.parametrize(
    "name, text", [("a.yaml", YAML), ("a.json", JSON), ("a.csv", CSV)], ids=["yaml", "json", "csv"]
)
@pytest.mark.parametrize("line_end", ["\n", "\r\n"], ids=["unix", "windows"])
def test_only_what_was_planned_differs(tmp_path, name, text, line_end):
    path = tmp_path / name
    path.write_bytes(text.replace("\n", line_end).encode())
    plan = planned(path)
    plan.save(path)
    assert load_program(path).tree == plan.tree
    written = path.read_bytes().decode()
    assert written.count("\n") == written.count(line_end)
    if name == "a.csv":
        assert written == CSV_PLANNED.replace("\n", line_end)
    else:  # taking what a plan may write out of both leaves the same text
        pattern = r'[\s,]*"?\b(speed_limit_percent|added_wait_after_s)"?: (&slow )?[*\w.]+'
        assert re.sub(pattern, "", written) == re.sub(pattern, "", text.replace("\n", line_end))
    load_program(path).save(path)
    assert path.read_bytes().decode() == written


def test_comments_and_degrees_stay_where_they_were(tmp_path):
    (tmp_path / "a.yaml").write_text(YAML, encoding="utf-8")
    planned(tmp_path / "a.yaml").save(tmp_path / "b.yaml")
    lines = (tmp_path / "b.yaml").read_text(encoding="utf-8").splitlines()
    assert "        speed_limit_percent: 41.5  # as the pendant shows" in lines
    assert "        speed_limit_percent: 21" in lines
    first = (
        "  - {type: move, name: to part, target_deg: [50, -70, 80, 0, 30, 0], speed_limit_percent: 36} # in one line"
    )
    assert first in lines
    assert lines[-1] == "     added_wait_after_s: 0.001656907,}"


def test_a_wait_that_is_not_needed_any_more_is_zero(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(YAML, encoding="utf-8")
    planned(path).save(path)
    program = load_program(path)
    type(program)(program.tree.without_plan(), path, program.format, program.places, program.text).save(path)
    assert path.read_text(encoding="utf-8").endswith("     added_wait_after_s: 0,}\n")


def test_a_further_key_goes_behind_the_last_line_that_is_sure(tmp_path):
    """Not behind comments that belong to what follows."""
    path = tmp_path / "a.yaml"
    path.write_text(YAML.replace("        speed_limit_percent: *slow\n", ""), encoding="utf-8")
    planned(path).save(path)
    assert "        name: to bin\n        speed_limit_percent: 21\n  - {type: wait" in path.read_text(encoding="utf-8")


def test_from_yaml_to_json_units_and_order_stay(tmp_path):
    (tmp_path / "a.yaml").write_text(YAML, encoding="utf-8")
    plan = planned(tmp_path / "a.yaml")
    plan.save(tmp_path / "b.json")
    assert load_program(tmp_path / "b.json").tree == plan.tree
    data = json.loads((tmp_path / "b.json").read_text(encoding="utf-8"))
    assert data["start_deg"] == [0, -90, 90, 0, 0, 0]
    assert list(data["operations"][2]["operations"][1]) == [
        "target_deg",
        "wait_after_s",
        "speed_limit_percent",
        "type",
        "name",
    ]


def test_a_program_that_was_changed_otherwise_is_written_anew(tmp_path):
    (tmp_path / "a.yaml").write_text(YAML, encoding="utf-8")
    program = load_program(tmp_path / "a.yaml")
    other = program.tree.model_copy(update={"name": "other"})
    type(program)(other, program.path, program.format, program.places, program.text).save(tmp_path / "b.yaml")
    assert load_program(tmp_path / "b.yaml").tree == other


@pytest.mark.parametrize("value", [0.0, 43.0, 1e-5, 1.5e-7, 0.1, 100 / 3, 1e16, 12345678.9])
def test_numbers_read_back_as_numbers_in_yaml_and_json(tmp_path, value):
    import yaml

    assert yaml.safe_load(number_text(value)) == value
    assert json.loads(number_text(value)) == value
