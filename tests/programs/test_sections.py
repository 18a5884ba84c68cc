"""Sections of cycles with parts of unknown length: what they carry, and groups that several of them share."""

from robojoule.programs.operation_tree import PayloadOperation
from robojoule.programs.sections import sections_of, shared_groups
from tests.programs.test_operations import GRIP, move, parsed

SIGNAL = {"type": "unknown", "name": "signal"}


def test_a_section_begins_with_what_the_one_before_it_carries():
    tree = parsed(move("a", 1.0), GRIP, move("b", 0.5), SIGNAL, move("c", 1.5), move("d", 0.0))
    one, other = sections_of(tree)
    assert one.payloads() == tree.payloads()[:2]
    assert other.payloads() == tree.payloads()[2:]
    assert isinstance(other.operations[0], PayloadOperation)


def test_moves_of_a_group_that_sections_share_keep_their_speed():
    groups = ("both", "first", "first", "both")
    moves = [
        move(name, angle, speed_group=group) for name, angle, group in zip("abcd", (1, 2, 1, 0), groups, strict=True)
    ]
    tree = parsed(*moves[:3], SIGNAL, moves[3])
    assert shared_groups(tree) == {"both"}
    one, other = sections_of(tree)
    assert [(m.fixed, m.speed_group) for m in one.moves()] == [(True, None), (False, "first"), (False, "first")]
    assert [(m.fixed, m.speed_group) for m in other.moves()] == [(True, None)]
