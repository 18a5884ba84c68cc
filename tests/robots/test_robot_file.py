import math

import numpy as np
import pytest

from robojoule.cli import main
from robojoule.documents import parse, write_document
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot, load_robot_file
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.robot_file import RobotFile
from tests.robots.arms import arm_data, arm_file


def broken(change, joints=2):
    data = arm_data(joints)
    change(data)
    return data


def set_key(*path, value):
    def change(data):
        for key in path[:-1]:
            data = data[key]
        data[path[-1]] = value

    return change


def drop_key(*path):
    def change(data):
        for key in path[:-1]:
            data = data[key]
        del data[path[-1]]

    return change


# id: change, words of the message
FAULTS = {
    "zero-effort": (set_key("joints", 1, "effort_nm", value=0), ("'joint_2'", "effort_nm", "above 0")),
    "negative-velocity": (set_key("joints", 0, "velocity_rad_s", value=-1), ("'joint_1'", "velocity_rad_s", "above 0")),
    "joint-type": (set_key("joints", 1, "type", value="prismatic"), ("'joint_2'", "'prismatic'", "revolute, fixed")),
    "no-effort": (drop_key("joints", 1, "effort_nm"), ("'joint_2'", "effort_nm")),
    "crossed-limits": (set_key("joints", 0, "lower_rad", value=3.0), ("'joint_1'", "below upper_rad")),
    "zero-axis": (set_key("joints", 0, "axis", value=[0, 0, 0]), ("'joint_1'", "axis")),
    "same-names": (set_key("joints", 1, "name", value="joint_1"), ("unique",)),
    "unknown-parent": (set_key("joints", 1, "parent", value="rod_9"), ("'joint_2'", "'rod_9'")),
    "unknown-root": (set_key("root_link", value="floor"), ("root_link", "'floor'", "base, rod_1, rod_2")),
    "unknown-tool-parent": (set_key("tool", "parent", value="hand"), ("tool.parent", "'hand'", "base, rod_1, rod_2")),
    "unknown-capsule-link": (set_key("capsules", value={"hand": []}), ("capsules", "'hand'")),
    "unknown-lumped-link": (set_key("lumped_links", value={"hand": "rod_1"}), ("lumped_links", "'hand'")),
    "drive-missing": (drop_key("drives", "joints", "joint_2"), ("drives.joints", "joint_1, joint_2")),
    "home-count": (set_key("home_rad", value=[0.0]), ("home_rad", "2 values")),
    "home-beyond-limit": (
        set_key("home_rad", value=[0.0, 3.0]),
        ("arm.yaml, home_rad: 'joint_2' is at 3 rad, beyond its limits; allowed: -2.5 to 2.5 rad",),
    ),
    "not-serial": (set_key("joints", 1, "parent", value="base"), ("'joint_2'", "serial")),
    "unknown-key": (set_key("joints", 0, "damping", value=1.0), ("damping", "unknown key")),
    "nan": (set_key("joints", 0, "upper_rad", value=math.nan), ("upper_rad",)),
    "negative-mass": (set_key("links", "rod_1", "mass_kg", value=-1), ("links.rod_1", "mass_kg")),
    "provenance-group": (
        set_key("provenance", value={"colour": {"kind": "published", "note": "x"}}),
        ("provenance", "colour"),
    ),
}


@pytest.mark.parametrize("case", FAULTS)
def test_bad_robot_file_gives_one_clear_sentence(tmp_path, case):
    change, words = FAULTS[case]
    path = tmp_path / "arm.yaml"
    write_document(path, broken(change))
    with pytest.raises(InputError) as caught:
        load_robot_file(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    for word in words:
        assert word in message, message


NO_INERTIA = {"ixx": 0.0, "ixy": 0.0, "ixz": 0.0, "iyy": 0.0, "iyz": 0.0, "izz": 0.0}
BODY_FAULTS = {
    "no-inertia": (set_key("links", "rod_2", value=None), "links.rod_2: joint 'joint_2' moves the link 'rod_2', which"),
    "massless": (
        set_key("links", "rod_2", value={"mass_kg": 0.0, "com_m": [0, 0, 0], "inertia_kg_m2": NO_INERTIA}),
        "links.rod_2: joint 'joint_2' moves the link 'rod_2', which has no mass (0 kg)",
    ),
    "not-positive-definite": (
        set_key("links", "rod_1", "inertia_kg_m2", value=NO_INERTIA | {"izz": 1.0}),
        "links.rod_1: joint 'joint_1' moves the link 'rod_1', whose inertia is not positive definite",
    ),
    "lumped-outwards": (
        set_key("lumped_links", value={"rod_1": "rod_2"}),
        "lumped_links.rod_1: 'rod_1' cannot be lumped into 'rod_2'",
    ),
}


@pytest.mark.parametrize("change, message", BODY_FAULTS.values(), ids=BODY_FAULTS)
def test_unusable_bodies_are_told_with_file_and_key_on_the_command_line(tmp_path, monkeypatch, capsys, change, message):
    monkeypatch.chdir(tmp_path)
    path = "arm.json"
    write_document(path, broken(change))
    assert main(["profile", "--robot", path, "--from", "0,0", "--to", "9,9"]) == 2
    shown = capsys.readouterr().err
    assert shown.startswith(f"robojoule profile: {path}, {message}")
    assert shown.count("\n") == 1


def test_no_robot_carries_more_than_it_is_rated_for():
    assert Robot(arm_file(), Payload(1.0)).payload.mass_kg == 1.0
    with pytest.raises(
        InputError, match=r"^a payload of 1\.01 kg is more than arm_2 is rated for; allowed: 0 to 1 kg$"
    ):
        Robot(arm_file(), Payload(1.01))


def test_sizes_of_an_arm():
    file = arm_file(3)
    # joint 3 stands 0.4 m behind joint 2, the tool 0.32 m behind joint 3
    assert file.reach_m == pytest.approx(0.72)
    assert arm_file(1).reach_m == pytest.approx(0.5)
    assert file.total_mass_kg == pytest.approx(4.0 + 3.2 + 2.56)
    assert file.installed_power_w == pytest.approx(3 * 150 * 3)


@pytest.mark.parametrize("joints", [1, 2, 7])
def test_arm_of_any_length_end_to_end(tmp_path, joints):
    path = tmp_path / "arm.json"
    write_document(path, arm_data(joints))
    robot = load_robot(path, Payload(1.0))
    start, end = np.full(joints, -0.5), np.full(joints, 0.7)
    runs = MotionPaths(robot, start, end).simulate(np.linspace(0.1, 1.0, 10))
    assert robot.joint_count == joints
    steps = np.diff(runs.duration_s[0])
    assert steps[0] < 0 and np.all(steps <= 0)
    assert runs.peak_torque_ratio.max() <= 1.0
    assert np.all(runs.energy_j > 0)


def test_one_vertical_joint_lifts_nothing_and_rubs_as_stated():
    """Friction work over 2 rad lies between Coulomb alone and Coulomb + viscous at the peak speed."""
    runs = MotionPaths(Robot(arm_file(1)), [-1.0], [1.0]).simulate([0.2])
    assert 2.0 * 2.0 < runs.friction_j[0, 0] < (2.0 + 4.0 * 0.6) * 2.0
    assert runs.potential_j[0, 0] == pytest.approx(0.0, abs=1e-9)


def test_frozen():
    with pytest.raises(ValueError):
        arm_file().name = "other"


def test_parse_keeps_what_was_written():
    file = arm_file(2)
    assert parse(RobotFile, file.model_dump(mode="json"), "again") == file
