import numpy as np
import pytest

from robojoule.documents import write_document
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import list_robots, load_robot, load_robot_file
from robojoule.robots.robot import Payload
from robojoule.robots.robot_file import RobotFile
from robojoule.robots.urdf import load_urdf, write_urdf
from tests.robots.arms import CONTROLLER, DRIVE, arm_file

TWO_JOINTS = """<?xml version="1.0"?>
<robot name="two">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <joint name="elbow" type="continuous">
    <origin xyz="0.4 0 0" rpy="0 0.3 0"/><parent link="upper"/><child link="fore"/><axis xyz="0 1 0"/>
    <limit velocity="4" effort="60"/>
  </joint>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 0.5"/><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="120"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0.3 0 0"/></joint>
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0" rpy="0.4 -0.2 1.1"/><mass value="4"/>
    <inertia ixx="0.01" ixy="0.002" ixz="0" iyy="0.06" iyz="0" izz="0.07"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.15 0 0"/><mass value="2"/>
    <inertia ixx="0.003" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <link name="hand"><inertial><mass value="0.5"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
</robot>
"""
DRIVES = {
    "rated_payload_kg": 2.0,
    "home_rad": [0.0, 0.5],
    "tool": {"parent": "hand", "origin_xyz_m": [0, 0, 0], "origin_rpy_rad": [0, 1.5708, 0]},
    "limits": {"elbow": {"lower_rad": -6.28, "upper_rad": 6.28}},
    "drives": {**CONTROLLER, "joints": {"shoulder": DRIVE, "elbow": DRIVE}},
}


@pytest.fixture
def two(tmp_path):
    """Path of a URDF with its drive file beside it."""
    path = tmp_path / "two.urdf"
    path.write_text(TWO_JOINTS)
    write_document(tmp_path / "two.drives.yaml", DRIVES)
    return path


@pytest.mark.parametrize("name", list_robots())
def test_written_and_read_back_is_the_same(tmp_path, name):
    file = load_robot_file(name)
    write_urdf(file, tmp_path / "arm.urdf")
    assert load_robot_file(tmp_path / "arm.urdf") == file


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "was, becomes, said",
    [
        ('mass value="4"', 'mass value="1e308"', "mass: 1e+308 is beyond all bounds"),
        ('ixy="0.002"', 'ixy="-1e308"', "ixy: -1e+308 is beyond all bounds"),
        ('xyz="0.4 0 0"', 'xyz="0.4 1e200 0"', "xyz: 1e+200 is beyond all bounds"),
        ('velocity="3"', 'velocity="1e308"', "limit velocity: 1e+308 is beyond all bounds"),
    ],
)
def test_figures_beyond_all_bounds_are_refused(two, was, becomes, said):
    assert was in TWO_JOINTS
    two.write_text(TWO_JOINTS.replace(was, becomes))
    with pytest.raises(InputError) as caught:
        load_robot(two)
    assert said in str(caught.value)


def test_a_joint_without_a_bound_may_be_written_with_a_large_one(two):
    two.write_text(TWO_JOINTS.replace('lower="-2" upper="2"', 'lower="-1e16" upper="1e16"'))
    assert load_robot(two).upper_rad[0] == 1e16


def test_what_was_learnt_of_a_robot_is_written_too(tmp_path):
    """Timing, standby modes, and whose programs it takes."""
    data = load_robot_file("kuka_kr16_r2010_2").model_dump(mode="json")
    timing = {"rule": "torque_limited", "provenance": "identified", "filter_time_s": 0.05}
    timing["joints"] = {joint["name"]: {"velocity_rad_s": 2.0} for joint in data["joints"] if joint["type"] != "fixed"}
    standby = {"brakes": {"power_w": 160.0, "least_idle_s": 2.0}}
    file = RobotFile.model_validate(
        data | {"name": "mine", "derived_from": data["name"], "standby": standby, "controller": timing}
    )
    write_urdf(file, tmp_path / "mine.urdf")
    assert load_robot_file(tmp_path / "mine.urdf") == file
    assert load_robot(tmp_path / "mine.urdf").standby[0].power_w == 160.0


@pytest.mark.parametrize("name", ["kuka_kr16_r2010_2", "fanuc_m20_25_18d", "ur_ur10e"])
def test_inverse_dynamics_against_pinocchios_own_reader(tmp_path, name):
    pin = pytest.importorskip("pinocchio")
    path = tmp_path / "arm.urdf"
    write_urdf(load_robot_file(name), path)
    assert_same_dynamics(load_robot(path), pin.buildModelFromXML(path.read_text()))


