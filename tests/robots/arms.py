"""Small arms that are not in the catalog."""

import copy
import math

import numpy as np

from robojoule.documents import parse
from robojoule.robots.mechanism import Mechanism
from robojoule.robots.rigid_body import Placement, RigidBody
from robojoule.robots.robot_file import RobotFile

DRIVE = {
    "gear_ratio": 100.0,
    "rotor_inertia_kg_m2": 1e-4,
    "coulomb_nm": 2.0,
    "viscous_nm_s_per_rad": 4.0,
    "copper_w_per_nm2": 5.0,
}
CONTROLLER = {
    "provenance": "stated by the test",
    "base_power_w": 80.0,
    "drive_active_power_w": 0.0,
    "inverter_efficiency": 0.9,
    "regeneration_efficiency": 0.0,
    "torque_use": 0.9,
    "torque_floor": 0.15,
    "filter_time_s": 0.02,
}


def rod(mass_kg, length_m):
    """Inertial figures of a rod with a little thickness along x."""
    across = mass_kg * length_m**2 / 12
    return {
        "mass_kg": mass_kg,
        "com_m": [length_m / 2, 0.0, 0.0],
        "inertia_kg_m2": {"ixx": across / 20, "ixy": 0.0, "ixz": 0.0, "iyy": across, "iyz": 0.0, "izz": across},
    }


def arm_data(joints=2):
    """Plain data of an arm of equal rods; its axes alternate between z and y, the first is vertical."""
    names = [f"joint_{index + 1}" for index in range(joints)]
    lengths = [0.5 * 0.8**index for index in range(joints)]
    return copy.deepcopy(
        {
            "name": f"arm_{joints}",
            "vendor": "none",
            "model": "rods",
            "rated_payload_kg": 1.0,
            "source": "made up",
            "license": "Apache-2.0",
            "root_link": "base",
            "links": {"base": None, **{f"rod_{i + 1}": rod(4.0 * 0.8**i, lengths[i]) for i in range(joints)}},
            "joints": [
                {
                    "name": name,
                    "type": "revolute",
                    "parent": f"rod_{index}" if index else "base",
                    "child": f"rod_{index + 1}",
                    "origin_xyz_m": [lengths[index - 1], 0.0, 0.0] if index else [0.0, 0.0, 0.6],
                    "origin_rpy_rad": [0.0, 0.0, 0.0],
                    "axis": [0.0, 1.0, 0.0] if index % 2 else [0.0, 0.0, 1.0],
                    "lower_rad": -2.5,
                    "upper_rad": 2.5,
                    "velocity_rad_s": 3.0,
                    "effort_nm": 150.0,
                }
                for index, name in enumerate(names)
            ],
            "tool": {
                "parent": f"rod_{joints}",
                "origin_xyz_m": [lengths[-1], 0.0, 0.0],
                "origin_rpy_rad": [0.0, math.pi / 2, 0.0],
            },
            "home_rad": [0.0] * joints,
            "drives": {**CONTROLLER, "joints": dict.fromkeys(names, DRIVE)},
        }
    )


def arm_file(joints=2):
    return parse(RobotFile, arm_data(joints), "arm")


def random_placement(rng):
    return Placement.of(rng.uniform(-0.6, 0.6, 3), tuple(rng.uniform(-3.1, 3.1, 3)))


def random_body(rng):
    """A body of four point masses: physical, whatever is drawn."""
    body = RigidBody.nothing()
    for point in rng.uniform(-0.3, 0.3, (4, 3)):
        body += RigidBody(rng.uniform(0.5, 4.0), point, np.zeros((3, 3)))
    return body


def random_mechanism(rng, joints, *, lumped=(), gravity=(0.0, 0.0, -9.81)):
    """An arm of any axes and placements; lumped bodies (counted from 1) have no mass."""
    axes = rng.normal(size=(joints, 3))
    return Mechanism(
        joint_names=tuple(f"joint_{index + 1}" for index in range(joints)),
        placements=tuple(random_placement(rng) for _ in range(joints)),
        axes=axes / np.linalg.norm(axes, axis=1)[:, None],
        bodies=tuple(RigidBody.nothing() if i + 1 in lumped else random_body(rng) for i in range(joints)),
        anchors={},
        tool_body=joints,
        tool=random_placement(rng),
        gravity_m_s2=np.array(gravity),
    )


def swinging_arm(*, lengths_m, masses_kg, pendulum=True):
    """Point masses at the ends of rods without mass that all turn about one axis: level, or (not pendulum) upright."""
    count = len(lengths_m)
    rods = [Placement(np.eye(3), np.array([length, 0.0, 0.0])) for length in lengths_m]
    return Mechanism(
        joint_names=tuple(f"joint_{index + 1}" for index in range(count)),
        placements=(Placement.identity(), *rods[:-1]),
        axes=np.repeat([[0.0, 1.0, 0.0] if pendulum else [0.0, 0.0, 1.0]], count, axis=0),
        bodies=tuple(RigidBody(m, r.origin_m, np.zeros((3, 3))) for m, r in zip(masses_kg, rods, strict=True)),
        anchors={},
        tool_body=count,
        tool=rods[-1],
    )
