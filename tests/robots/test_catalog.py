"""Every robot of the catalog, end to end."""

from functools import cache

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots import list_robots, load_robot, load_robot_file
from robojoule.robots.anchors import load_anchors
from robojoule.robots.collision import CollisionModel, derive_capsules
from robojoule.robots.drives import idle_power_w
from robojoule.robots.robot import Payload
from robojoule.robots.robot_file import FigureGroup

PAYLOAD_SHARE = 0.6
# A turn of the base, a lean forward with the forearm kept level, and a bit of wrist, from beside HOME. [deg]
LEANING = {"KUKA": -20.0, "FANUC": 20.0, "Universal Robots": -20.0}
NAMES = list_robots()


@cache
def loaded(name):
    file = load_robot_file(name)
    return load_robot(name, Payload(PAYLOAD_SHARE * file.rated_payload_kg, (0.0, 0.0, 0.1)))


@cache
def handling(name):
    """A handling motion of moderate size, at 10 % to 100 % speed: start, end and runs."""
    robot = loaded(name)
    start = robot.home_rad + np.radians([-30, 0, 0, 0, 0, 0])
    end = start + np.radians([60, 20, LEANING[robot.vendor], 30, 30, 30])
    return start, end, MotionPaths(robot, start, end).simulate(np.linspace(0.1, 1.0, 46))


def test_the_catalog_is_complete():
    vendors = [load_robot_file(name).vendor for name in NAMES]
    assert len(NAMES) == 25
    assert {vendor: vendors.count(vendor) for vendor in set(vendors)} == {
        "KUKA": 13,
        "FANUC": 7,
        "Universal Robots": 5,
    }


@pytest.mark.parametrize("name", NAMES)
def test_profile_has_an_inside_optimum(name):
    _, _, runs = handling(name)
    duration, energy = runs.duration_s[0], runs.energy_j[0]
    best = int(np.argmin(energy))
    assert best > 0
    if name != "ur_ur3e":  # docs/robots.md: what it moves costs less than what its controller draws meanwhile
        assert energy[best] < energy[-1]
        assert duration[best] > duration[-1]
    assert energy[0] > 1.2 * energy[best]
    # falls to the optimum, then rises
    assert np.all(np.diff(energy[: best + 1]) < 1e-9)
    assert np.all(np.diff(energy[best:]) > -1e-9)


def test_the_kr210_lies_within_the_spread_of_a_measured_cell():
    """docs/robots.md: 23 energy functions measured on arms of its size; no law was made for them."""
    _, _, runs = handling("kuka_kr210_r2700_2")
    duration, energy = runs.duration_s[0], runs.energy_j[0]
    best = int(np.argmin(energy))
    assert 1.46 < duration[best] / duration[-1] < 2.46
    assert 0.06 < 1.0 - energy[best] / energy[-1] < 0.32
    assert energy[-1] / duration[-1] == pytest.approx(3200.0, rel=0.25)


@pytest.mark.parametrize("name", NAMES)
def test_turning_joint_1_changes_no_energy(name):
    """All arms stand upright: the axis of joint 1 is vertical."""
    start, end, runs = handling(name)
    turn = np.array([0.777, 0.0, 0.0, 0.0, 0.0, 0.0])
    turned = MotionPaths(loaded(name), start + turn, end + turn).simulate(np.linspace(0.1, 1.0, 46))
    assert turned.energy_j == pytest.approx(runs.energy_j, rel=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_no_torque_above_its_limit(name):
    _, _, runs = handling(name)
    assert 0.2 < runs.peak_torque_ratio.max() <= 1.0


@pytest.mark.parametrize("name", NAMES)
def test_idle_power_is_plausible_for_its_size(name):
    """docs/robots.md: idle at HOME is 0.8-1.6 times 430 W (P / 19.6 kW)^0.41 (collaborative arms: times 95 W).

    P is the installed power; counterbalanced arms, whose balancer is left out, may take up to 2 times.
    """
    pin = pytest.importorskip("pinocchio")
    robot, anchors = loaded(name), load_anchors()
    gravity = pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.home_rad)
    idle = float(idle_power_w(robot.drives, gravity))
    expected = 95.0 if name in anchors.cobots.names else 430.0 * (robot.file.installed_power_w / 19600.0) ** 0.41
    assert 0.8 * expected < idle < (2.0 if name in anchors.counterbalanced else 1.6) * expected


@pytest.mark.parametrize("name", NAMES)
def test_home_and_handling_are_free_of_collisions(name):
    robot = loaded(name)
    start, end, _ = handling(name)
    model = CollisionModel(robot)
    assert model.first_collision(robot.home_rad) is None
    assert not model.path_collides(start, end)