def test_turned_inertia_axes_against_pinocchios_own_reader(two):
    assert_same_dynamics(load_robot(two), _revolute(TWO_JOINTS))


def _revolute(text):
    """Pinocchio counts a continuous joint in two coordinates; the dynamics do not know the difference."""
    pin = pytest.importorskip("pinocchio")
    limited = text.replace('type="continuous"', 'type="revolute"')
    return pin.buildModelFromXML(limited.replace('<limit velocity="4"', '<limit lower="-6" upper="6" velocity="4"'))


def assert_same_dynamics(robot, other):
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(0)
    data, other_data = robot.model.createData(), other.createData()
    for _ in range(20):
        q, qd, qdd = rng.uniform(-2, 2, (3, robot.joint_count))
        found = pin.rnea(robot.model, data, q, qd, qdd)
        expected = pin.rnea(other, other_data, q, qd, qdd)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * max(1.0, np.abs(expected).max()))


def test_two_joint_urdf_end_to_end(two):
    robot = load_robot(two, Payload(1.0))
    assert robot.joint_names == ("shoulder", "elbow")
    assert robot.effort_nm.tolist() == [120.0, 60.0]
    assert robot.upper_rad.tolist() == [2.0, 6.28]
    runs = MotionPaths(robot, [-1.0, -1.0], [0.2, 1.5]).simulate(np.linspace(0.1, 1.0, 10))
    assert runs.peak_torque_ratio.max() <= 1.0
    assert 0 < int(np.argmin(runs.energy_j)) < 9


def test_seven_joint_urdf_end_to_end(tmp_path):
    write_urdf(arm_file(7), tmp_path / "arm.urdf")
    robot = load_robot(tmp_path / "arm.urdf", Payload(0.5))
    runs = MotionPaths(robot, np.full(7, -0.3), np.full(7, 0.4)).simulate([0.1, 0.5, 1.0])
    assert robot.joint_count == 7
    assert runs.peak_torque_ratio.max() <= 1.0


def test_drive_file_named_explicitly(two, tmp_path):
    other = tmp_path / "strong.json"
    write_document(
        other, DRIVES | {"name": "strong", "limits": {"elbow": {**DRIVES["limits"]["elbow"], "effort_nm": 90}}}
    )
    robot = load_robot(two, drives=other)
    assert robot.name == "strong"
    assert robot.effort_nm.tolist() == [120.0, 90.0]


def test_drive_file_goes_with_a_urdf_only(tmp_path):
    with pytest.raises(InputError, match="goes with a URDF only"):
        load_robot("ur_ur5e", drives=tmp_path / "arm.drives.yaml")


def drives_without(key):
    return {name: value for name, value in DRIVES.items() if name != key}


