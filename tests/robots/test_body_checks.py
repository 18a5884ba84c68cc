import pytest

from robojoule.documents import parse
from robojoule.errors import InputError
from robojoule.robots import load_robot
from robojoule.robots.robot import Robot
from robojoule.robots.robot_file import RobotFile
from tests.robots.arms import DRIVE, arm_data

NOTHING = {
    "mass_kg": 1e-6,
    "com_m": [0, 0, 0],
    "inertia_kg_m2": {"ixx": 0, "ixy": 0, "ixz": 0, "iyy": 0, "iyz": 0, "izz": 0},
}


def robot_of(data):
    return Robot(parse(RobotFile, data, "arm"))


def with_flange(data, figures):
    """Fix one more link to the last rod."""
    data["links"]["flange"] = figures
    data["joints"].append(
        {
            "name": "to_flange",
            "type": "fixed",
            "parent": "rod_2",
            "child": "flange",
            "origin_xyz_m": [0.1, 0, 0],
            "origin_rpy_rad": [0, 0, 0],
            "axis": [1, 0, 0],
        }
    )
    return data


def test_missing_inertia():
    data = arm_data()
    data["links"]["rod_2"] = None
    with pytest.raises(
        InputError, match=r"links\.rod_2: joint 'joint_2' moves the link 'rod_2', which has no inertial"
    ):
        robot_of(data)


def test_missing_inertia_of_several_links():
    data = with_flange(arm_data(), None)
    data["links"]["rod_2"] = None
    with pytest.raises(InputError, match="'rod_2', 'flange', none of which has inertial figures"):
        robot_of(data)


def test_massless_body():
    data = arm_data()
    data["links"]["rod_2"] = NOTHING
    with pytest.raises(InputError, match=r"'joint_2' moves the link 'rod_2', which has no mass.*lumped_links"):
        robot_of(data)


@pytest.mark.parametrize("moments", [(0.0, 0.0, 1.5), (-0.1, 0.5, 0.5), (0.0, 0.0, 0.0)])
def test_inertia_that_is_not_positive_definite(moments):
    data = arm_data()
    tensor = data["links"]["rod_1"]["inertia_kg_m2"]
    tensor["ixx"], tensor["iyy"], tensor["izz"] = moments
    with pytest.raises(InputError, match=r"links\.rod_1.*'rod_1'.*not positive definite"):
        robot_of(data)


def test_the_whole_body_counts_not_each_link():
    """A flange without figures, or with none worth the name, is fine where the link before it has some."""
    assert robot_of(with_flange(arm_data(), None)).joint_count == 2
    assert robot_of(with_flange(arm_data(), NOTHING)).joint_count == 2
    data = with_flange(arm_data(), arm_data()["links"]["rod_2"])
    data["links"]["rod_2"] = None
    assert robot_of(data).mechanism.bodies[1].mass_kg == pytest.approx(3.2)


def test_lumped_links_are_let_through_and_must_have_gone_somewhere():
    data = arm_data()
    data["links"]["rod_2"] = NOTHING
    data["lumped_links"] = {"rod_2": "rod_1"}
    assert robot_of(data).joint_count == 2
    data["lumped_links"] = {"rod_2": "base"}
    with pytest.raises(InputError, match=r"lumped_links\.rod_2: 'rod_2' cannot be lumped into 'base'"):
        robot_of(data)
    data["lumped_links"] = {"rod_2": "rod_2"}
    with pytest.raises(InputError, match="nearer to the base"):
        robot_of(data)


def test_lumped_body_needs_a_rotor():
    data = arm_data()
    data["links"]["rod_2"] = NOTHING
    data["lumped_links"] = {"rod_2": "rod_1"}
    data["drives"]["joints"]["joint_2"] = {**DRIVE, "rotor_inertia_kg_m2": 0.0}
    with pytest.raises(InputError, match=r"drives\.joints\.joint_2\.rotor_inertia_kg_m2.*rotor inertia above 0"):
        robot_of(data)


def test_joints_that_hang_nowhere():
    data = with_flange(arm_data(), None)
    data["links"]["island"] = None
    data["joints"][-1]["parent"] = "island"
    with pytest.raises(InputError, match="joint 'to_flange' is attached to link 'island'"):
        robot_of(data)


def test_tool_on_a_link_that_hangs_on_nothing():
    data = arm_data()
    data["links"]["island"] = None
    data["tool"]["parent"] = "island"
    with pytest.raises(InputError, match=r"tool\.parent: the tool's parent 'island'"):
        robot_of(data)


def test_reference_robot_says_that_its_wrist_is_lumped():
    file = load_robot("kuka_kr16_r2010_2").file
    assert file.lumped_links == {"link_5": "link_4", "link_6": "link_4"}
