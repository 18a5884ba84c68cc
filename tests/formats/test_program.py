"""Programs: what they say of themselves, whether a robot can execute them."""

from pathlib import Path

import numpy as np
import pytest

import robojoule as rj
from robojoule.errors import InputError
from robojoule.formats.conversion import converted
from robojoule.formats.program import Program, load_program
from robojoule.formats.vendor.trace import Beside
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.programs.tree_check import check_tree
from robojoule.robots import load_robot

HOME_DEG = (0, -90, 90, 0, 0, 0)


@pytest.fixture(scope="module")
def robot():
    return load_robot("kuka_kr16_r2010_2")


def program(*stops_deg, robot_name=None, path=None, places=None) -> Program:
    tree = tree_from_configurations("pick", np.radians([HOME_DEG, *stops_deg]), robot_name)
    return Program(tree, path, None, places or {})


def test_a_program_says_what_it_is():
    made, read = program(HOME_DEG), program(HOME_DEG, robot_name="arm", path=Path("pick.csv"))
    assert (made.name, made.robot, len(made.moves)) == ("pick", None, 1)
    assert repr(made) == "Program('pick', moves=1, robot=None, path=None)"
    assert repr(read) == "Program('pick', moves=1, robot='arm', path='pick.csv')"
    with pytest.raises(AttributeError):
        made.path = Path("other.csv")


def test_a_program_that_fits_is_accepted(robot):
    program((10, -80, 80, 0, 0, 0)).check(robot)
    program((10, -80, 80, 0, 0, 0), robot_name=robot.name).check(robot)


BAD = {
    "robot": (
        program(HOME_DEG, robot_name="ur_ur10e"),
        "robot: the tree is written for robot 'ur_ur10e', not for 'kuka_kr16_r2010_2'",
    ),
    "limit": (
        program(HOME_DEG, (0, 90, 0, 0, 0, 0), path=Path("pick.yaml")),
        "pick.yaml, operations.1.target_rad: move 'move-2': joint_2 = 1.5708 rad (90 deg) is beyond its limit; "
        "allowed: -3.22886 to 1.13446 rad (-185 to 65 deg)",
    ),
    "joints": (
        Program(tree_from_configurations("short", np.zeros((2, 5))), Path("short.csv"), None, {"start_rad": "line 2"}),
        "short.csv, line 2: the start: 5 joint positions given, but kuka_kr16_r2010_2 has 6 joints",
    ),
}


@pytest.mark.parametrize("bad, message", BAD.values(), ids=BAD.keys())
def test_a_program_that_does_not_fit_says_where(robot, bad, message):
    with pytest.raises(InputError) as caught:
        bad.check(robot)
    assert str(caught.value) == message


def test_a_tree_alone_can_be_checked(robot):
    check_tree(program(HOME_DEG).tree, robot)
    with pytest.raises(InputError, match=r"^operations\.0\.target_rad: move 'move-1': joint_2"):
        check_tree(program((0, 90, 0, 0, 0, 0)).tree, robot)


def test_what_stands_in_the_controller_is_refused_beside_a_tree(tmp_path):
    program(HOME_DEG).save(tmp_path / "pick.yaml")
    load_program(tmp_path / "pick.yaml", beside=Beside())
    with pytest.raises(InputError, match=r"pick\.yaml, beside: what stands in the controller"):
        load_program(tmp_path / "pick.yaml", beside=Beside(waits_s={3: 1.0}))


def test_data_of_another_program_are_not_replaced(tmp_path, robot):
    (tmp_path / "pick.dat").write_text("mine")
    with pytest.raises(InputError, match=r"pick\.dat: this file would go with 'pick\.src'"):
        converted(program((50, -70, 80, 0, 30, 0)), tmp_path / "pick.src", robot)
    (tmp_path / "pick.dat").unlink()
    made = converted(program((50, -70, 80, 0, 30, 0)), tmp_path / "pick.src", robot)
    assert made.files == (tmp_path / "pick.src", tmp_path / "pick.dat")
    read = load_program(made.path, robot)
    read.save(made.path)  # its own data are its own
    (tmp_path / "other.dat").write_text("mine")
    with pytest.raises(InputError, match=r"other\.dat: this file would go"):
        read.save(tmp_path / "other.src")
    assert (tmp_path / "other.dat").read_text() == "mine" and not (tmp_path / "other.src").exists()


@pytest.mark.parametrize("suffix", [".yaml", ".json", ".csv"])
def test_a_program_saves_itself_by_suffix(tmp_path, suffix):
    program(HOME_DEG).save(tmp_path / f"out{suffix}")
    assert [path.name for path in tmp_path.iterdir()] == [f"out{suffix}"]


@pytest.mark.parametrize(
    ("suffix", "name"),
    [
        (".src", "kuka_kr16_r2010_2"),
        (".mod", "kuka_kr16_r2010_2"),
        (".ls", "fanuc_m20_25_18d"),
        (".script", "ur_ur10e"),
    ],
)
def test_a_plan_in_a_vendors_language_stays_with_another_robot_object(tmp_path, suffix, name):
    first, again = load_robot(name), load_robot(name)
    path = tmp_path / f"pick{suffix}"
    converted(program((50, -70, 80, 0, 30, 0), (0, -90, 90, 0, 30, 0)), path, first)
    read = load_program(path, first)
    plan = rj.optimize(read, first, cycle_time="+40%")
    assert plan.energy_j < 0.95 * rj.simulate(read, first).energy_j
    for robot in (first, again):
        run = rj.simulate(plan.program, robot)
        assert run.cycle_time_s == pytest.approx(plan.cycle_time_s, abs=1e-9)
        assert run.energy_j == pytest.approx(plan.energy_j, rel=1e-9)
    assert plan.program.for_robot(again).tree.planned_cycle_s == plan.program.tree.planned_cycle_s