# id: (text in the URDF, its replacement), drive file, words of the message
FAULTS = {
    "prismatic": (
        ('type="continuous"', 'type="prismatic"'),
        DRIVES,
        ("joint 'elbow'", "'prismatic'", "freeze.elbow in two.drives.yaml"),
    ),
    "floating": (('type="continuous"', 'type="floating"'), DRIVES, ("joint 'elbow'", "'floating'")),
    "continuous-without-limits": (
        None,
        drives_without("limits"),
        ("joint 'elbow'", "lower_rad", "limits.elbow.lower_rad in"),
    ),
    "no-velocity": (('velocity="3" ', ""), DRIVES, ("joint 'shoulder'", "velocity_rad_s")),
    "zero-effort": (('effort="120"', 'effort="0"'), DRIVES, ("joint 'shoulder'", "effort_nm", "above 0")),
    "mimic": (('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="a"/>'), DRIVES, ("mimic",)),
    "not-a-number": (('mass value="4"', 'mass value="four"'), DRIVES, ("link 'upper' mass", "'four'")),
    "not-finite": (('ixx="0.01"', 'ixx="nan"'), DRIVES, ("link 'upper' ixx", "'nan'")),
    "two-numbers": (('xyz="0.4 0 0"', 'xyz="0.4 0"'), DRIVES, ("joint 'elbow'", "xyz", "three numbers")),
    "no-mass": (('<mass value="4"/>', ""), DRIVES, ("link 'upper'", "<mass> is missing")),
    "negative-mass": (
        ('mass value="4"', 'mass value="-4"'),
        DRIVES,
        ("links.upper.mass_kg", "greater than or equal to 0"),
    ),
    "no-parent": (('<parent link="upper"/>', ""), DRIVES, ("joint 'elbow'", "<parent> is missing")),
    "unknown-link": (('<child link="fore"/>', '<child link="four"/>'), DRIVES, ("root link", "base, fore")),
    "two-roots": (
        ('<link name="base"/>', '<link name="base"/><link name="island"/>'),
        DRIVES,
        ("root links base, island",),
    ),
    "xacro": (
        ("<material", '<xacro xmlns="http://www.ros.org/wiki/xacro"/><material'),
        DRIVES,
        ("xacro", "xacro FILE"),
    ),
    "doubled-link": (
        ('<link name="base"/>', '<link name="base"/><link name="base"/>'),
        DRIVES,
        ("there are 2 links 'base'", "unique names"),
    ),
    "doubled-joint": (
        ('<joint name="mount"', '<joint name="elbow"'),
        DRIVES,
        ("there are 2 joints 'elbow'", "unique names"),
    ),
    "endless": (
        ("<material", '<joint name="x" type="fixed"><parent link="a"/><child link="b"/></joint>' * 501 + "<material"),
        DRIVES,
        ("the URDF has 504 joints", "at most 500"),
    ),
    "no-robot": (("robot", "model"), DRIVES, ("<model>", "<robot>")),
    "unbound-xacro": (("<material", '<xacro:if value="1"/><material'), DRIVES, ("xacro", "xacro FILE > arm.urdf")),
    "empty": ((TWO_JOINTS, "<robot name='two'/>"), {**DRIVES, "limits": {}}, ("tool.parent: there is no link 'hand'",)),
    "truncated": (("</robot>", ""), DRIVES, ("cannot be read",)),
    "limit-of-unknown-joint": (
        None,
        DRIVES | {"limits": {**DRIVES["limits"], "knee": {}}},
        ("two.drives.yaml", "'knee'", "elbow, shoulder"),
    ),
    "drive-file-lacks-tool": (None, drives_without("tool"), ("two.drives.yaml", "tool", "missing")),
    "drive-file-unknown-key": (None, DRIVES | {"colour": 1}, ("two.drives.yaml", "colour", "unknown key")),
    "home-too-long": (None, DRIVES | {"home_rad": [0, 0, 0]}, ("two.urdf with two.drives.yaml, home_rad:", "2 values")),
    "home-beyond-limit": (None, DRIVES | {"home_rad": [2.1, 0]}, ("home_rad: 'shoulder' is at 2.1", "-2 to 2 rad")),
}


@pytest.mark.parametrize("case", FAULTS)
def test_bad_urdf_gives_one_clear_sentence(two, case):
    change, drives, words = FAULTS[case]
    if change:
        assert change[0] in TWO_JOINTS
        two.write_text(TWO_JOINTS.replace(*change))
    write_document(two.with_suffix(".drives.yaml"), drives)
    with pytest.raises(InputError) as caught:
        load_urdf(two)
    message = str(caught.value)
    assert caught.value.file.startswith(str(two.parent))  # long messages are cut
    assert "\n" not in message
    for word in words:
        assert word in message, message


def test_missing_inertia_of_a_urdf(two, monkeypatch):
    start, end = TWO_JOINTS.index('<link name="fore">'), TWO_JOINTS.index('<link name="hand">')
    text = TWO_JOINTS[:start] + '<link name="fore"/>' + TWO_JOINTS[end:]
    hand = text[text.index('<link name="hand">') : text.index("</robot>")]
    two.write_text(text.replace(hand, '<link name="hand"/>'))
    monkeypatch.chdir(two.parent)
    with pytest.raises(InputError) as caught:
        load_robot(two.name)
    problem = "joint 'elbow' moves the links 'fore', 'hand', none of which has inertial figures"
    assert str(caught.value).startswith(f"{two.name} with two.drives.yaml, links.fore: {problem}")


def test_an_inertia_that_no_body_has(two):
    two.write_text(TWO_JOINTS.replace('iyy="0.02"', 'iyy="2.9"'))
    words = r"links\.fore: the inertia of link 'fore' is impossible: of its principal moments 0\.003, 0\.02, 2\.9 kg m2"
    with pytest.raises(InputError, match=words):
        load_robot(two)


def test_no_drive_file(tmp_path):
    (tmp_path / "two.urdf").write_text(TWO_JOINTS)
    with pytest.raises(InputError, match=r"needs a drive file.*two\.drives\.yaml beside it"):
        load_robot(tmp_path / "two.urdf")


@pytest.mark.parametrize("with_drives", [True, False])
def test_no_urdf(tmp_path, with_drives):
    if with_drives:
        write_document(tmp_path / "arm.drives.yaml", DRIVES)
    with pytest.raises(InputError, match=r"arm\.urdf: there is no such file"):
        load_robot(tmp_path / "arm.urdf")
