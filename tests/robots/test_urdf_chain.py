"""Frozen joints and branches: where links end up, against forward kinematics by hand."""

import math

import numpy as np
import pytest

from robojoule.documents import write_document
from robojoule.errors import InputError, each_of
from robojoule.robots import load_robot
from robojoule.robots.rigid_body import Placement
from robojoule.robots.urdf_chain import chain_of
from robojoule.robots.urdf_elements import UrdfJoint
from tests.robots.test_urdf import DRIVES, TWO_JOINTS

JAWS = """
  <link name="left"><inertial><mass value="0.2"/><origin xyz="0 0.01 0"/>
    <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
  <link name="right"/>
  <joint name="slide" type="prismatic"><parent link="hand"/><child link="left"/><axis xyz="0 1 0"/>
    <limit lower="0.01" upper="0.05" effort="30" velocity="0.1"/></joint>
  <joint name="follow" type="prismatic"><parent link="hand"/><child link="right"/><axis xyz="0 -1 0"/>
    <mimic joint="slide" multiplier="2" offset="0.001"/></joint>
</robot>"""


def arm_with_jaws(folder, **drives):
    (folder / "arm.urdf").write_text(TWO_JOINTS.replace("</robot>", JAWS))
    write_document(folder / "arm.drives.yaml", {**DRIVES, **drives})
    return folder / "arm.urdf"


def test_jaws_behind_the_flange_are_lumped_and_told(tmp_path):
    """They stand at the limit next to zero, their mass is in the forearm."""
    robot = load_robot(arm_with_jaws(tmp_path))
    assert robot.joint_names == ("shoulder", "elbow")
    assert robot.mechanism.bodies[1].mass_kg == pytest.approx(2.0 + 0.5 + 0.2)
    assert robot.file.lumped_branches == {"slide": 0.01, "follow": 0.0}
    assert [doubt.key for doubt in robot.doubts][:2] == ["freeze.slide", "freeze.follow"]


def test_frozen_joints_and_their_followers(tmp_path):
    robot = load_robot(arm_with_jaws(tmp_path, freeze={"slide": 0.02}))
    assert robot.file.lumped_branches == {}
    places = {link: robot.mechanism.anchors[link][1].origin_m for link in ("hand", "left", "right")}
    np.testing.assert_allclose(places["left"] - places["hand"], [0, 0.02, 0], atol=1e-12)
    np.testing.assert_allclose(places["right"] - places["hand"], [0, -(2 * 0.02 + 0.001), 0], atol=1e-12)


def test_a_frozen_turning_joint_is_turned(tmp_path):
    """The elbow held at an angle: the hand is where the two-joint arm has it at that angle."""
    (tmp_path / "arm.urdf").write_text(TWO_JOINTS)
    write_document(tmp_path / "arm.drives.yaml", DRIVES)
    whole = load_robot(tmp_path / "arm.urdf")
    joints = {"joints": {"shoulder": DRIVES["drives"]["joints"]["shoulder"]}}
    frozen = {"freeze": {"elbow": 0.7}, "home_rad": [0.0], "limits": {}, "drives": {**DRIVES["drives"], **joints}}
    write_document(tmp_path / "other.yaml", DRIVES | frozen)
    held = load_robot(tmp_path / "arm.urdf", drives=tmp_path / "other.yaml")
    assert held.joint_count == 1
    for q in (-1.0, 0.4):
        for found, expected in zip(held.tool_placements([q]), whole.tool_placements([q, 0.7]), strict=True):
            np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0.6, 0, -0.8)])
@pytest.mark.parametrize("angle", [0.3, math.pi / 2, -2.9])
def test_a_held_joint_has_the_placement_of_its_angle(axis, angle):
    """Against the turn of a vector by Rodrigues' formula."""
    joint = UrdfJoint("j", "revolute", "a", "b", (0.1, 0.2, 0.3), (0.4, -0.5, 0.6), axis, {})
    chain = chain_of([joint], "b", {"j": angle}, (), "arm.urdf", "{}")
    (held,) = chain.joints
    point, unit = np.array([0.7, -0.2, 0.5]), np.array(axis) / np.linalg.norm(axis)
    turned = (
        point * math.cos(angle)
        + np.cross(unit, point) * math.sin(angle)
        + unit * (unit @ point) * (1 - math.cos(angle))
    )
    found = Placement.of(held.xyz_m, held.rpy_rad).at(point)
    np.testing.assert_allclose(found, Placement.of(joint.xyz_m, joint.rpy_rad).at(turned), atol=1e-12)


def joint(name, parent, child, kind="revolute", mimics=None):
    return UrdfJoint(name, kind, parent, child, (0, 0, 0), (0, 0, 0), (0, 0, 1), {}, mimics)


ARM = [joint("j1", "base", "l1"), joint("j2", "l1", "l2")]
# joints beside the arm, joints that are refused, joints that are lumped
BRANCHES = {
    "wheel of the base": ([joint("wheel", "base", "w")], [], ["wheel"]),
    "finger": ([joint("finger", "l2", "f"), joint("tip", "f", "t")], [], ["finger", "tip"]),
    "counterweight": ([joint("weight", "l1", "w")], ["weight"], []),
}


@pytest.mark.parametrize("kind", BRANCHES)
def test_branches(kind):
    beside, refused, lumped = BRANCHES[kind]
    chain = chain_of([*beside, *ARM], "l2", {}, ("j1", "j2"), "arm.urdf", "freeze.{} in x.yaml")
    assert [error.key for error in chain.errors] == [f"joint '{name}'" for name in refused]
    assert all(f"freeze.{name} in x.yaml" in str(e) for name, e in zip(refused, chain.errors, strict=True))
    assert list(chain.lumped) == lumped
    assert [one.name for one in chain.joints if one.kind != "fixed"] == ["j1", "j2"]


@pytest.mark.parametrize("kind", ["prismatic", "floating", "planar"])
def test_other_joints_of_the_arm_are_refused_unless_frozen(kind):
    joints = [joint("lift", "base", "l0", kind), joint("j1", "l0", "l1")]
    (error,) = chain_of(joints, "l1", {}, (), "arm.urdf", "freeze.{}").errors
    assert f"the joint type '{kind}' is not supported" in str(error)
    assert "freeze.lift" in str(error)
    assert not chain_of(joints, "l1", {"lift": 0.0}, (), "arm.urdf", "freeze.{}").errors


def test_followers_in_the_arm_are_refused():
    joints = [joint("j1", "base", "l1"), joint("j2", "l1", "l2", mimics=("j1", 1.0, 0.0))]
    (error,) = chain_of(joints, "l2", {}, (), "arm.urdf", "freeze.{}").errors
    assert "it follows 'j1'" in str(error)


def test_unknown_names_are_told_all_at_once(tmp_path):
    path = arm_with_jaws(tmp_path, freeze={"slid": 0.0}, links={"rigth": ZERO_LINK}, limits={"knee": {}})
    with pytest.raises(InputError) as caught:
        load_robot(path)
    found = [(error.key, error.problem) for error in each_of(caught.value)]
    assert found == [
        ("limits", "there is no joint 'knee'"),
        ("freeze", "there is no joint 'slid'"),
        ("links", "there is no link 'rigth'"),
    ]


ZERO_LINK = {
    "mass_kg": 0.0,
    "com_m": [0.0, 0.0, 0.0],
    "inertia_kg_m2": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 0.0),
}
