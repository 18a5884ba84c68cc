"""What robots of a cell may do: standstills and their steps, motions between poses, programs that cannot be planned."""

from dataclasses import replace

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.robot_cell import PlacedRobot
from robojoule.planning.robot_cells.solve import plan_robot_cell
from robojoule.planning.robot_cells.work import RobotWork
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.rigid_body import Placement
from tests.planning.robot_cells.cases import three, with_loader, work_of_three


def loader_with(operations: list[dict]) -> PlacedRobot:
    """The loader with another program."""
    one = three().robots[0]
    tree = one.program.tree
    data = {"format": tree.format, "version": tree.version, "name": "other", "start_rad": tree.start_rad}
    program = replace(one.program, tree=OperationTree(**data, operations=operations))
    return replace(one, program=program, alternatives={})


def move(name: str, *change_rad: float, **more: object) -> dict:
    start = np.array(three().robots[0].program.tree.start_rad)
    start[: len(change_rad)] += change_rad
    return {"type": "move", "name": name, "target_rad": tuple(start), **more}


def process(name: str, seconds: float, power_w: float = 0.0) -> dict:
    return {"type": "process", "name": name, "duration_s": seconds, "power_w": power_w}


def test_steps_follow_each_other_from_the_arrival_on():
    """By hand: a waits 0.2 s, steps of 0.5 and 0.3 s, b waits 0.1 s; the first step belongs to the next cycle."""
    operations = [
        process("first", 0.4, 100.0),
        move("a", 0.5, wait_after_s=0.2),
        process("p", 0.5, 50.0),
        process("q", 0.3),
        move("b", wait_before_s=0.1),
        process("last", 0.6),
    ]
    work = RobotWork(loader_with(operations), 10.0, 0.01)
    first, last = work.standstills
    assert first.least_s == pytest.approx(0.2 + 0.5 + 0.3 + 0.1)
    assert first.spans_s == {"p": (0.2, pytest.approx(0.7)), "q": (pytest.approx(0.7), pytest.approx(1.0))}
    assert first.process_w == ((0.2, pytest.approx(0.7), 50.0),)
    assert last.least_s == pytest.approx(1.0)
    assert last.spans_s["first"] == (pytest.approx(0.6), pytest.approx(1.0))
    assert work.start_of("first") == (last.name, pytest.approx(0.6 - 10.0))  # before the cycle's first move
    assert work.end_of("p") == (first.name, pytest.approx(0.7))
    assert work.start_of("b") == (work.activity(1), 0.0)
    assert work.end_of("a") == (first.name, 0.0)
    assert work.before_s == {"first": 0.4}


def test_motions_join_all_poses():
    work = work_of_three().works[0]
    names = [(work.moves[one.move].name, one.name) for one in work.motions]
    assert names == [
        ("to magazine", "as programmed"),
        ("to table", "to place 1"),
        ("to table", "to place 2"),
        ("home", "from place 1"),
        ("home", "from place 2"),
    ]
    np.testing.assert_allclose(work.paths.start_rad[4], work.poses_rad[1]["place 2"])


def test_profiles_are_convex_and_nowhere_above_simulated_runs():
    """Oracle: runs at other speed limits."""
    work = work_of_three()
    for r, robot in enumerate(work.works):
        low, high = robot.speed_range
        limits = low[:, None] + np.linspace(0.02, 1.0, 15) * (high - low)[:, None]
        runs = robot.paths.simulate(limits)
        for row in range(len(robot.motions)):
            ((_, profile),) = work.convex[r, row]
            assert profile.is_convex
            inside = (runs.duration_s[row] >= profile.d_min_s) & (runs.duration_s[row] <= profile.d_max_s)
            below = profile.value(runs.duration_s[row][inside])
            assert (below <= runs.energy_j[row][inside] * (1.0 + 1e-6)).all()
            assert (below >= runs.energy_j[row][inside] * 0.9).all()


@pytest.mark.parametrize(
    ("cell", "problem"),
    [
        (lambda: with_loader(base=Placement.of((0.7, 0.7, 0.0), (0.0, 0.0, 0.0))), "the bases of loader and welder"),
        (lambda: with_robot(loader_with([move("a", 0.5), move("b", 0.2)])), "ends elsewhere than it starts"),
        (lambda: with_robot(loader_with([move("a", 0.5), move("b", 0.5), move("c")])), "move 'b' does not move"),
        (lambda: with_robot(loader_with([move("a", 0.5), process("p", 20.0), move("b")])), "is shorter than"),
        (
            lambda: with_robot(loader_with([move("a", 0.5, zone={"radius_m": 0.1}), move("b", 0.7), move("c")])),
            "move 'a' has a coarse zone",
        ),
    ],
)
def test_what_cannot_be_planned_is_refused(cell, problem):
    with pytest.raises(InputError, match=problem):
        plan_robot_cell(cell())


def with_robot(one: PlacedRobot):
    """The loader alone, with another program."""
    return replace(three(), robots=(one,), handovers=(), zones=())
