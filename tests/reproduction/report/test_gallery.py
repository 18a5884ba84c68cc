import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from reproduction.parts import Parts
from reproduction.report.gallery import ENTRIES, Picture, draw_all, draw_in_parts
from reproduction.report.results import Results
from robojoule.errors import InputError
from robojoule.plots.style import Style
from robojoule.robots import load_robot
from tests.reproduction.report import toy

CATALOG = Path(__file__).parents[3] / "robojoule/catalog"
THESIS_FIGURES = {
    3: ["1", "2", "3"],
    4: ["1b", "2", "3", "4", "5", "6", "7"],
    5: ["1", "2", "3", "4"],
    6: ["1", "2", "3"],
}
# Under and above Matplotlib's axes: what every drawn figure holds.
MARKS = ("<path", "<use")


def test_every_figure_of_the_thesis_with_data_is_there():
    expected = [f"{chapter}.{part}" for chapter, parts in THESIS_FIGURES.items() for part in parts]
    assert [entry.number for entry in ENTRIES if entry.number] == expected
    assert len({entry.name for entry in ENTRIES}) == len(ENTRIES)


def test_all_are_drawn(pictures: dict[str, Picture]):
    assert list(pictures) == [entry.name for entry in ENTRIES]
    for picture in pictures.values():
        ET.fromstring(picture.svg)
        assert any(mark in picture.svg for mark in MARKS)
        assert len(picture.caption) > 40 and len(picture.alt) > 40
        assert not re.search(r"\bnan\b|\bNone\b", picture.caption + picture.alt), picture.caption


def test_pictures_do_not_depend_on_the_number_of_processes(toy_results: Results, pictures: dict[str, Picture]):
    found = {picture.entry.name: picture for picture in draw_in_parts(toy_results, Style(), Parts(workers=3))}
    assert list(found) == list(pictures)
    assert [name for name, one in found.items() if one.svg != pictures[name].svg] == []
    assert [one.caption for one in found.values()] == [one.caption for one in pictures.values()]


def test_style_reaches_the_figures(toy_results: Results, pictures: dict[str, Picture]):
    entry = next(entry for entry in ENTRIES if entry.name == "energy_of_trees")
    (other,) = draw_all(toy_results, Style(colormap="plasma"), (entry,))
    assert other.svg != pictures["energy_of_trees"].svg and other.caption == pictures["energy_of_trees"].caption


def test_arm_of_three_joints_and_trees_of_one_point(tmp_path: Path):
    """No figure counts on six joints or ten movements."""
    file = json.loads((CATALOG / "kuka_kr16_r2010_2.json").read_text(encoding="utf-8"))
    moving = [joint["name"] for joint in file["joints"] if joint["type"] != "fixed"]
    for joint in file["joints"]:
        if joint["name"] in moving[3:]:
            for key in ("lower_rad", "upper_rad", "velocity_rad_s", "effort_nm"):
                joint.pop(key)
            joint["type"] = "fixed"
    file["name"] = "three_joints"
    file["lumped_links"] = {}
    file["home_rad"] = file["home_rad"][:3]
    file["drives"]["joints"] = {name: file["drives"]["joints"][name] for name in moving[:3]}
    (tmp_path / "three_joints.json").write_text(json.dumps(file), encoding="utf-8")
    robot = load_robot(tmp_path / "three_joints.json")
    assert robot.joint_count == 3
    toy.make(tmp_path, robot, points=1)
    drawn = list(draw_all(toy.results(tmp_path, robot), Style()))
    assert len(drawn) == len(ENTRIES)


def test_a_missing_result_is_named(tmp_path: Path, toy_results: Results):
    empty = toy.results(tmp_path, toy_results.robot)
    with pytest.raises(InputError, match=r"trees\.parquet: this result is missing"):
        list(draw_all(empty, Style()))
