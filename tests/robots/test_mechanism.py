"""The mechanism of an arm: kinematics in closed form and against Pinocchio, what is merged into what."""

from dataclasses import replace

import numpy as np
import pytest

from robojoule.documents import parse
from robojoule.robots import list_robots, load_robot
from robojoule.robots.mechanism import assemble
from robojoule.robots.rigid_body import RigidBody
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.robot_file import RobotFile
from tests.core_cases import kr16
from tests.robots.arms import arm_data, arm_file, random_body, random_mechanism, rod, swinging_arm


def test_two_links_in_a_plane():
    """Textbook: x = l1 cos q1 + l2 cos(q1 + q2), y likewise with sines."""
    arm = swinging_arm(lengths_m=(0.5, 0.3), masses_kg=(2.0, 1.0), pendulum=False)
    q = np.random.default_rng(0).uniform(-3, 3, (20, 2))
    position, orientation = arm.tool_placements(q)
    first, second = q[:, 0], q.sum(axis=1)
    assert position[:, 0] == pytest.approx(0.5 * np.cos(first) + 0.3 * np.cos(second), abs=1e-14)
    assert position[:, 1] == pytest.approx(0.5 * np.sin(first) + 0.3 * np.sin(second), abs=1e-14)
    assert position[:, 2] == pytest.approx(0.0)
    half = np.abs(np.cos(second / 2))  # w >= 0
    assert orientation[:, 0] == pytest.approx(half, abs=1e-14)


@pytest.mark.parametrize("name", list_robots())
def test_tool_placements_equal_pinocchios(name):
    robot = load_robot(name, Payload(1.0))
    q = np.random.default_rng(1).uniform(robot.lower_rad, robot.upper_rad, (25, robot.joint_count))
    _assert_same_places(robot.mechanism, q)


@pytest.mark.parametrize("joints", range(1, 8))
def test_places_of_any_arm_equal_pinocchios(joints):
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(joints)
    arm = random_mechanism(rng, joints)
    q = rng.uniform(-4.0, 4.0, (25, joints))
    _assert_same_places(arm, q)
    rotations, origins = arm.body_placements(q)
    data = arm.model.createData()
    for row, configuration in enumerate(q):
        pin.forwardKinematics(arm.model, data, configuration)
        for body in range(joints + 1):
            assert rotations[body, :, :, row] == pytest.approx(data.oMi[body].rotation, abs=1e-13)
            assert origins[body, :, row] == pytest.approx(data.oMi[body].translation, abs=1e-13)


def _assert_same_places(arm, q):
    pin = pytest.importorskip("pinocchio")
    data, tool = arm.model.createData(), pin.SE3(arm.tool.rotation, arm.tool.origin_m)
    positions, orientations = arm.tool_placements(q)
    for configuration, position, (w, x, y, z) in zip(q, positions, orientations, strict=True):
        pin.forwardKinematics(arm.model, data, configuration)
        expected = data.oMi[arm.tool_body] * tool
        assert position == pytest.approx(expected.translation, abs=1e-13)
        assert pin.Quaternion(w, x, y, z).matrix() == pytest.approx(expected.rotation, abs=1e-13)
        assert w >= 0.0


def test_poses_of_the_reference_robot_are_pinocchios_to_the_bit():
    """Its joints turn about z: no rounding differs, and neither do tables of poses."""
    pin = pytest.importorskip("pinocchio")
    robot = kr16()
    q = np.random.default_rng(2).uniform(robot.lower_rad, robot.upper_rad, (50, 6))
    tool, data = pin.SE3(robot.mechanism.tool.rotation, robot.mechanism.tool.origin_m), robot.model.createData()
    positions, _ = robot.tool_placements(q)
    for configuration, position in zip(q, positions, strict=True):
        pin.forwardKinematics(robot.model, data, configuration)
        assert np.array_equal(position, (data.oMi[6] * tool).translation)


