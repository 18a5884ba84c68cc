"""Speeds as vendors' programs give them, and as shares of the joint velocity limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robojoule.formats.vendor.trace import Motion, NeedsRobot, Speed
from robojoule.robots.robot import Robot

_SNAP_PERCENT = 2e-4  # what a program's digits leave of a whole percent


def leading_share(start_rad: Sequence[float], target_rad: Sequence[float], robot: Robot) -> float:
    """Share of the velocity limits that 1 rad/s of the joint that turns farthest is; 0 where nothing turns. [s/rad]

    Args:
        start_rad: Start of the motion; a pendant that counts joints together tells the same as the model here.
        target_rad: Its end.
        robot: The robot.
    """
    turned = np.abs(np.subtract(target_rad, start_rad))
    farthest = float(turned.max())
    return float((turned / robot.velocity_rad_s).max()) / farthest if farthest > 0.0 else 0.0


def motion_percent(
    speed: Speed, start_rad: Sequence[float], target_rad: Sequence[float], robot: Robot | None, motion: Motion
) -> float | None:
    """The share of the joint velocity limits that a motion's speed is; None where the program does not say. [%]

    Raises:
        NeedsRobot: The figure can be understood for a robot only.
    """
    if speed.percent is not None:
        return speed.percent
    if speed.leading_rad_s is None:
        return None
    if robot is None:
        raise NeedsRobot("the speed is one in rad/s, which needs a robot", key=f"line {motion.line}")
    share = leading_share(start_rad, target_rad, robot)
    return snapped(100.0 * share * speed.leading_rad_s) if share > 0.0 else 100.0


def snapped(percent: float) -> float:
    """A percentage as it was meant: a whole one where only the digits of the program differ from it."""
    whole = round(percent)
    return float(whole) if abs(percent - whole) <= _SNAP_PERCENT * max(percent, 1.0) else round(percent, 6)
