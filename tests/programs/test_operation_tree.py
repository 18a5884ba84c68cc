import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.tree_files import parse_tree
from robojoule.programs.operation_tree import OperationTree, tree_from_configurations

HOME_DEG = [0, -90, 90, 0, 0, 0]


def tree() -> OperationTree:
    return parse_tree(
        {
            "format": "robojoule-operation-tree",
            "version": 1,
            "name": "nested",
            "start_deg": [0, 0],
            "operations": [
                {
                    "type": "compound",
                    "name": "outer",
                    "operations": [
                        {"type": "move", "name": "a", "target_deg": [90, 0]},
                        {
                            "type": "compound",
                            "name": "inner",
                            "operations": [
                                {"type": "move", "name": "b", "target_rad": [1, 1], "zone": {"radius_m": 0.2}},
                                {"type": "move", "name": "c", "target_rad": [2, 1], "wait_after_s": 3},
                            ],
                        },
                        {"type": "process", "name": "weld", "duration_s": 2},
                    ],
                },
                {"type": "wait", "name": "pause", "duration_s": 1},
                {"type": "move", "name": "d", "target_deg": [0, 0], "speed_limit_percent": 30},
            ],
        },
        "nested.yaml",
    )


def test_operations_come_in_order_of_execution():
    assert [step.name for step in tree().atomic()] == ["a", "b", "c", "weld", "pause", "d"]
    assert [move.name for move in tree().moves()] == ["a", "b", "c", "d"]
    assert dict(tree().walk())["operations.0.operations.1.operations.0"].name == "b"


def test_configurations_start_at_start():
    expected = [[0, 0], [np.pi / 2, 0], [1, 1], [2, 1], [0, 0]]
    np.testing.assert_allclose(tree().configurations_rad(), expected, rtol=1e-15)


def test_fine_is_the_default_zone():
    assert [move.is_fine for move in tree().moves()] == [True, False, True, True]


def test_plan_is_written_back_into_a_new_tree():
    before = tree()
    after = before.with_plan({"a": 40, "d": 100.0}, waits_before_s={"a": 0.5}, waits_after_s={"c": 0.0})
    changed = {move.name: (move.speed_limit_percent, move.wait_before_s, move.wait_after_s) for move in after.moves()}
    assert changed == {"a": (40, 0.5, 0), "b": (100, 0, 0), "c": (100, 0, 0), "d": (100, 0, 0)}
    assert before == tree()
    np.testing.assert_array_equal(after.configurations_rad(), before.configurations_rad())
    assert [key for key, _ in after.walk()] == [key for key, _ in before.walk()]


def test_empty_plan_changes_nothing():
    assert tree().with_plan({}) == tree()


@pytest.mark.parametrize(
    ("plan", "waits", "message"),
    [
        pytest.param({"e": 50}, {}, "the tree 'nested' has no move 'e'", id="unknown-move"),
        pytest.param({"weld": 50}, {}, "the tree 'nested' has no move 'weld'", id="not-a-move"),
        pytest.param({"a": 0}, {}, "greater than or equal to 0.01", id="zero-speed"),
        pytest.param({"a": 100.1}, {}, "less than or equal to 100", id="too-fast"),
        pytest.param({"a": float("nan")}, {}, "finite", id="nan"),
        pytest.param({}, {"a": -1.0}, "greater than or equal to 0", id="negative-wait"),
        pytest.param({}, {"c": 1.0}, "coarse zone", id="wait-inside-coarse-zone"),
    ],
)
def test_bad_plan_is_refused(plan, waits, message):
    with pytest.raises(InputError, match=message):
        tree().with_plan(plan, waits_before_s=waits)


def test_trees_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        tree().moves()[0].speed_limit_percent = 3


def test_tree_of_configurations():
    tree = tree_from_configurations("t", [[0, 1], [1, 2], [0, 1]], "arm")
    assert [move.name for move in tree.moves()] == ["move-1", "move-2"]
    assert all(move.is_fine and move.speed_limit_percent == 100 for move in tree.moves())
    assert tree.configurations_rad().tolist() == [[0, 1], [1, 2], [0, 1]]
    assert tree.robot == "arm"
