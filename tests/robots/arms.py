"""Small arms that are no catalog entries."""

import copy
import math

from robojoule.documents import parse
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
