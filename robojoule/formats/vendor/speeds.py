"""Speeds as vendors' programs give them, and as shares of the joint velocity limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robojoule.arrays import Array
from robojoule.formats.vendor.trace import Speed
from robojoule.motion.simulation import MotionPaths
from robojoule.programs.operation_tree import LEAST_SPEED_PERCENT
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Robot
from robojoule.robots.vendor_frames import vendor_flange

_SNAP_PERCENT = 2e-4  # what a program's digits leave of a whole percent
_SNAP_DURATION = 2e-4  # and of one that was found by its duration
_LEAST_TRAVEL_RAD = 1e-9
_PLACES = 129  # along a motion, at which the speed of its tool is looked at


def leading_share(start_rad: Sequence[float], target_rad: Sequence[float], robot: Robot) -> float:
    """Share of the velocity limits that 1 rad/s of the joint that turns farthest is; 0 where nothing turns. [s/rad]"""
    turned = np.abs(np.subtract(target_rad, start_rad))
    farthest = float(turned.max())
    return float((turned / robot.velocity_rad_s).max()) / farthest if farthest > 0.0 else 0.0


def snapped(percent: float, within: float = _SNAP_PERCENT) -> float:
    """A percentage as it was meant: whole, or a whole tenth, where only the digits of the program differ from it."""
    for steps in (1, 10):
        meant = round(percent * steps) / steps
        if meant and abs(percent - meant) <= within * max(percent, 1.0):
            return meant
    return round(percent, 6)


def percent_for_duration(robot: Robot, start_rad: Array, target_rad: Array, duration_s: float) -> tuple[float, float]:
    """The speed limit at which a joint motion takes a time, and the time that it takes then. [%, s]

    Args:
        robot: The robot.
        start_rad: Start of the motion, angles of the model. [rad]
        target_rad: Its end.
        duration_s: What it shall take; a shorter time than possible gives the fastest motion. [s]
    """
    if float(np.abs(target_rad - start_rad).max()) <= _LEAST_TRAVEL_RAD:
        return 100.0, 0.0
    paths = MotionPaths(robot, start_rad[None], target_rad[None])
    wanted_s = np.maximum(duration_s, paths.minimum_durations())
    limit = float(paths.speed_limits_for_durations(wanted_s)[0])
    percent = snapped(min(max(100.0 * limit, LEAST_SPEED_PERCENT), 100.0), _SNAP_DURATION)
    return percent, float(paths.durations(np.array([[percent / 100.0]]))[0, 0])


def percent_for_tool_speed(
    robot: Robot, start_rad: Array, target_rad: Array, tool: Placement | None, speed: Speed
) -> float:
    """The largest speed limit at which the tool is nowhere faster than a program says. [%]

    Args:
        robot: The robot.
        start_rad: Start of the joint motion, angles of the model, shape (n,). [rad]
        target_rad: Its end.
        tool: The tool in the flange's frame; None: the flange itself. [m]
        speed: Speed of the tool, and at which it turns, where that is said.
    """
    change = target_rad - start_rad
    fastest = np.abs(change) / robot.velocity_rad_s
    if float(np.abs(change).max()) <= _LEAST_TRAVEL_RAD or speed.tool_m_s is None:
        return 100.0
    shares = np.linspace(0.0, 1.0, _PLACES)
    rotations, origins = robot.mechanism.body_placements(start_rad + shares[:, None] * change)
    body = robot.mechanism.tool_body
    flange = robot.mechanism.tool @ vendor_flange(robot)
    offset = (flange if tool is None else flange @ tool).origin_m
    way = np.gradient((origins[body] + np.einsum("rcN,c->rN", rotations[body], offset)).T, shares, axis=0)
    axes = np.einsum("jrcN,jc->Njr", rotations[1:], robot.mechanism.axes)
    most_m = float(np.linalg.norm(way, axis=1).max())
    most_rad = float(np.linalg.norm(np.einsum("Njr,j->Nr", axes, change), axis=1).max())
    seconds = [most_m / speed.tool_m_s, most_rad / speed.tool_rad_s if speed.tool_rad_s else 0.0]
    return max(100.0 * min(float(fastest.max()) / max(*seconds, 1e-12), 1.0), LEAST_SPEED_PERCENT)