@pytest.mark.parametrize("name", ["kuka_kr16_r2010_2", "fanuc_m20_25_18d", "ur_ur10e"])
def test_bodies_are_those_that_pinocchio_puts_together(name):
    """The same links appended to a Pinocchio model one by one: equal to the bit."""
    pin = pytest.importorskip("pinocchio")
    robot = load_robot(name, Payload(2.0, (0.01, -0.02, 0.1)))
    file, model = robot.file, robot.model.copy()
    for body in range(1, model.njoints):
        model.inertias[body] = pin.Inertia.Zero()
    for link, figures in file.links.items():
        body, at = robot.mechanism.anchors[link]
        if body and figures is not None and figures.mass_kg > 0:
            i = figures.inertia_kg_m2
            tensor = np.array([[i.ixx, i.ixy, i.ixz], [i.ixy, i.iyy, i.iyz], [i.ixz, i.iyz, i.izz]])
            inertia = pin.Inertia(figures.mass_kg, np.array(figures.com_m), tensor)
            model.appendBodyToJoint(body, inertia, pin.SE3(at.rotation, at.origin_m))
    load = robot.payload.body
    tool = pin.SE3(robot.mechanism.tool.rotation, robot.mechanism.tool.origin_m)
    model.appendBodyToJoint(6, pin.Inertia(load.mass_kg, load.center_m, load.inertia_kg_m2), tool)
    for own, expected in zip(robot.mechanism.bodies, list(model.inertias)[1:], strict=True):
        assert own.mass_kg == expected.mass
        assert np.array_equal(own.center_m, expected.lever)
        assert np.array_equal(own.inertia_kg_m2, expected.inertia)


def test_a_link_behind_a_fixed_joint_belongs_to_the_body_before_it():
    """Half a rod fixed to half a rod is the rod."""
    data = arm_data(2)
    data["links"] |= {"rod_2": rod(1.6, 0.2), "rest": rod(1.6, 0.2)}
    fixed = {"name": "to_rest", "type": "fixed", "parent": "rod_2", "child": "rest", "axis": [1, 0, 0]}
    data["joints"].append(fixed | {"origin_xyz_m": [0.2, 0, 0], "origin_rpy_rad": [0, 0, 0]})
    whole = assemble(arm_file(2), "arm").bodies[1]
    halves = assemble(parse(RobotFile, data, "arm"), "arm").bodies[1]
    assert halves.mass_kg == pytest.approx(whole.mass_kg)
    assert halves.center_m == pytest.approx(whole.center_m)
    assert np.diag(halves.inertia_kg_m2)[1:] == pytest.approx(np.diag(whole.inertia_kg_m2)[1:])


def test_a_load_on_the_base_moves_with_no_joint():
    data = arm_data(2)
    data["tool"]["parent"] = "base"
    carrying = Robot(parse(RobotFile, data, "arm"), Payload(1.0))
    bare = Robot(parse(RobotFile, data, "arm"))
    for loaded, empty in zip(carrying.mechanism.bodies, bare.mechanism.bodies, strict=True):
        assert np.array_equal(loaded.parameters, empty.parameters)
    position, _ = carrying.tool_placements(np.random.default_rng(3).uniform(-2, 2, (4, 2)))
    assert position == pytest.approx(np.tile(data["tool"]["origin_xyz_m"], (4, 1)))


def test_changes_of_parameters_change_the_bodies_alone():
    rng = np.random.default_rng(4)
    arm = assemble(arm_file(3), "arm")
    extra = [random_body(rng).parameters for _ in range(3)]
    changed = arm.with_changes(np.concatenate(extra))
    for before, after, more in zip(arm.bodies, changed.bodies, extra, strict=True):
        assert after.parameters == pytest.approx(before.parameters + more, rel=1e-13)
    assert changed.placements is arm.placements
    assert np.array_equal(arm.bodies[0].parameters, assemble(arm_file(3), "arm").bodies[0].parameters)


def test_the_pinocchio_model_follows_the_mechanism():
    pytest.importorskip("pinocchio")
    robot = kr16()
    assert robot.model is robot.model  # made once
    other = robot.variant(mechanism=robot.mechanism.with_body(2, RigidBody.nothing()))
    assert other.model.inertias[2].mass == 0.0 < robot.model.inertias[2].mass
    tilted = replace(robot.mechanism, gravity_m_s2=np.array([1.0, 2.0, 3.0]))
    assert tilted.model.gravity.linear.tolist() == [1.0, 2.0, 3.0]
    assert list(tilted.model.names)[1:] == list(robot.joint_names)
