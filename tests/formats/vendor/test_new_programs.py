"""New FANUC and ABB programs of operation trees: read back they do the same."""

import re

import numpy as np
import pytest

from robojoule.checks import model_program
from robojoule.errors import InputError
from robojoule.formats.program import Program, load_program
from robojoule.formats.registry import format_of
from robojoule.formats.vendor.files import VendorFiles
from robojoule.formats.vendor.krl.composing import compose_krl
from robojoule.motion.simulation import MotionPaths
from robojoule.programs.operation_tree import OperationTree, ShareZone
from robojoule.robots import load_robot

ROBOTS = {".ls": "fanuc_r2000ic_165f", ".mod": "kuka_kr16_r2010_2"}


def tree(**more):
    moves = [
        {"type": "move", "name": "to part", "target_deg": [30, -60, 80, 10, 20, -15], "speed_limit_percent": 70},
        {"type": "move", "name": "via 1", "target_deg": [40, -50, 70, 0, 20, 0], "zone": {"radius_m": 0.05}},
        {"type": "move", "name": "place", "target_deg": [60, -50, 70, 0, 30.123, 0], "added_wait_after_s": 0.75},
        {"type": "process", "name": "weld", "duration_s": 1.25, "power_w": 500.0},
        {"type": "move", "name": "home", "target_deg": [0, -55, 90, 0, 0, 0], "speed_limit_percent": 33},
    ]
    start = {"start_deg": [0, -55, 90, 0, 0, 0], "operations": moves}
    return OperationTree.model_validate(
        {"format": "robojoule-operation-tree", "version": 1, "name": "cycle", **start, **more}
    )


def created(tmp_path, suffix, robot, one=None):
    path = tmp_path / f"new{suffix}"
    found = format_of(path)
    assert isinstance(found, VendorFiles)
    found.create(one or tree(), path, robot)
    return path, found


def durations_s(one, robot):
    """Of all moves, each from rest to rest; speed limits that a short move does not reach are all the same to it."""
    places = model_program(Program(one), robot).tree.configurations_rad()
    limits = np.array([[move.speed_limit_percent / 100] for move in one.moves()])
    return MotionPaths(robot, places[:-1], places[1:]).durations(limits)[:, 0]


@pytest.mark.parametrize("suffix", ROBOTS)
def test_a_new_program_does_what_the_tree_says(tmp_path, suffix):
    robot = load_robot(ROBOTS[suffix], payload_kg=5)
    path, _ = created(tmp_path, suffix, robot)
    program = load_program(path).for_robot(robot)
    np.testing.assert_allclose(
        model_program(program, robot).tree.configurations_rad(), tree().configurations_rad(), atol=1e-9
    )
    np.testing.assert_allclose(durations_s(program.tree, robot), durations_s(tree(), robot), rtol=1e-4)
    assert [move.added_wait_after_s for move in program.moves] == [0, 0, 0.75, 0]
    assert [move.is_fine for move in program.moves] == [True, False, True, True]
    assert [one.duration_s for one in program.tree.operations if one.type == "wait"] == [1.25]
    assert program.source.texts(program.tree) == (path.read_text(),)


def test_what_a_teach_pendant_cannot_say_is_listed(tmp_path):
    robot = load_robot(ROBOTS[".ls"])
    one = tree().with_plan({"to part": 33.4}, waits_after_s={"home": 0.127})
    lost = format_of(tmp_path / "a.ls").create(one, tmp_path / "a.ls", robot)
    assert any("34 % instead of 33.4 %" in text for text in lost)
    assert any("CNT is not a radius" in text for text in lost)
    assert any("0.12 s instead of 0.127 s" in text for text in lost)
    assert any("without its power" in text for text in lost)
    assert load_program(tmp_path / "a.ls").moves[0].speed_limit_percent == 34


def test_what_cannot_be_said_at_all_is_refused(tmp_path):
    with pytest.raises(InputError, match="no robot says how long"):
        format_of(tmp_path / "a.mod").create(tree(), tmp_path / "a.mod", None)
    with pytest.raises(InputError, match="angles of a robot's model"):
        Program(tree()).save(tmp_path / "a.ls")
    short = tree(start_deg=[0, 0], operations=[{"type": "move", "name": "m", "target_deg": [1, 2]}], angles="pendant")
    with pytest.raises(InputError, match="6 axes, the program has 2"):
        format_of(tmp_path / "a.ls").create(short, tmp_path / "a.ls", None)
    long = tree().with_plan({}, waits_after_s={"home": 400.0})
    with pytest.raises(InputError, match=r"too long; allowed: up to 327\.67 s"):
        format_of(tmp_path / "a.ls").create(long, tmp_path / "a.ls", load_robot(ROBOTS[".ls"]))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix, word", [(".src", "C_PTP"), (".ls", "CNT60")])
def test_zones_that_are_shares_of_a_path_are_said(tmp_path, suffix, word):
    """KUKA's percentage and FANUC's CNT count shares of half a motion."""
    moves = list(tree().model_dump()["operations"])
    moves[1]["zone"] = {"path_share": 0.3}
    one = tree().model_validate(tree().model_dump() | {"operations": moves})
    robot = load_robot("kuka_kr16_r2010_2" if suffix == ".src" else ROBOTS[suffix])
    path, _ = created(tmp_path, suffix, robot, one)
    assert word in path.read_text()
    again = load_program(path).for_robot(robot)
    assert [move.zone for move in again.moves] == ["fine", ShareZone(path_share=0.3), "fine", "fine"]


