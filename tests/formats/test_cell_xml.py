# ruff: noqa: E501
"""Cells in the benchmark's XML: what is read, and damaged files refused with the line."""

import pytest

from robojoule.errors import InputError
from robojoule.formats.cells import load_cells
from robojoule.planning.cells.solve import solve_cell
from tests.formats.cell_text import XML


@pytest.fixture
def write(tmp_path):
    def written(text, name="cell.xml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return written


def refused(path):
    with pytest.raises(InputError) as raised:
        load_cells(path)
    return raised.value


def test_a_cell_is_read(write):
    (cell,) = load_cells(write(XML))
    assert (cell.name, cell.cycle_time_s) == ("cell_0", 12.0)
    assert [robot.name for robot in cell.robots] == ["left", "right"]
    assert [robot.last for robot in cell.robots] == ["0", "4"]
    first, second = cell.static["1"].locations
    assert (first.powers_w, second.powers_w) == ({"0": 300.0, "1": 150.0}, {"0": 310.0, "1": 150.0})
    movement = cell.dynamic["3"].movements[1]
    assert (movement.start, movement.end) == ("1", "0")
    assert movement.profile.terms == ((-1.0, 800.0), (1.0, 240.0))  # terms of nothing are dropped
    assert cell.handovers[0].pairs == (("0", "0"), ("1", "0"))  # whatever the order in the file
    assert [(lag.first, lag.second, lag.length_s, lag.cycles) for lag in cell.lags] == [
        ("3", "5", 0.5, 0),
        ("7", "1", 0.0, 1),
    ]
    assert cell.collisions[0] == (("1", "0"), ("6", "0"))
    assert solve_cell(cell).status == "optimal"


def test_several_cells_are_read_by_number(write):
    start, end = XML.index("<instance>"), XML.index("</instance>") + len("</instance>")
    cells = load_cells(write(XML[:end] + XML[start:], "many.xml"))
    assert [cell.name for cell in cells] == ["many_0", "many_1"]


def line_of(text, part):
    return text[: text.index(part)].count("\n") + 1


FAULTS = {
    "cut short": (XML[:2000], None, "the file is not XML (unclosed token)"),
    "not XML": ("robots: 3", None, "the file is not XML (syntax error)"),
    "other root": ("<html></html>", None, "the root is <html>"),
    "no instance": ("<dataset></dataset>", None, "holds no <instance>"),
    "unknown element": (XML.replace("<length>", "<width>1</width><length>", 1), "<width>", "cannot hold <width>"),
    "missing": (XML.replace("<production-cycle-time>12</production-cycle-time>", ""), "<instance>", "lacks <production"),
    "attribute": (XML.replace('<movement mid="1">', "<movement>", 1), "<movement>", "lacks the attribute mid"),
    "number": (XML.replace("<max-duration>4<", "<max-duration>four<", 1), "<max-duration>four", "'four' is not a number"),
    "NaN": (XML.replace("<max-duration>4<", "<max-duration>nan<", 1), "<max-duration>nan", "not a finite number"),
    "half a cycle": (XML.replace("<height>1<", "<height>0.5<"), "<height>0.5", "0.5 is not a whole number"),
    "unknown activity": (XML.replace("<to-activity>5<", "<to-activity>55<"), "<to-activity>55", "no activity '55'"),
    "unknown point": (XML.replace("<to-point>4<", "<to-point>44<"), "<to-point>44", "there is no point 44"),
    "wrong activity": (XML.replace("<to-point>2<", "<to-point>0<"), "<to-point>0</to-point>\n                <min-duration>1.2", "belongs to activity 0, not to 1"),
    "point twice": (XML.replace("<point>2<", "<point>1<"), "<point>1</point>\n                <loc", "belongs to two locations"),
    "window": (XML.replace("<max-duration>4<", "<max-duration>0.2<", 1), '<static-activity aid="1"', "window from 1 s to 0.2 s"),
    "no last": (XML.replace(' last_in_cycle="true"', "", 1), "<activities>", "0 static activities are the last"),
    "concave": (XML.replace('coeff="700"', 'coeff="-700"'), '<movement mid="1"', "concave"),
    "negative": (XML.replace('degree="-1" coeff="700"', 'degree="0" coeff="-7000"'), '<movement mid="1"', "falls to -"),
    "power mode": (XML.replace('consumption pid="0"', 'consumption pid="7"'), "<consumption pid", "unknown power mode '7'"),
    "no power": (XML.replace("<expected-input-power>280</expected-input-power>", ""), '<static-activity aid="4"', "lacks the power"),
    "location": (XML.replace('lid="1"/><location aid="5" lid="0"', 'lid="1"/><location aid="5" lid="9"', 1), '<compatible-pair><location aid="1"', "activity '5' has no location '9'"),
    "three in a pair": (XML.replace('<movement aid="6" mid="0"/>', '<movement aid="6" mid="0"/>' * 2), "<collision-pair>", "holds 3 choices"),
    "entities": (XML.replace("<dataset>", '<!DOCTYPE d [<!ENTITY a "b">]>\n<dataset>'), "<!DOCTYPE", "document type"),
    "deep": (XML.replace("<name>left</name>", "<desc>" * 40 + "</desc>" * 40), "<desc>", "nested more than 32 deep"),
    "encoding": (XML.replace("UTF-8", "nothing-9"), None, "encoding that is not known"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "place", "problem"), FAULTS.values(), ids=FAULTS)
def test_damaged_files_are_refused_with_the_line(write, text, place, problem):
    error = refused(write(text))
    assert problem in error.problem
    assert error.file and error.file.endswith("cell.xml")
    if place:
        assert f"line {line_of(text, place)}" in (error.key or "")


def test_other_suffixes_are_refused(write):
    assert "unknown file type '.txt'" in refused(write(XML, "cell.txt")).problem