@pytest.mark.parametrize("name", NAMES)
def test_capsules_follow_the_rule(name):
    file = load_robot_file(name)
    assert derive_capsules(file) == file.capsules


@pytest.mark.parametrize("name", NAMES)
def test_tool_z_leaves_the_flange(name):
    """The tool frame lies ahead of the wrist centre (where the axes of joints 5 and 6 pass) along its own z."""
    pin = pytest.importorskip("pinocchio")
    robot = loaded(name)
    data = robot.model.createData()
    tool_in_joint = pin.SE3(robot.mechanism.tool.rotation, robot.mechanism.tool.origin_m)
    for q in (robot.home_rad, robot.home_rad + 0.3):
        pin.framesForwardKinematics(robot.model, data, q)
        tool = data.oMi[robot.mechanism.tool_body] * tool_in_joint
        z = tool.rotation[:, 2]
        axis = data.oMi[6].rotation @ np.array([abs(x) for x in robot.file.moving_joints[5].axis])
        assert abs(z @ axis) == pytest.approx(1.0, abs=1e-6)
        ahead = z @ (tool.translation - data.oMi[5].translation)
        assert ahead > 0.04


def test_home_is_an_upright_elbow():
    """HOME: upper arm up, forearm level, tool forward (KUKA, FANUC) or down (Universal Robots)."""
    pin = pytest.importorskip("pinocchio")
    for name in NAMES:
        robot = loaded(name)
        data = robot.model.createData()
        pin.forwardKinematics(robot.model, data, robot.home_rad)
        shoulder, elbow = data.oMi[2].translation, data.oMi[3].translation
        upper = (elbow - shoulder) / np.linalg.norm(elbow - shoulder)
        assert upper[2] > 0.94, name
        _, orientation = robot.tool_placements(robot.home_rad[None])
        w, x, y, z = orientation[0]
        down = pin.Quaternion(w, x, y, z).toRotationMatrix()[2, 2]
        assert down == pytest.approx(-1.0 if robot.vendor == "Universal Robots" else 0.0, abs=1e-4), name


@pytest.mark.parametrize("name", NAMES)
def test_every_group_of_figures_says_where_it_comes_from(name):
    file = load_robot_file(name)
    absent = {group for group, part in (("supply", file.drives.supply), ("standby", file.standby)) if part is None}
    known = set(FigureGroup.__args__) - absent
    assert set(file.provenance) == known
    assert "github.com/" in file.source
    assert file.license in ("Apache-2.0", "BSD-3-Clause")
    assert (file.provenance["inertia"].kind == "composed") == (
        name in ("kuka_kr16_r2010_2", "kuka_kr16_r1610_2", "kuka_kr20_r1810_2")
    )
    massless = {link for link, figures in file.links.items() if figures is not None and figures.mass_kg < 1e-5}
    assert set(file.lumped_links) == massless


# mass without base where a published data sheet gives one [kg], reach of the data sheet [m]
DATA_SHEETS = {
    "ur_ur10e": (33.5, 1.300),
    "ur_ur5e": (20.6, 0.850),
    "ur_ur3e": (11.2, 0.500),
    "kuka_kr6_r900_2": (52, 0.901),
}


@pytest.mark.parametrize("name", DATA_SHEETS)
def test_masses_and_reaches_are_near_the_data_sheets(name):
    """Masses within a quarter (cables and covers may be left out); the chain is longer than the reach."""
    file = load_robot_file(name)
    mass, reach = DATA_SHEETS[name]
    assert file.total_mass_kg == pytest.approx(mass, rel=0.25)
    assert reach < file.reach_m < 1.4 * reach


@pytest.mark.parametrize("name", load_anchors().cobots.names)
def test_collaborative_arms_seen_from_their_own_bus_are_as_measured(name):
    """26-37 W standing on three arms, 1-2.6 W more while moving, 1.10 times the power of the motors."""
    robot, anchors = loaded(name), load_anchors().cobots
    arm = robot.arm_side().drives
    low, high = anchors.arm_power_range_w
    assert low <= arm.base_power_w <= high
    assert 1.0 <= arm.drive_active_power_w <= 2.6
    assert arm.inverter_efficiency == pytest.approx(1.0 / 1.10, rel=1e-3)
    back = robot.supply.mains_side(arm)
    assert back.base_power_w == pytest.approx(robot.drives.base_power_w, rel=1e-12)
    assert back.inverter_efficiency == pytest.approx(robot.drives.inverter_efficiency, rel=1e-12)
    assert robot.file.provenance["supply"].kind == "assumed"


def test_robots_without_a_known_supply_have_no_side_of_the_arm():
    with pytest.raises(InputError, match="does not say what lies between the mains and the arm"):
        loaded("kuka_kr16_r2010_2").arm_side()
