"""Pendant angles: published poses come out, and what is wrong with a mapping is told."""

import math

import numpy as np
import pytest

from robojoule.documents import parse
from robojoule.errors import InputError, each_of
from robojoule.robots import list_robots, load_robot
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.robot import Robot
from robojoule.robots.robot_file import RobotFile
from tests.robots.arms import arm_data

# Joint angles as they are entered into an R-30iB controller of an LR Mate 200iD [deg], position of the flange from the
# crossing of the first two axes [mm], and its z axis. From a kinematic model that was checked on a real arm
# (github.com/mattj23/lrmate-200id, test_cases), rounded.
LR_MATE = [
    (
        (17.795304, 9.635297, 40.328445, 41.983987, 50.299664, 53.881649),
        (318.1159, 145.3493, 636.7796),
        (-0.04604, 0.52575, 0.84939),
    ),
    (
        (41.915946, 59.778440, 11.905550, 19.526726, 19.742309, 5.871321),
        (532.8211, 490.4791, 309.9161),
        (0.56102, 0.65539, 0.50569),
    ),
    (
        (50.136293, 38.000560, 4.239429, 47.199246, 38.880193, 50.720998),
        (384.6609, 518.1244, 358.3399),
        (0.12388, 0.86689, 0.48287),
    ),
    (
        (10.386433, 2.419961, 45.886557, 1.255360, 43.035674, 19.948038),
        (268.8093, 50.4860, 674.5629),
        (0.01592, 0.01812, 0.99971),
    ),
]
LR_MATE_SHOULDER_M = 0.330  # data sheet


def pose(robot, pendant_deg):
    """Position of the tool frame [m] and its z axis."""
    q = PendantAngles.of(robot).model_rad(np.radians(pendant_deg))
    position, (w, x, y, z) = (part[0] for part in robot.tool_placements([q]))
    return position, np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])


@pytest.mark.parametrize("pendant_deg, position_mm, z_axis", LR_MATE)
def test_published_poses_of_a_fanuc(pendant_deg, position_mm, z_axis):
    position, axis = pose(load_robot("fanuc_lrmate200id"), pendant_deg)
    expected = np.array(position_mm) / 1e3 + [0.0, 0.0, LR_MATE_SHOULDER_M]
    np.testing.assert_allclose(position, expected, atol=2e-4)
    np.testing.assert_allclose(axis, z_axis, atol=2e-4)


@pytest.mark.parametrize("name", [name for name in list_robots() if name.startswith("fanuc")])
@pytest.mark.parametrize("j2_deg", [-30.0, 0.0, 45.0])
def test_j3_of_a_fanuc_is_the_angle_against_the_floor(name, j2_deg):
    """At J3 = 0 the forearm is level, at 30 it points up by 30 degrees, whatever J2 is (FANUC's pendant)."""
    robot = load_robot(name)
    for j3_deg in (0.0, 30.0):
        _, axis = pose(robot, [0.0, j2_deg, j3_deg, 0.0, 0.0, 0.0])
        np.testing.assert_allclose(
            axis, [math.cos(math.radians(j3_deg)), 0.0, math.sin(math.radians(j3_deg))], atol=1e-9
        )


@pytest.mark.parametrize("name", [name for name in list_robots() if name.startswith("kuka")])
def test_zero_and_senses_of_a_kuka(name):
    """At zeros the arm lies level along x; A2, A3 and A5 turn it down; A1, A4 and A6 turn about -z, -x and -x.

    As KUKA's controllers count, and the description of the KR 6 R700 of ROS-Industrial (signs -1, 1, 1, -1, 1, -1). So
    A2 = -90, A3 = 90 has the upper arm upright and the forearm level.
    """
    robot = load_robot(name)
    zero, axis = pose(robot, [0.0] * 6)
    np.testing.assert_allclose(axis, [1, 0, 0], atol=1e-9)
    upright, axis = pose(robot, [0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(axis, [1, 0, 0], atol=1e-9)
    assert upright[2] > zero[2]
    _, axis = pose(robot, [0.0, 0.0, 90.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(axis, [0, 0, -1], atol=1e-9)
    _, axis = pose(robot, [90.0, -90.0, 90.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(axis, [0, -1, 0], atol=1e-9)
    _, axis = pose(robot, [0.0, -90.0, 90.0, 90.0, 90.0, 0.0])
    np.testing.assert_allclose(axis, [0, -1, 0], atol=1e-9)


def test_the_reference_robot_reaches_what_its_data_sheet_says():
    """KUKA KR 16 R2010: 2013 mm to the crossing of the wrist axes, with A2 and A3 such that both arms are in line."""
    robot = load_robot("kuka_kr16_r2010_2")
    wrist = [mechanism_wrist(robot, [0.0, 0.0, a3]) for a3 in np.linspace(-30.0, 30.0, 6001)]
    assert max(wrist) == pytest.approx(2.013, abs=1e-3)


def mechanism_wrist(robot, main_deg):
    """Distance of the wrist's centre from the vertical axis. [m]"""
    q = PendantAngles.of(robot).model_rad(np.radians([*main_deg, 0.0, 0.0, 0.0]))
    _, origins = robot.mechanism.body_placements(q[None])
    return float(np.hypot(*origins[5, :2, 0]))


@pytest.mark.parametrize("name", list_robots())
def test_there_and_back(name):
    robot = load_robot(name)
    mapping = PendantAngles.of(robot)
    q = np.random.default_rng(0).uniform(-2, 2, (5, 6))
    np.testing.assert_allclose(mapping.model_rad(mapping.pendant_rad(q)), q, atol=1e-12)


def mapped(**joints):
    return Robot(parse(RobotFile, {**arm_data(3), "pendant": {"note": "test", "joints": joints}}, "arm.json"))


def test_sense_zero_and_sums():
    """model = zero + sense (pendant + added ones), by hand."""
    robot = mapped(joint_2={"sense": -1, "zero_deg": 90}, joint_3={"add": ["joint_1", "joint_2"]})
    found = PendantAngles.of(robot).model_rad(np.radians([10, 20, 30]))
    np.testing.assert_allclose(np.degrees(found), [10, 90 - 20, 30 + 10 + 20])


def test_mistakes_in_a_mapping_are_told():
    with pytest.raises(InputError) as caught:
        mapped(joint_2={"add": ["joint_3"]}, elbow={}, joint_3={"add": ["wrist"]})
    problems = {error.problem for error in each_of(caught.value)}
    assert problems == {
        "'joint_2' includes a joint that is not nearer to the base",
        "there is no moving joint 'elbow'",
        "there is no moving joint 'wrist'",
    }


def test_a_robot_without_a_mapping_takes_no_pendant_angles():
    with pytest.raises(
        InputError, match="does not say how its pendant counts; allowed: angles of the model, or the key"
    ):
        PendantAngles.of(Robot(parse(RobotFile, arm_data(2), "arm.json")))