@pytest.mark.parametrize("suffix", [".mod", ".script"])
def test_what_has_no_word_for_shares_stops_and_says_so(tmp_path, suffix):
    moves = list(tree().model_dump()["operations"])
    moves[1] |= {"zone": {"path_share": 0.3}, "speed_group": "line"}
    moves.append({"type": "payload", "name": "empty", "mass_kg": 0.0})
    one = tree().model_validate(tree().model_dump() | {"operations": moves})
    path = tmp_path / f"new{suffix}"
    lost = format_of(path).create(one, path, load_robot("kuka_kr16_r2010_2"))
    assert any("a share of the path, is left out" in text for text in lost)
    assert any("the speed group of move 'via 1' is not said" in text for text in lost)
    assert any("the payload of 'empty' is left out" in text for text in lost)


NAMES = ["return", "while", "move", "v1000", "zone1", "zone2", "WaitTime", "robtarget", "pi"]


def test_names_of_a_new_abb_program_hide_nothing(tmp_path):
    """Keywords, data of the controller and the zones that the program declares are names already."""
    robot = load_robot(ROBOTS[".mod"], payload_kg=5)
    starts = [[5 * (k + 1), -60, 80, 0, 20, 0] for k in range(len(NAMES))]
    moves = [
        {"type": "move", "name": name, "target_deg": at, "zone": {"radius_m": 0.0071}}
        for name, at in zip(NAMES, starts, strict=True)
    ]
    one = tree(operations=[*moves, {"type": "move", "name": "home", "target_deg": [0, -55, 90, 0, 0, 0]}])
    path, _ = created(tmp_path, ".mod", robot, one)
    declared = re.findall(r"CONST (?:jointtarget|zonedata) (\w+):=", path.read_text())
    points = ["return_2", "while_2", "move", "v1000_2", "zone1_2", "zone2", "WaitTime_2", "robtarget_2", "pi_2", "home"]
    assert declared == ["start", *points, "zone1"]
    again = load_program(path, robot)
    np.testing.assert_allclose(again.tree.configurations_rad(), one.configurations_rad(), atol=1e-9)
    assert again.tree.moves()[0].zone.radius_m == pytest.approx(0.0071)


def test_waits_of_a_new_abb_program_are_not_longer_and_that_is_said(tmp_path):
    robot, path = load_robot(ROBOTS[".mod"], payload_kg=5), tmp_path / "new.mod"
    moves = tree().model_dump()["operations"]
    moves[0]["wait_after_s"], moves[2]["wait_after_s"] = 0.2506, 0.3
    found = format_of(path)
    assert isinstance(found, VendorFiles)
    lost = found.create(tree(operations=moves), path, robot)
    assert "WaitTime 0.25; ! to part" in path.read_text() and "WaitTime 0.3;" in path.read_text()
    assert [text for text in lost if "milliseconds" in text] == [
        "the wait 'to part' is 0.25 s, a whole number of milliseconds"
    ]


@pytest.mark.parametrize("name", ["movej", "while", "set_tcp", "get_inverse_kin", "start_q"])
def test_the_name_of_a_new_script_is_no_name_of_the_language(tmp_path, name):
    robot, path = load_robot("ur_ur10e", payload_kg=3), tmp_path / f"{name}.script"
    one = tree(start_deg=[0, -55, 90, -100, -80, 0])
    found = format_of(path)
    assert isinstance(found, VendorFiles)
    found.create(one, path, robot)
    assert path.read_text().startswith(f"def {name}_2():")
    assert len(load_program(path, robot).moves) == 4


def test_a_way_that_the_new_program_does_not_go_is_told(tmp_path):
    """A motion that is kept in the program that was read, and one along a path of the tool."""
    axes = "[9E9,9E9,9E9,9E9,9E9,9E9]]"
    home, place = f"[[0,-90,90,0,0,0],{axes}", f"[[1200,0,1000],[0.7071,0,0.7071,0],[0,0,0,0],{axes}"
    lines = [
        f"MoveAbsJ {home},v1000,fine,tool0;",
        f"MoveJ {place},v1000,fine,tool0;",
        f"MoveL Offs({place},0,50,0),v100,fine,tool0;",
        "elsewhere;",
        f"MoveAbsJ {home},v1000,fine,tool0;",
        f"MoveJ {place},v1000,fine,tool0;",
    ]
    (tmp_path / "cycle.mod").write_text("MODULE m\nPROC main()\n" + "\n".join(lines) + "\nENDPROC\nENDMODULE\n")
    tree = load_program(tmp_path / "cycle.mod", load_robot("kuka_kr16_r2010_2")).tree
    lost = "\n".join(compose_krl(tree, None, "cycle").lost)
    assert "along a path of the tool, is a joint motion" in lost
    assert "is a remark: the robot does not go to where it ends" in lost


def test_positions_far_beyond_all_limits_are_refused_at_once(tmp_path):
    """Simulating the way there would not end."""
    robot = load_robot("kuka_kr16_r2010_2")
    far = "[[0,7E9,90,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    lines = f"MoveAbsJ {far},v1000,fine,tool0;\nMoveAbsJ {far.replace('90', '80')},v1000,fine,tool0;\n"
    (tmp_path / "far.mod").write_text(f"MODULE m\nPROC main()\n{lines}ENDPROC\nENDMODULE\n")
    with pytest.raises(InputError, match=r"7e\+09 degrees are beyond the limits of any joint"):
        load_program(tmp_path / "far.mod", robot)
    start = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    moves = [{"type": "move", "name": "a", "target_rad": [0.0, 1e8, 1.0, 0.0, 0.0, 0.0]}]
    one = OperationTree.model_validate({**tree().model_dump(), "start_rad": start, "operations": moves})
    with pytest.raises(InputError, match="limit"):
        created(tmp_path, ".mod", robot, one)
