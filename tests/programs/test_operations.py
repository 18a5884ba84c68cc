"""Zones, payloads and speed groups of operations: what is refused, and how."""

import pytest

from robojoule.errors import InputError
from robojoule.formats.tree_files import parse_tree, tree_to_data
from robojoule.programs.operation_tree import ShareZone, ToolPath
from robojoule.robots.robot import Payload


def move(name, angle=0.0, **keys):
    return {"type": "move", "name": name, "target_rad": [angle, 0.0], **keys}


def parsed(*operations):
    root = {"format": "robojoule-operation-tree", "version": 1, "name": "t", "start_rad": [0.0, 0.0]}
    return parse_tree(root | {"operations": list(operations)}, "cell.yaml")


GRIP = {"type": "payload", "name": "grip", "mass_kg": 2}
BAD = {
    "two kinds of zone": (
        [move("via", zone={"radius_m": 1, "path_share": 0.2}), move("stop")],
        "operations.0.zone.radius_m: operation 'via': unknown key; allowed: path_share",
    ),
    "more than half of a path": (
        [move("via", zone={"path_share": 0.6}), move("stop")],
        "operations.0.zone.path_share: operation 'via': input should be less than or equal to 0.5 (found 0.6)",
    ),
    "no share": (
        [move("via", zone={"path_share": 0}), move("stop")],
        "operations.0.zone.path_share: operation 'via': input should be greater than 0 (found 0)",
    ),
    "payload in a zone": (
        [move("via", zone={"radius_m": 0.1}), GRIP, move("stop")],
        "operations.0.zone: move 'via' has a coarse zone, so a fine move must come before payload 'grip'",
    ),
    "negative payload": (
        [move("stop"), GRIP | {"mass_kg": -2}],
        "operations.1.mass_kg: operation 'grip': input should be greater than or equal to 0 (found -2)",
    ),
    "payload far away": (
        [move("stop"), GRIP | {"com_m": [0, 0, 150]}],
        "operations.1: operation 'grip': (0.0, 0.0, 150.0) is not a valid centre of mass",
    ),
    "inertia of no body": (
        [move("stop"), GRIP | {"inertia_kg_m2": [1, 1, -1]}],
        "operations.1: operation 'grip': the inertia is not that of a body: "
        "a symmetric positive semi-definite 3 x 3 matrix",
    ),
    "two speeds in a group": (
        [move("one", speed_group="loop"), move("two", 1.0, speed_group="loop", speed_limit_percent=40)],
        "operations.1.speed_limit_percent: moves 'one' and 'two' of speed group 'loop' differ in it",
    ),
    "fixed in part of a group": (
        [move("one", speed_group="loop"), move("two", 1.0, speed_group="loop", fixed=True)],
        "operations.1.fixed: moves 'one' and 'two' of speed group 'loop' differ in it",
    ),
    "no path": (
        [move("one", path="straight")],
        "operations.0.path: operation 'one': a path is the word joint or linear, or a mapping with type linear or "
        "circular (found 'straight')",
    ),
    "a circle without its point": (
        [move("one", path={"type": "circular"})],
        "operations.0.path: operation 'one': a circular path passes a point via_m, a linear one does not",
    ),
    "a line with a point": (
        [move("one", path={"type": "linear", "via_m": [0, 0, 1]})],
        "operations.0.path: operation 'one': a circular path passes a point via_m, a linear one does not",
    ),
    "unknown key of a path": (
        [move("one", path={"type": "linear", "speed": 1})],
        "operations.0.path.speed: operation 'one': unknown key; allowed: acceleration_m_s2, acceleration_rad_s2, "
        "tool_m, type, via_m",
    ),
    "no acceleration": (
        [move("one", path={"type": "linear", "acceleration_m_s2": 0})],
        "operations.0.path.acceleration_m_s2: operation 'one': input should be greater than 0 (found 0)",
    ),
    "a path of the tool that ends in a zone": (
        [move("one", path="linear", zone={"radius_m": 0.1}), move("stop")],
        "operations.0.zone: move 'one' has a coarse zone, but its path is that of the tool, which stops at its end",
    ),
    "a path of the tool out of a zone": (
        [move("via", zone={"radius_m": 0.1}), move("seam", path="linear")],
        "operations.0.zone: move 'via' has a coarse zone, so 'seam' behind it cannot have a path of the tool",
    ),
}


@pytest.mark.parametrize("operations, message", BAD.values(), ids=BAD)
def test_what_is_wrong_is_said_in_one_sentence(operations, message):
    with pytest.raises(InputError) as caught:
        parsed(*operations)
    assert str(caught.value) == f"cell.yaml, {message}"


def test_payloads_hold_from_their_place_on():
    tree = parsed(move("a"), GRIP, move("b", 1.0), {"type": "compound", "name": "c", "operations": [move("d")]})
    assert tree.payloads() == (None, Payload(2.0), Payload(2.0))


def test_a_zone_of_a_share_is_coarse():
    tree = parsed(move("via", zone={"path_share": 0.25}), move("stop"))
    assert tree.moves()[0].zone == ShareZone(path_share=0.25)
    assert not tree.moves()[0].is_fine


def test_a_plan_sets_all_moves_of_a_group():
    tree = parsed(move("one", speed_group="loop"), move("two", 1.0, speed_group="loop"))
    assert {m.speed_limit_percent for m in tree.with_plan({"one": 40.0, "two": 40.0}).moves()} == {40.0}
    with pytest.raises(InputError, match="moves 'one' and 'two' of speed group 'loop' differ in it"):
        tree.with_plan({"one": 40.0})


def test_a_path_is_a_word_or_says_its_tool():
    tool = {"type": "linear", "tool_m": [0, 0, 0.2], "acceleration_m_s2": 1.5}
    tree = parsed(move("a"), move("b", 1.0, path="linear"), move("c", path=tool), move("d", path="joint"))
    paths = [one.tool_path for one in tree.moves()]
    assert paths == [None, ToolPath(type="linear"), ToolPath(**tool), None]
    data = tree_to_data(tree)
    assert [one.get("path") for one in data["operations"]] == [None, "linear", tool, None]
    assert parse_tree(data, "cell.yaml") == tree
    assert tree.with_plan({"c": 40.0}).moves()[2].path == ToolPath(**tool)
