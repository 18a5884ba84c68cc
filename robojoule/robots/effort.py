"""Effort limits from what an arm needs, for arms whose published ones are only placeholders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.robots.recursion import mass_diagonal, path_points
from robojoule.robots.robot import Payload, Robot
from robojoule.robots.robot_file import RobotFile

SIX_ROLES = (0, 1, 2, 3, 4, 5)
_CONFIGURATIONS = 500


@dataclass(frozen=True)
class EffortRule:
    """Effort limits of six-axis arms from what they need at rated payload.

    With the largest gravity torque G and inertia M of a joint over its limits, its speed limit v and the reach L:
    T_2 = G_2 + M_2 v_2 / (c L), T_1 = r_1 T_2, T_3 = r_3 T_2, T_5 = f G_5, T_4 = r_4 T_5, T_6 = r_6 T_5.

    Attributes:
        acceleration_s_per_m: c: time to full speed per reach. [s/m]
        first_over_second: r_1. [-]
        third_over_second: r_3. [-]
        fourth_over_fifth: r_4. [-]
        fifth_over_gravity: f. [-]
        sixth_over_fifth: r_6. [-]
    """

    acceleration_s_per_m: float
    first_over_second: float
    third_over_second: float
    fourth_over_fifth: float
    fifth_over_gravity: float
    sixth_over_fifth: float

    @classmethod
    def of(cls, file: RobotFile, *, counterbalanced: bool) -> EffortRule:
        """Constants of one arm; NaN where a counterbalance hides what its joint 2 needs."""
        gravity, inertia = needs(file)
        effort, velocity = limits(file)
        hidden = np.nan if counterbalanced else 1.0
        return cls(
            hidden * float(inertia[1] * velocity[1] / (effort[1] - gravity[1]) / file.reach_m),
            hidden * float(effort[0] / effort[1]),
            hidden * float(effort[2] / effort[1]),
            float(effort[3] / effort[4]),
            float(effort[4] / gravity[4]),
            float(effort[5] / effort[4]),
        )

    def effort_nm(self, file: RobotFile, roles: Sequence[int] = SIX_ROLES) -> Array:
        """Effort limits of an arm, shape (n,). [Nm]

        Args:
            file: Robot file; its own effort limits are not looked at.
            roles: Joint of a six-axis arm, counted from 0, that each joint stands for; 1 and 4 must be there.
        """
        gravity, inertia = needs(file)
        second, fifth = (list(roles).index(role) for role in (1, 4))
        time_s = self.acceleration_s_per_m * file.reach_m
        main = gravity[second] + inertia[second] * limits(file)[1][second] / time_s
        wrist = self.fifth_over_gravity * gravity[fifth]
        shares = np.array([main, main, main, wrist, wrist, wrist]) * (
            self.first_over_second,
            1.0,
            self.third_over_second,
            self.fourth_over_fifth,
            1.0,
            self.sixth_over_fifth,
        )
        return np.asarray(shares[list(roles)])


def needs(file: RobotFile) -> tuple[Array, Array]:
    """Largest gravity torque [Nm] and largest inertia [kg m2] of every joint over its limits, at rated payload.

    Returns:
        Two arrays of shape (n,), over seeded random configurations.
    """
    robot = Robot(file, Payload(file.rated_payload_kg))
    rng = np.random.default_rng(0)
    configurations = rng.uniform(robot.lower_rad, robot.upper_rad, (_CONFIGURATIONS, robot.joint_count))
    gravity = path_points(robot.mechanism, configurations.T, np.zeros_like(configurations.T))[2]
    return np.abs(gravity).max(axis=1), mass_diagonal(robot.mechanism, configurations).max(axis=0)


def limits(file: RobotFile) -> tuple[Array, Array]:
    """Effort limits [Nm] and speed limits [rad/s], shape (n,) each."""
    joints = file.moving_joints
    return np.array([j.effort_nm for j in joints], dtype=float), np.array([j.velocity_rad_s for j in joints], float)
