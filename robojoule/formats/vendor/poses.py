"""Joint positions of places of the tool, by inverse kinematics, in the angles in which a program counts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.formats.vendor.trace import PoseTarget
from robojoule.robots.arm_configuration import chosen
from robojoule.robots.inverse_kinematics import flange_placement, inverse_of, joints_for_pose
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.pendant_file import Angles
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Robot
from robojoule.robots.vendor_frames import vendor_base, vendor_flange

Position = tuple[float, ...]
CALIBRATION_M, CALIBRATION_RAD = 5e-3, 0.02  # by which a calibrated arm may differ from its model
_IN_ALL, _BUT_TURNS = 2, 1  # how far a solution agrees with a configuration


class NotKnown(Exception):
    """A place of the tool that cannot be told; the text says why."""


@dataclass(frozen=True)
class Found:
    """Joint positions of a place.

    Attributes:
        position: Angles as the program counts them. [rad]
        remark: What had to be assumed; empty: nothing.
    """

    position: Position
    remark: str = ""


@dataclass(frozen=True, eq=False)
class Poses:
    """Places of the tool of one robot.

    Attributes:
        robot: The robot.
        angles: How the program counts joint angles.
    """

    robot: Robot
    angles: Angles

    @cached_property
    def _pendant(self) -> PendantAngles:
        return PendantAngles.of(self.robot)

    def model(self, position: Position) -> Array:
        """Angles of the model, shape (n,). [rad]"""
        values = np.array(position)
        return values if self.angles == "model" else self._pendant.model_rad(values)

    def counted(self, model_rad: Array) -> Position:
        """Angles as the program counts them. [rad]"""
        values = model_rad if self.angles == "model" else self._pendant.pendant_rad(model_rad)
        return tuple(values.tolist())

    def tool_in_base(self, position: Position, target: PoseTarget) -> Placement:
        """Where the tool of a target is in its base at joint positions."""
        base, tool = self._frames(target)
        return inverse_of(base) @ flange_placement(self.robot, self.model(position)) @ tool

    def flange(self, position: Position) -> Placement:
        """Where the flange is in the base frame of the robot's file at joint positions."""
        return flange_placement(self.robot, self.model(position))

    def _is_there(self, target: PoseTarget) -> bool:
        """Whether joint positions that are given with a place are its own, as far as the model knows the arm."""
        assert target.near_rad is not None
        if target.tool is None or target.relative or target.rotation is None or None in target.position_m:
            return False
        at = self.tool_in_base(target.near_rad, target)
        off_m = float(np.linalg.norm(at.origin_m - np.array(target.position_m, dtype=float)))
        off_rad = float(np.abs(at.rotation - target.rotation).max())
        return off_m <= CALIBRATION_M and off_rad <= CALIBRATION_RAD

    def _frames(self, target: PoseTarget) -> tuple[Placement, Placement]:
        """Base and tool of a target in the frames of the robot's file."""
        if target.base is None or target.tool is None:
            missing = target.unknown or "tool or base"
            verb, it = ("are", "them") if " and " in missing else ("is", "it")
            raise NotKnown(f"{missing} {verb} not in the file: give {it} by --tool, --base or --controller-data")
        return vendor_base(self.robot) @ target.base, vendor_flange(self.robot) @ target.tool

    def wanted(self, target: PoseTarget, position: Position | None) -> Placement:
        """The place in its base that a target means."""
        given = np.array([np.nan if value is None else value for value in target.position_m], dtype=float)
        if not (target.relative or target.rotation is None or np.isnan(given).any()):
            return Placement(target.rotation, given)
        if position is None:
            raise NotKnown("it depends on where the robot is, which is not known")
        present = self.tool_in_base(position, target)
        turn = np.eye(3) if target.rotation is None else target.rotation
        if target.relative == "tool":
            return present @ Placement(turn, np.nan_to_num(given))
        if target.relative == "base":
            return Placement(turn @ present.rotation, present.origin_m + np.nan_to_num(given))
        rotation = present.rotation if target.rotation is None else target.rotation
        return Placement(rotation, np.where(np.isnan(given), present.origin_m, given))

    def place(self, target: PoseTarget, position: Position | None) -> Placement:
        """Where the tool of a target is to be in the base frame of the robot's file.

        Raises:
            NotKnown: It cannot be told.
        """
        return self._frames(target)[0] @ self.wanted(target, position)

    def joints(self, target: PoseTarget, position: Position | None) -> Found:
        """Joint positions of a target.

        Args:
            target: The target.
            position: Where the robot is before; None: not known.

        Raises:
            NotKnown: It cannot be told.
        """
        near = target.near_rad if target.near_rad is not None else position
        if near is None and target.configuration is None:
            raise NotKnown("the file names no configuration, and where the robot comes from is not known")
        if target.near_rad is not None and target.tool is None:
            remark = f"{target.unknown} is not in the file: the joint positions that are given with the place are taken"
            return Found(target.near_rad, remark)
        if target.near_rad is not None and self._is_there(target):
            return Found(target.near_rad)
        base, tool = self._frames(target)
        place = base @ self.wanted(target, position)
        near_rad = None if near is None else self.model(near)
        try:
            solutions = joints_for_pose(self.robot, place, tool=tool, near_rad=near_rad)
        except InputError as error:
            raise NotKnown(error.problem) from None
        if target.configuration is None:
            said = target.nearest or target.near_rad is not None or target.relative != ""
            remark = "" if said else "no configuration is given: the solution nearest to the point before is taken"
            return Found(self.counted(solutions[0]), remark)
        solution, agreement = chosen(self.robot, solutions, target.configuration)
        if agreement == _IN_ALL:
            return Found(self.counted(solution))
        if near is None:
            raise NotKnown("no solution has the configuration that the file names")
        if agreement == _BUT_TURNS:
            remark = "no solution has the turns that the file names: the nearest one of its configuration is taken"
            return Found(self.counted(solution), remark)
        remark = "no solution has the configuration that the file names: the one nearest to the point before is taken"
        return Found(self.counted(solutions[0]), remark)
