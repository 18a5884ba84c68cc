"""The reference robot and its payload."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.robots import list_robots, load_robot
from robojoule.robots.robot import PAYLOAD_DENSITY_KG_M3, Payload
from tests.core_cases import kr16


def test_the_kr16_stands_as_published():
    """Reach, flange height and limits of the datasheet (KR 16 R2010: 2013 mm to the wrist centre's circle)."""
    robot = kr16(0.0)
    assert robot.joint_names == ("joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6")
    stretched, _ = robot.tool_placements([np.zeros(6)])
    assert stretched[0] == pytest.approx([0.16 + 0.98 + 0.86 + 0.153, 0.0, 0.52 + 0.15], abs=1e-9)
    home, _ = robot.tool_placements([robot.home_rad])
    assert home[0] == pytest.approx([0.16 + 0.86 + 0.153, 0.0, 0.52 + 0.98 + 0.15], abs=1e-9)
    assert np.degrees(robot.velocity_rad_s) == pytest.approx([200, 175, 190, 430, 430, 630], abs=1e-6)


def test_tool_z_leaves_the_flange():
    pin = pytest.importorskip("pinocchio")
    _, orientation = kr16().tool_placements([np.zeros(6)])
    w, x, y, z = orientation[0]
    axis = pin.Quaternion(w, x, y, z).toRotationMatrix() @ [0, 0, 1]
    assert axis == pytest.approx([1, 0, 0], abs=1e-9)
    assert w >= 0


def test_payload_adds_its_weight_at_its_centre():
    """Holding torque of joint 2 with the arm stretched: payload weight times lever, by hand."""
    pin = pytest.importorskip("pinocchio")
    q = np.zeros(6)
    bare, loaded = kr16(0.0), load_robot("kuka_kr16_r2010_2", Payload(10.0, (0.0, 0.0, 0.1)))
    torques = [pin.computeGeneralizedGravity(r.model, r.model.createData(), q)[1] for r in (bare, loaded)]
    assert abs(torques[1] - torques[0]) == pytest.approx(10.0 * 9.81 * (0.98 + 0.86 + 0.153 + 0.1), rel=1e-9)


def test_inertia_is_given_by_its_diagonal_by_six_numbers_or_as_a_matrix():
    matrix = [[0.3, 0.01, 0.02], [0.01, 0.4, 0.03], [0.02, 0.03, 0.5]]
    six = Payload(8.0, inertia_kg_m2=(0.3, 0.4, 0.5, 0.01, 0.02, 0.03))
    assert six == Payload(8.0, inertia_kg_m2=matrix)
    assert np.array_equal(Payload(8.0, inertia_kg_m2=(0.3, 0.4, 0.5)).inertia_kg_m2, np.diag([0.3, 0.4, 0.5]))
    with pytest.raises(InputError, match=r"not that of a body.*3, 6 or 3 x 3"):
        Payload(8.0, inertia_kg_m2=(0.3, 0.4))


def test_default_inertia_is_a_solid_sphere():
    inertia = Payload(8.0).rotational_inertia_kg_m2()
    radius = (3 * 8.0 / (4 * np.pi * PAYLOAD_DENSITY_KG_M3)) ** (1 / 3)
    assert inertia == pytest.approx(0.4 * 8.0 * radius**2 * np.eye(3))
    own = np.diag([0.1, 0.2, 0.25])
    assert np.array_equal(Payload(8.0, inertia_kg_m2=own).rotational_inertia_kg_m2(), own)


BAD_PAYLOADS = {
    "negative": ({"mass_kg": -1.0}, "-1 is not a valid payload mass"),
    "not finite": ({"mass_kg": float("nan")}, "nan is not a valid payload mass"),
    "centre": ({"com_m": (0.0, float("inf"), 0.0)}, "is not a valid centre of mass"),
    "inertia": ({"inertia_kg_m2": np.array([[1, 2, 0], [0, 1, 0], [0, 0, 1.0]])}, "symmetric positive"),
}


@pytest.mark.parametrize("arguments, message", BAD_PAYLOADS.values(), ids=BAD_PAYLOADS.keys())
def test_bad_payloads(arguments, message):
    with pytest.raises(InputError, match=message):
        Payload(**arguments)


BAD_CONFIGURATIONS = {
    "too few": ([0, 0, 0], "3 joint positions given, but kuka_kr16_r2010_2 has 6 joints"),
    "nan": ([0, float("nan"), 0, 0, 0, 0], "joint_2 is not a finite number"),
    "beyond": ([0, 1.5, 0, 0, 0, 0], r"joint_2 = 1.5 rad \(85.9437 deg\) is beyond its limit; allowed: -3.22886 to"),
    "text": (["a"] * 6, "joint positions must be numbers"),
}


@pytest.mark.parametrize("q, message", BAD_CONFIGURATIONS.values(), ids=BAD_CONFIGURATIONS.keys())
def test_bad_configurations(q, message):
    with pytest.raises(InputError, match=message) as caught:
        kr16().check_configuration(q, "start")
    assert str(caught.value).startswith("start: ")


@pytest.mark.parametrize("name", ["kr16 r2010", "KUKA_KR16_R2010_2", "kr16_r2010_2", "kuka kr16-2010", "kr17"])
def test_an_unknown_robot_is_told_its_near_names(name):
    with pytest.raises(InputError, match=r"^unknown robot '.*' \(did you mean .*kuka_kr16_r2010_2"):
        load_robot(name)


def test_a_name_that_resembles_none_is_told_where_they_are_listed():
    with pytest.raises(InputError, match=r"^unknown robot 'xyzzy'; allowed: a name that list_robots or `robojoule"):
        load_robot("xyzzy")
    assert "kuka_kr16_r2010_2" in list_robots()


def test_nothing_is_carried_unless_said():
    assert load_robot("kuka_kr16_r2010_2").payload == Payload() == Payload(0.0)
    by_mass, by_payload = (load_robot("kuka_kr16_r2010_2", **{key: value}) for key, value in PAYLOADS_OF_5_KG.items())
    assert by_mass.payload == by_payload.payload == load_robot("kuka_kr16_r2010_2", Payload(5.0)).payload


PAYLOADS_OF_5_KG = {"payload_kg": 5.0, "payload": Payload(5.0)}
BAD_LOADS = {
    "both": (PAYLOADS_OF_5_KG, "payload_kg: a payload and its mass are both given; allowed: one of the two"),
    "number": ({"payload": 5.0}, "payload: 5 is not a payload; allowed: a Payload, or a mass as payload_kg"),
    "text": ({"payload_kg": "five"}, "'five' is not a valid payload mass; allowed: 0 kg or more"),
    "too much": ({"payload_kg": 17}, "a payload of 17 kg is more than kuka_kr16_r2010_2 is rated for"),
}


@pytest.mark.parametrize("arguments, message", BAD_LOADS.values(), ids=BAD_LOADS.keys())
def test_bad_loads(arguments, message):
    with pytest.raises(InputError, match=message):
        load_robot("kuka_kr16_r2010_2", **arguments)


def test_a_robot_says_what_it_is():
    assert repr(kr16(5.0)) == "Robot('kuka_kr16_r2010_2', 6 joints, payload 5 kg)"
