"""The frames in which a vendor's controller says poses, against those of the robot's file.

FANUC's world frame is on axis 1 at the height of axis 2, and its flange shows W 180, P -90, R 0 with all joints at zero
(ros-industrial's descriptions of these robots place `base` and `tool0` so); the files of the catalog begin at the floor
and turn the flange by half a turn. All other vendors' frames are those of the files.
"""

from __future__ import annotations

import numpy as np

from robojoule.robots.arm_geometry import geometry_of
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Payload, Robot

_FANUC_ZERO_RPY_RAD = (np.pi, -0.5 * np.pi, 0.0)


def vendor_base(robot: Robot) -> Placement:
    """The controller's world frame in the base frame of the robot's file. [m]"""
    if not _is_fanuc(robot):
        return Placement.identity()
    geometry = geometry_of(robot.mechanism)
    (first, second), axis = geometry.points_m[:2], geometry.axes[0]
    return Placement(np.eye(3), first + ((second - first) @ axis) * axis)


def vendor_flange(robot: Robot) -> Placement:
    """The controller's flange frame in the tool frame of the robot's file. [m]"""
    if not _is_fanuc(robot):
        return Placement.identity()
    shown = Placement.of((0.0, 0.0, 0.0), _FANUC_ZERO_RPY_RAD).rotation
    return Placement(geometry_of(robot.mechanism).flange.rotation.T @ shown, np.zeros(3))


def payload_of_vendor(robot: Robot, payload: Payload) -> Payload:
    """A payload whose figures are in the controller's flange frame in the tool frame of the robot's file."""
    if not _is_fanuc(robot):
        return payload
    body = payload.body.placed(vendor_flange(robot))
    inertia = None if payload.inertia_kg_m2 is None else body.inertia_kg_m2
    return Payload(payload.mass_kg, (body.center_m[0], body.center_m[1], body.center_m[2]), inertia)


def _is_fanuc(robot: Robot) -> bool:
    return robot.vendor.lower() == "fanuc"
