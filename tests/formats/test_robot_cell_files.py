"""Files of cells of robots: what they hold is read, faults are named with their place."""

import copy
from pathlib import Path

import numpy as np
import pytest

import robojoule as rj
from robojoule.documents import read_document, write_document
from robojoule.errors import InputError
from robojoule.formats.cells import load_cells
from robojoule.formats.robot_cell import RobotCell, move_before
from robojoule.formats.robot_cell_files import SCHEMA_FILE, read_robot_cell, robot_cell_schema
from robojoule.formats.tree_files import save_tree
from tests.planning.robot_cells.cases import EXAMPLES, six, three


def test_the_shipped_schema_is_the_current_one():
    assert read_document(SCHEMA_FILE) == robot_cell_schema()


def test_the_examples_hold_what_they_say():
    (cell,) = load_cells(EXAMPLES / "robot_cell.yaml")
    assert isinstance(cell, RobotCell)
    assert [one.robot.name for one in cell.robots] == ["kuka_kr10_r1100_2", "kuka_kr6_r900_2", "ur_ur10e"]
    loader, welder, _ = cell.robots
    assert loader.robot.payload.mass_kg == 6.0
    assert [mode.name for mode in loader.robot.standby] == ["brakes", "bus off"]
    assert loader.poses("to table") == ("place 1", "place 2")
    assert loader.poses("home") == ("as programmed",)
    np.testing.assert_allclose(welder.base.origin_m, [0.75, 0.75, 0.0])
    np.testing.assert_allclose(welder.base.rotation @ [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], atol=1e-12)
    assert len(six().robots) == 6 and len(three().handovers) == 3


def test_steps_take_place_at_the_target_of_the_move_before_them():
    program = three().robot("loader").program
    assert move_before(program, "grip") == "to magazine"
    assert move_before(program, "to table") == "to table"


@pytest.fixture
def data() -> dict:
    return copy.deepcopy(read_document(EXAMPLES / "robot_cell.yaml"))


def test_programs_and_robots_may_be_files_beside_the_cell(tmp_path: Path, data: dict):
    save_tree(three().robots[0].program.tree, tmp_path / "loader.yaml")
    write_document(tmp_path / "arm.json", read_document(EXAMPLES.parent / "catalog/kuka_kr10_r1100_2.json"))
    data["robots"][0] |= {"program": "loader.yaml", "robot": "arm.json"}
    write_document(tmp_path / "cell.yaml", data)
    cell = read_robot_cell(tmp_path / "cell.yaml")
    assert cell.robots[0].program.path == tmp_path / "loader.yaml"
    assert cell.robots[0].program.tree == three().robots[0].program.tree
    assert cell.robots[0].robot.name == "kuka_kr10_r1100_2"


def robot(change: dict):
    return lambda data: data["robots"][0].update(change)


FAULTS = {
    "unknown key": (lambda data: data.update(cycle=3), "unknown key"),
    "no cycle time": (lambda data: data.pop("cycle_time_s"), "cycle_time_s"),
    "unknown robot": (robot({"robot": "kuka_kr11"}), "robot loader"),
    "heavy": (robot({"payload_kg": 600.0}), "robot loader"),
    "twice": (robot({"name": "welder"}), "appears twice"),
    "no program": (robot({"program": "none.yaml"}), "no such file"),
    "bad program": (robot({"program": {"start_deg": [0], "operations": []}}), "operations"),
    "too few joints": (
        robot(
            {
                "program": {
                    "start_deg": [0, 1],
                    "operations": [
                        {"type": "move", "name": "a", "target_deg": [1, 1]},
                        {"type": "move", "name": "b", "target_deg": [0, 1]},
                    ],
                }
            }
        ),
        "joint",
    ),
    "unknown length": (
        lambda data: data["robots"][0]["program"]["operations"].append({"type": "unknown", "name": "signal"}),
        "nobody knows how long operation 'signal' takes",
    ),
    "last move": (
        robot({"alternatives": [{"move": "home", "given": "a", "poses_deg": {"b": [0, -90, 90, 0, 0, 0]}}]}),
        "must end where it starts",
    ),
    "no move": (
        robot({"alternatives": [{"move": "x", "given": "a", "poses_deg": {"b": [0, -90, 90, 0, 0, 0]}}]}),
        "does not exist",
    ),
    "no poses": (robot({"alternatives": [{"move": "to table", "given": "a"}]}), "must be given once"),
    "same pose": (
        robot({"alternatives": [{"move": "to table", "given": "a", "poses_deg": {"a": [0, -90, 90, 0, 0, 0]}}]}),
        "two names or more",
    ),
    "unknown step": (lambda data: data["handovers"][0]["first"].update(operation="lay"), "unknown operation 'lay'"),
    "one robot": (lambda data: data["handovers"][0].update(second=data["handovers"][0]["first"]), "one robot"),
    "unknown pose": (lambda data: data["handovers"][0].update(poses=[["place 1", "place 3"]]), "no pose 'place 3'"),
    "negative lag": (lambda data: data["handovers"][0].update(lag_s=-1.0), "lag_s"),
    "zone": (lambda data: data["zones"][0]["members"][0].update(robot="x"), "unknown robot 'x'"),
    "standby": (robot({"standby": {}}), "at least one of brakes and bus_off"),
    "safety": (lambda data: data.update(safety_distance_m=-0.1), "safety_distance_m"),
}


@pytest.mark.parametrize(("change", "problem"), FAULTS.values(), ids=FAULTS.keys())
def test_faults_are_named(tmp_path: Path, data: dict, change, problem: str):
    change(data)
    path = tmp_path / "cell.yaml"
    write_document(path, data)
    with pytest.raises(InputError) as caught:
        rj.load_cells(path)
    message = str(caught.value)
    assert problem in message and "\n" not in message
    assert "cell.yaml" in message or "none.yaml" in message


PLACES = {
    "a step": ("operation: lay down", "operation: lay", "handovers.0.first: unknown operation 'lay'"),
    "a pose": (
        "[[place 1, place 1],",
        "[[place 1, place 9],",
        "handovers.0.poses.0: 'weld' of welder has no pose 'place 9'",
    ),
    "a zone": (
        "{robot: unloader, operation: take}\n",
        "{robot: x, operation: take}\n",
        "zones.0.members.2: unknown robot",
    ),
}


@pytest.mark.parametrize(("good", "bad", "problem"), PLACES.values(), ids=PLACES)
def test_the_line_of_a_hand_over_or_zone_is_named(tmp_path: Path, good: str, bad: str, problem: str):
    text = (EXAMPLES / "robot_cell.yaml").read_text(encoding="utf-8")
    at = text.index(good, text.index("zones:" if "robot: x" in bad else "handovers:"))
    path = tmp_path / "cell.yaml"
    path.write_text(text[:at] + bad + text[at + len(good) :], encoding="utf-8")
    line = text[:at].count("\n") + 1
    with pytest.raises(InputError) as caught:
        rj.load_cells(path)
    assert f"cell.yaml, line {line}, {problem}" in str(caught.value)
