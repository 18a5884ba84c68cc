"""Motions that several test modules share: random ones and hard cases with names."""

import numpy as np

from robojoule.motion.simulation import MotionPaths
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload, Robot

SPEED_LIMITS = np.arange(1, 11) / 10.0
HOME_DEG = (0, -90, 90, 0, 0, 0)
HARD_MOTIONS_DEG = {
    "one joint": (HOME_DEG, (90, -90, 90, 0, 0, 0)),
    "wrist only": (HOME_DEG, (0, -90, 90, 120, 60, -200)),
    "all joints far": ((-170, -150, -20, -300, -110, -300), (170, 30, 150, 300, 110, 300)),
    "tiny": (HOME_DEG, (0.01, -90, 90, 0, 0, 0)),
    "lift": ((0, 0, 0, 0, 0, 0), (0, -90, 0, 0, 0, 0)),
    "lower": ((0, -90, 0, 0, 0, 0), (0, 0, 0, 0, 0, 0)),
    "from limit to limit": ((-185, -90, 90, 0, 0, 0), (185, -90, 90, 0, 0, 0)),
}


def kr16(payload_kg: float = 10.0) -> Robot:
    return load_robot("kuka_kr16_r2010_2", Payload(payload_kg))


def random_motions(robot: Robot, count: int, seed: int = 11) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    start = rng.uniform(robot.lower_rad, robot.upper_rad, (count, robot.joint_count))
    change = rng.normal(0.0, 0.6, (count, robot.joint_count))
    return start, np.clip(start + change, robot.lower_rad, robot.upper_rad)


def hard_paths(robot: Robot) -> MotionPaths:
    ends = np.radians(np.array(list(HARD_MOTIONS_DEG.values()), dtype=float))
    return MotionPaths(robot, ends[:, 0], ends[:, 1])
