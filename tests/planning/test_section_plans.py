"""Plans of cycles with parts of unknown length: each section keeps its own share of time."""

import numpy as np
import pytest

from robojoule.api import adjust, optimize, pareto, simulate
from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.programs.operation_tree import OperationTree, UnknownOperation, tree_from_configurations
from robojoule.programs.sections import sections_of
from robojoule.robots import load_robot

ROBOT = load_robot("kuka_kr16_r2010_2", payload_kg=8)
POINTS = np.radians([[0, -90, 90, 0, 0, 0], [50, -70, 80, 0, 30, 0], [-20, -60, 100, 40, 0, 0], [0, -90, 90, 0, 0, 0]])


def with_unknown(after: int, target=None) -> OperationTree:
    tree = tree_from_configurations("cycle", POINTS)
    unknown = UnknownOperation(name="signal", target_rad=target)
    operations = (*tree.operations[:after], unknown, *tree.operations[after:])
    return OperationTree.model_validate(tree.model_copy(update={"operations": operations}).model_dump())


def test_a_tree_without_unknown_parts_is_its_own_section():
    tree = tree_from_configurations("cycle", POINTS)
    assert sections_of(tree) == (tree,)


def test_sections_begin_where_the_robot_is():
    first, second = sections_of(with_unknown(2))
    assert np.array_equal(first.configurations_rad(), POINTS[:3])
    assert np.array_equal(second.configurations_rad(), POINTS[2:])
    elsewhere = tuple((POINTS[2] + 0.1).tolist())
    _, second = sections_of(with_unknown(2, elsewhere))
    assert second.start_rad == elsewhere


@pytest.mark.parametrize("after, sections", [(0, 1), (1, 2), (3, 1)])
def test_a_section_needs_a_motion(after, sections):
    assert len(sections_of(with_unknown(after))) == sections


def test_each_section_keeps_its_share_of_time():
    tree = with_unknown(2)
    plan = optimize(Program(tree), ROBOT, cycle_time="+10%")
    alone = [optimize(Program(section), ROBOT, cycle_time="+10%") for section in sections_of(tree)]
    assert plan.cycle_time_s == pytest.approx(sum(one.cycle_time_s for one in alone))
    assert plan.energy_j == pytest.approx(sum(one.energy_j for one in alone))
    assert plan.energy_given_j == pytest.approx(sum(one.energy_given_j for one in alone))
    assert plan.bound_j <= plan.energy_j
    assert [move.name for move in plan.moves] == [move.name for move in tree.moves()]
    assert plan.warnings[-1].startswith("time and energy are those of 2 sections: how long operation 'signal' takes")
    run = simulate(plan.program, ROBOT)
    assert (run.cycle_time_s, run.energy_j) == pytest.approx((plan.cycle_time_s, plan.energy_j))
    again = optimize(plan.program, ROBOT, cycle_time="+0%")
    assert again.program.tree == plan.program.tree


def test_what_needs_the_whole_cycle_names_what_is_missing():
    program = Program(with_unknown(2))
    for call, key in (
        (lambda: optimize(program, ROBOT, cycle_time=5.0), "cycle_time"),
        (lambda: pareto(program, ROBOT), "a trade-off"),
        (lambda: adjust(program, ROBOT, measured_cycle=5.0), "adjust"),
    ):
        with pytest.raises(InputError, match="how long operation 'signal' takes") as caught:
            call()
        assert key in str(caught.value)


@pytest.mark.parametrize(
    "task", [lambda program: optimize(program, ROBOT, cycle_time="+10%"), lambda program: simulate(program, ROBOT)]
)
def test_a_program_that_moves_in_parts_of_unknown_length_only_names_them(task):
    there = tuple(POINTS[1].tolist())
    tree = tree_from_configurations("cycle", [POINTS[0], POINTS[0], POINTS[1]])
    first, second = tree.operations
    operations = (first, UnknownOperation(name="weld", target_rad=there), second)
    tree = OperationTree.model_validate(tree.model_copy(update={"operations": operations}).model_dump())
    with pytest.raises(InputError, match="no motion stands apart from the parts of unknown length: operation 'weld'"):
        task(Program(tree))
