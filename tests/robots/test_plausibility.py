"""What is doubted about robots, and that nothing is about the catalog's."""

import pytest

from robojoule.documents import parse
from robojoule.errors import InputError
from robojoule.robots import list_robots, load_robot, load_robot_file
from robojoule.robots.robot import Robot
from robojoule.robots.robot_file import RobotFile
from tests.robots.arms import arm_data

EXAMPLE_DRIVE = {
    "gear_ratio": 100,
    "rotor_inertia_kg_m2": 1e-4,
    "coulomb_nm": 5,
    "viscous_nm_s_per_rad": 8,
    "copper_w_per_nm2": 5,
}


def plain_arm():
    """An arm of three joints that nothing is doubted about."""
    data = arm_data(3)
    for joint, effort in zip(data["joints"], (120.0, 80.0, 40.0), strict=True):
        joint["effort_nm"] = effort
    return data


def doubts(data):
    return [str(doubt) for doubt in Robot(parse(RobotFile, data, "arm"), None, "arm.json").doubts]


def scaled(data, factor, *keys):
    """Figures of all links times a factor."""
    for link in filter(None, data["links"].values()):
        for key in keys:
            value = link[key]
            if isinstance(value, dict):
                link[key] = {name: factor * entry for name, entry in value.items()}
            else:
                link[key] = [factor * entry for entry in value] if isinstance(value, list) else factor * value
    return data


def with_joints(data, **figures):
    for joint in data["joints"]:
        joint |= figures
    return data


def with_drives(data, **figures):
    data["drives"]["joints"] = {name: {**drive, **figures} for name, drive in data["drives"]["joints"].items()}
    return data


def test_a_plain_arm_raises_no_doubt():
    assert doubts(plain_arm()) == []


@pytest.mark.parametrize("name", list_robots())
def test_nothing_is_doubted_about_the_catalog(name):
    assert load_robot(name).doubts == ()


# what is changed, and the words of the only or first doubt: what it is and the key that mends it
KINDS = {
    "CAD density": (lambda d: scaled(d, 6, "mass_kg", "inertia_kg_m2"), "6.8 times|rated payload|links.rod_1.mass_kg"),
    "too light": (lambda d: scaled(d, 0.1, "mass_kg", "inertia_kg_m2"), "times|rated payload|links.rod_1.mass_kg"),
    "inertia in g m2": (lambda d: scaled(d, 1e3, "inertia_kg_m2"), "kg mm2|links.rod_1.inertia_kg_m2"),
    "inertia in t m2": (lambda d: scaled(d, 1e-5, "inertia_kg_m2"), "denser than tungsten|links.rod_1.inertia_kg_m2"),
    "centres in mm": (lambda d: scaled(d, 1e3, "com_m"), "in mm|links.rod_1.com_m"),
    "limits in degrees": (lambda d: with_joints(d, upper_rad=170.0), "are these degrees|limits.joint_1.lower_rad"),
    "speeds in degrees": (lambda d: with_joints(d, velocity_rad_s=180.0), "degrees/s|limits.joint_1.velocity_rad_s"),
    "equal efforts": (lambda d: with_joints(d, effort_nm=100.0), "same effort limit, 100 Nm|limits.joint_1.effort_nm"),
    "weak": (lambda d: with_joints(d, effort_nm=4.0, peak_effort_nm=5.0), "gravity needs up to|limits.joint_2"),
    "placeholder": (lambda d: with_joints(d, effort_nm=1e5), "same effort limit|limits.joint_1"),
    "friction": (lambda d: with_drives(d, coulomb_nm=40.0), "friction takes 130 %|drives.joints.joint_3.coulomb_nm"),
    "copper": (lambda d: with_drives(d, copper_w_per_nm2=1e5), "standing still|drives.joints.joint_2.copper_w_per_nm2"),
    "base": (lambda d: d | {"drives": d["drives"] | {"base_power_w": 3e4}}, "up to 30 kW|drives.base_power_w"),
    "branch": (lambda d: d | {"lumped_branches": {"jaw": 0.02}}, "'jaw' is not between|held at 0.02|freeze.jaw"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_doubted(kind):
    change, words = KINDS[kind]
    found = doubts(change(plain_arm()))
    assert any(all(word in one for word in words.split("|")) for one in found), found


def test_masses_in_grams_and_origins_in_millimetres():
    with pytest.raises(InputError, match=r"arm\.json, links\.rod_1\.mass_kg: .*; allowed: masses in kg, not in g"):
        doubts(scaled(plain_arm(), 1e3, "mass_kg", "inertia_kg_m2"))
    data = plain_arm()
    for joint in data["joints"]:
        joint["origin_xyz_m"] = [1e3 * value for value in joint["origin_xyz_m"]]
    assert any("are the origins of the joints in mm" in one for one in doubts(data))


def test_a_trunk_without_reach_is_no_reason_to_doubt():
    """Its axes meet in the tool's frame: the reach says nothing about the size of its links."""
    data = plain_arm()
    data["tool"]["parent"] = data["joints"][1]["parent"]
    data["joints"], data["home_rad"] = data["joints"][:2], data["home_rad"][:2]
    data["tool"]["parent"], data["tool"]["origin_xyz_m"] = data["joints"][1]["child"], [0.0, 0.0, 0.0]
    data["links"] = {name: data["links"][name] for name in ("base", "rod_1", "rod_2")}
    data["drives"]["joints"] = {joint["name"]: EXAMPLE_DRIVE for joint in data["joints"]}
    arm = parse(RobotFile, data, "arm")
    assert arm.reach_m == 0.0
    assert not [one for one in doubts(data) if "radius of gyration" in one or "in mm" in one]


def test_limits_that_no_joint_comes_near_are_placeholders():
    data = plain_arm()
    for joint in data["joints"]:
        joint["effort_nm"] *= 1e3
    assert any("seem to be placeholders" in one for one in doubts(data))


def test_small_drives_on_a_large_arm_are_doubted():
    """The drives of the manual's example under a KR210 would draw kilowatts to stand still."""
    data = load_robot_file("kuka_kr210_r2700_2").model_dump()
    (doubt,) = doubts(with_drives(data, **EXAMPLE_DRIVE))
    assert "standing still takes up to" in doubt
    assert "kW" in doubt
