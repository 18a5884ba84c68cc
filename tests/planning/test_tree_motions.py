"""Motions of trees: chains through coarse zones, and what the robot carries in each."""

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import InputError
from robojoule.motion.blends import BlendedPaths
from robojoule.motion.corners import Chain
from robojoule.motion.groups import LoadedMotions
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.batch import TreeBatch
from robojoule.planning.tree_motions import chains_of_tree, check_single_moves, tree_payloads
from robojoule.programs.operation_tree import PayloadOperation
from robojoule.robots.robot import Payload
from tests.core_cases import kr16
from tests.planning.blended_trees import WAY_DEG, carrying, loop, move, program, there_and_back
from tests.planning.trees import tree


def test_chains_end_at_fine_moves():
    found = chains_of_tree(there_and_back({"radius_m": 0.1}).tree)
    assert [len(chain.points_rad) for chain in found] == [4, 3]
    assert found[0].radius_m.tolist() == [0.1, 0.1]
    assert (found[0].path_share >= 0.5).all()
    (share,) = chains_of_tree(there_and_back({"path_share": 0.25}).tree)[1].path_share
    assert share == 0.25
    assert [len(chain.points_rad) for chain in chains_of_tree(tree())] == [2] * 4


def test_a_cycle_of_chains_is_the_sum_of_its_chains():
    robot, given = kr16(), there_and_back({"radius_m": 0.1})
    run = rj.simulate(given, robot)
    blended = BlendedPaths(robot, chains_of_tree(given.tree)).simulate([1.0])
    idle = BlendedPaths(robot, chains_of_tree(given.tree)).idle_power_end_w
    assert run.names == ("place", "home")
    assert run.through == (("a", "b"), ("d",))
    assert run.energy_j == pytest.approx(blended.energy_j.sum() + 0.3 * idle[0])
    assert run.cycle_time_s == pytest.approx(blended.duration_s.sum() + 0.3)
    fine = rj.simulate(there_and_back("fine"), robot)
    assert run.cycle_time_s < fine.cycle_time_s - 0.1
    assert run.energy_j < fine.energy_j
    assert run.to_dict()["moves"][0]["through"] == ["a", "b"]


def test_moves_keep_their_own_speed_limits():
    robot, given = kr16(), there_and_back({"radius_m": 0.1})
    slow = rj.Program(given.tree.with_plan({"b": 40.0}))
    chain = chains_of_tree(given.tree)[0]
    expected = BlendedPaths(robot, [chain]).simulate_moves(np.array([[1.0], [0.4], [1.0]])).duration_s
    found = rj.simulate(slow, robot)
    assert found.durations_s[0] == pytest.approx(expected[0, 0])
    assert found.durations_s[0] > rj.simulate(given, robot).durations_s[0]
    assert found.speed_limits.tolist() == [1.0, 1.0]


def test_every_motion_has_its_payload():
    """Against three robots that carry one payload each."""
    robot, given = kr16(5.0), carrying()
    gripped = Payload(14.0, (0.0, 0.05, 0.15))
    released = Payload(2.0, inertia_kg_m2=[0.01, 0.01, 0.01])
    assert tree_payloads(robot, given.tree) == [robot.payload, gripped, released]
    run, batch = rj.simulate(given, robot), TreeBatch(robot, [given.tree])
    assert isinstance(batch.planned, LoadedMotions)
    chains = chains_of_tree(given.tree)
    alone = [
        BlendedPaths(robot.carrying(load), [chain])
        for load, chain in zip((robot.payload, gripped, released), chains, strict=True)
    ]
    energies = [one.simulate([1.0]).energy_j[0, 0] for one in alone]
    waits = 0.2 * alone[0].idle_power_end_w[0]  # it grips at the end of the stop
    assert run.energy_j == pytest.approx(sum(energies) + waits)
    assert run.durations_s == pytest.approx([one.durations([1.0])[0, 0] for one in alone])
    plain = rj.simulate(program([op for op in given.tree.model_dump()["operations"] if op["type"] != "payload"]), robot)
    assert run.energy_j != pytest.approx(plain.energy_j, rel=1e-3)


def test_a_payload_from_the_start_on_is_that_of_the_robot():
    """Set before the first move, it takes the place of what the robot was given."""
    a, *_ = WAY_DEG
    operations = [
        {"type": "payload", "name": "tool", "mass_kg": 12.0},
        move("a", a),
        move("home", (0, -90, 90, 0, 0, 0)),
    ]
    given = program(operations)
    assert isinstance(TreeBatch(kr16(3.0), [given.tree]).planned, MotionPaths)
    assert rj.simulate(given, kr16(3.0)).energy_j == rj.simulate(program(operations[1:]), kr16(12.0)).energy_j


def test_a_payload_above_the_rated_one_is_refused():
    given = program([move("a", WAY_DEG[0]), {"type": "payload", "name": "safe", "mass_kg": 90}, move("b", WAY_DEG[1])])
    with pytest.raises(InputError, match=r"operations\.1\.mass_kg: a payload of 90 kg is more than"):
        rj.simulate(given, kr16())


def test_a_payload_operation_is_a_payload():
    operation = PayloadOperation(name="grip", mass_kg=3.0, com_m=(0.0, 0.0, 0.2), inertia_kg_m2=(0.1, 0.1, 0.1))
    assert operation.payload() == Payload(3.0, (0.0, 0.0, 0.2), [0.1, 0.1, 0.1])


@pytest.mark.parametrize("given", [there_and_back({"radius_m": 0.1}), carrying(), loop()], ids=lambda one: one.name)
def test_what_knows_single_moves_alone_says_what_it_does_not_know(given):
    with pytest.raises(InputError, match=r"^(move|operation) '[\w ]+' .* know single moves with one payload only"):
        check_single_moves(given.tree)
    check_single_moves(tree())


def test_a_straight_chain_is_one_of_two_points():
    assert Chain.straight(np.zeros(2), np.ones(2)).points_rad.tolist() == [[0, 0], [1, 1]]
