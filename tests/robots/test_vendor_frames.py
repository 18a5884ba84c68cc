"""Frames of controllers: published poses of pendants come out."""

import numpy as np
import pytest

from robojoule.robots import list_robots, load_robot
from robojoule.robots.inverse_kinematics import flange_placement
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload
from robojoule.robots.vendor_frames import payload_of_vendor, vendor_base, vendor_flange
from tests.robots.test_pendant import LR_MATE


@pytest.mark.parametrize("pendant_deg, position_mm, z_axis", LR_MATE)
def test_published_poses_of_a_fanuc(pendant_deg, position_mm, z_axis):
    robot = load_robot("fanuc_lrmate200id")
    q = PendantAngles.of(robot).model_rad(np.radians(pendant_deg))
    world = vendor_base(robot)
    flange = flange_placement(robot, q) @ vendor_flange(robot)
    np.testing.assert_allclose(flange.origin_m - world.origin_m, np.array(position_mm) / 1e3, atol=2e-4)
    np.testing.assert_allclose(flange.rotation[:, 2], z_axis, atol=2e-4)


@pytest.mark.parametrize("name", [name for name in list_robots() if name.startswith("fanuc")])
def test_a_fanuc_at_zero_shows_w_180_p_minus_90(name):
    robot = load_robot(name)
    flange = flange_placement(robot, np.zeros(6)) @ vendor_flange(robot)
    np.testing.assert_allclose(flange.rotation, [[0, 0, 1], [0, -1, 0], [1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(vendor_base(robot).origin_m[:2], 0.0, atol=1e-12)


def test_a_kuka_at_home_shows_a_0_b_90_c_0_at_the_data_sheets_place():
    """KR 16 R2010: axis 2 at x 160, z 520, arm 980, axis 4 at 150 above axis 3, forearm 860, flange 153 mm."""
    robot = load_robot("kuka_kr16_r2010_2")
    home = flange_placement(robot, np.radians([0, -90, 90, 0, 0, 0])) @ vendor_flange(robot)
    np.testing.assert_allclose(home.origin_m, [0.160 + 0.860 + 0.153, 0.0, 0.520 + 0.980 + 0.150], atol=1e-9)
    np.testing.assert_allclose(home.rotation, Placement.of((0, 0, 0), (0.0, np.pi / 2, 0.0)).rotation, atol=1e-9)
    assert not vendor_base(robot).origin_m.any()


def test_payloads_of_a_fanuc_turn_with_its_flange():
    """Half a turn about z: x and y change their signs, and so do the moments that have z once."""
    given = Payload(10.0, (0.05, -0.02, 0.2), (0.3, 0.2, 0.1, 0.01, 0.02, -0.03))
    found = payload_of_vendor(load_robot("fanuc_m10_12_14d"), given)
    np.testing.assert_allclose(found.com_m, (-0.05, 0.02, 0.2), atol=1e-12)
    expected = np.array(given.inertia_kg_m2)
    expected[2, :2] *= -1.0
    expected[:2, 2] *= -1.0
    np.testing.assert_allclose(found.inertia_kg_m2, expected, atol=1e-12)
    assert payload_of_vendor(load_robot("ur_ur5e"), given) is given
