"""Zones, payloads and speed groups of operations: what is refused, and how."""

import pytest

from robojoule.errors import InputError
from robojoule.formats.tree_files import parse_tree
from robojoule.programs.operation_tree import ShareZone
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
