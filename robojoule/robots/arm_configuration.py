"""Which of the solutions of a pose a vendor's program means: Status and Turn, CONFIG, confdata.

All are defined by geometry: whether the wrist centre is behind axis 1, whether it is in front of the line through axes
2 and 3 (forward being away from axis 1 with that axis at zero), the sign of joint 5, and the turns of joints, in the
angles that the pendant shows. Sources: KUKA's Status and Turn as in Beckhoff's TF5200 programming manual, "Status &
Turn (IS, IT)", which takes them over, and threads 7173 and 45777 of robot-forum.com, which cite KUKA's manuals;
FANUC's CONFIG as tesseract_planning takes it (`robot_config.h`), turns those of joints 4, 5 and 6 as in FANUC's remote
motion interface (Turn4, Turn5, Turn6); ABB's confdata as in its RAPID reference, quarter turns of joints 1, 4 and 6
from zero upwards, cfx of arms with a serial wrist.

Near a border both sides count: a rounded pose does not tell on which one it was taught.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.inputs import shown
from robojoule.robots.arm_geometry import ArmGeometry, geometry_of, turned
from robojoule.robots.mechanism import Mechanism
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.robot import Robot

BORDER_RAD = math.radians(0.05)  # joints of rounded poses are known about as well as that
BORDER_M = 2e-4
_TURN_DEG = 360.0
_QUARTER_DEG = 90.0


@dataclass(frozen=True)
class Posture:
    """How an arm stands: each figure's sign says on which side of a border, its size how far from it.

    Attributes:
        front_m: How far the wrist centre is in front of axis 1. [m]
        bend_rad: How far the arm is bent from the straight one, positive: wrist in front of the line through axes 2 and
            3. [rad]
        pendant_rad: Angles that the pendant shows, shape (6,). [rad]
    """

    front_m: float
    bend_rad: float
    pendant_rad: Array

    @classmethod
    def of(cls, robot: Robot, q_rad: Array) -> Posture:
        """Posture at joint positions of shape (6,) [rad]; a pendant that is not known counts as the model does."""
        return postures(robot, np.asarray(q_rad, dtype=float)[None])[0]


def postures(robot: Robot, q_rad: Array) -> list[Posture]:
    """Postures at joint positions of shape (k, 6) [rad]; a pendant that is not known counts as the model does."""
    pendant = PendantAngles.of(robot) if robot.file.pendant is not None else None
    shown_rad = pendant.pendant_rad(q_rad) if pendant is not None else q_rad
    zero = pendant.zero_rad[0] if pendant is not None else 0.0
    geometry = geometry_of(robot.mechanism)
    rotations, origins = robot.mechanism.body_placements(q_rad)
    axis = geometry.axes[0]
    forward = turned(axis, q_rad[:, 0] - zero, _level(axis))
    left = np.cross(_upward(axis), forward)
    wrist = _wrist(robot.mechanism, geometry, rotations, origins)
    across = [_without(part, left) for part in ((origins[3] - origins[2]).T, wrist - origins[3].T)]
    lower, upper = across[0], across[1]
    sine, cosine = _scalar(np.cross(lower, upper), left), _scalar(lower, upper)
    bend, front = np.arctan2(sine, cosine), _scalar(wrist - origins[1].T, forward)
    return [
        Posture(float(front_m), float(bend_rad), angles)
        for front_m, bend_rad, angles in zip(front, bend, shown_rad, strict=True)
    ]


def _without(vectors: Array, along: Array) -> Array:
    return np.asarray(vectors - _scalar(vectors, along)[:, None] * along)


def _scalar(first: Array, second: Array) -> Array:
    """Scalar products of rows, shape (k,)."""
    return np.asarray(np.einsum("ki,ki->k", first, second))


def _wrist(mechanism: Mechanism, geometry: ArmGeometry, rotations: Array, origins: Array) -> Array:
    """Wrist centres, shape (k, 3): where the last axes meet, or axes 4 and 5, or the origins of joint 5. [m]"""
    for point in (geometry.wrist_m, geometry.middle_meeting_m):
        if np.isfinite(point).all():
            zero = [part[4, ..., 0] for part in mechanism.body_placements(np.zeros((1, mechanism.joint_count)))]
            inside = zero[0].T @ (point - zero[1])
            return np.asarray(origins[4].T + np.einsum("ijk,j->ki", rotations[4], inside))
    return np.asarray(origins[5].T)


def _upward(axis: Array) -> Array:
    return np.asarray(axis if axis[2] >= 0.0 else -axis)


def _level(axis: Array) -> Array:
    """The base's x axis as far as it is across axis 1."""
    x = np.array([1.0, 0.0, 0.0])
    x = x - (x @ axis) * axis
    return np.asarray(x / np.linalg.norm(x))


class Configuration(Protocol):
    """What a program says of the solution that it means."""

    def agreement(self, posture: Posture) -> int:
        """How far a posture agrees: 0 not in its branch, 1 in its branch, 2 in its turns, too."""


@dataclass(frozen=True)
class StatusAndTurn:
    """KUKA's: S and T of a POS or E6POS.

    Attributes:
        status: Bit 0: wrist behind axis 1; bit 1: wrist in front of the line through axes 2 and 3; bit 2: A5 below
            zero; further bits do not choose.
        turn: Bit i: angle of axis i + 1 below zero; none: not given.
    """

    status: int
    turn: int | None = None

    @classmethod
    def of(cls, robot: Robot, q_rad: Array) -> StatusAndTurn:
        """Status and Turn of joint positions, shape (6,). [rad]"""
        posture = Posture.of(robot, q_rad)
        bits = (posture.front_m < 0.0, posture.bend_rad > 0.0, posture.pendant_rad[4] < 0.0)
        turns = posture.pendant_rad < 0.0
        return cls(_number(bits), _number(turns.tolist()))

    def agreement(self, posture: Posture) -> int:
        """See `Configuration`."""
        sides = (
            _agrees(self.status & 1, -posture.front_m, BORDER_M),
            _agrees(self.status & 2, posture.bend_rad, BORDER_RAD),
            _agrees(self.status & 4, -float(posture.pendant_rad[4]), BORDER_RAD),
        )
        if not all(sides):
            return 0
        if self.turn is None:
            return 2
        turn = self.turn
        return 1 + all(
            _agrees(turn >> axis & 1, -angle, BORDER_RAD) for axis, angle in enumerate(posture.pendant_rad.tolist())
        )


@dataclass(frozen=True)
class FanucConfiguration:
    """FANUC's CONFIG string, such as 'N U T, 0, 0, 0'.

    Attributes:
        flip: F: J5 above zero, N: not.
        elbow: U: wrist in front of the line through axes 2 and 3, D: behind it.
        front: T: wrist in front of axis 1, B: behind it.
        turns: Whole turns of J4, J5, J6, 0 being -179 to 179 deg.
    """

    flip: str
    elbow: str
    front: str
    turns: tuple[int, int, int]

    @classmethod
    def parsed(cls, text: str) -> FanucConfiguration:
        """The configuration that a string names.

        Raises:
            InputError: It is none.
        """
        letters, *numbers = (part.strip() for part in text.split(","))
        names = letters.split() if " " in letters else list(letters)
        try:
            flip, elbow, front = names
            first, second, third = (int(number) for number in numbers)
        except ValueError:
            flip = elbow = front = ""
            first = second = third = 0
        if flip not in ("N", "F") or elbow not in ("U", "D") or front not in ("T", "B"):
            raise InputError(f"{shown(text)} is not a configuration", key="CONFIG", allowed="such as 'N U T, 0, 0, 0'")
        return cls(flip, elbow, front, (first, second, third))

    @classmethod
    def of(cls, robot: Robot, q_rad: Array) -> FanucConfiguration:
        """Configuration of joint positions, shape (6,). [rad]"""
        posture = Posture.of(robot, q_rad)
        turns = [_whole_turns(math.degrees(angle)) for angle in posture.pendant_rad[3:].tolist()]
        return cls(
            "F" if posture.pendant_rad[4] > 0.0 else "N",
            "U" if posture.bend_rad > 0.0 else "D",
            "T" if posture.front_m >= 0.0 else "B",
            (turns[0], turns[1], turns[2]),
        )

    def __str__(self) -> str:
        return f"{self.flip} {self.elbow} {self.front}, {', '.join(map(str, self.turns))}"

    def agreement(self, posture: Posture) -> int:
        """See `Configuration`."""
        sides = (
            _agrees(self.flip == "F", float(posture.pendant_rad[4]), BORDER_RAD),
            _agrees(self.elbow == "U", posture.bend_rad, BORDER_RAD),
            _agrees(self.front == "T", posture.front_m, BORDER_M),
        )
        if not all(sides):
            return 0
        degrees, border = np.degrees(posture.pendant_rad[3:]).tolist(), math.degrees(BORDER_RAD)
        return 1 + all(
            turn in (_whole_turns(angle - border), _whole_turns(angle + border))
            for turn, angle in zip(self.turns, degrees, strict=True)
        )


@dataclass(frozen=True)
class QuarterTurns:
    """ABB's confdata.

    Attributes:
        cf1: Quarter turn of joint 1, 0 being 0 to 90 deg, -1 being -90 to 0 deg.
        cf4: Of joint 4.
        cf6: Of joint 6.
        cfx: Sum of 4: wrist centre behind axis 1, 2: behind the lower arm, 1: angle of joint 5 below zero.
    """

    cf1: int
    cf4: int
    cf6: int
    cfx: int

    @classmethod
    def of(cls, robot: Robot, q_rad: Array) -> QuarterTurns:
        """Configuration of joint positions, shape (6,). [rad]"""
        posture = Posture.of(robot, q_rad)
        quarters = [math.floor(math.degrees(posture.pendant_rad[joint]) / _QUARTER_DEG) for joint in (0, 3, 5)]
        cfx = _number((posture.pendant_rad[4] < 0.0, posture.bend_rad < 0.0, posture.front_m < 0.0))
        return cls(quarters[0], quarters[1], quarters[2], cfx)

    def agreement(self, posture: Posture) -> int:
        """See `Configuration`."""
        sides = (
            _agrees(self.cfx & 1, -float(posture.pendant_rad[4]), BORDER_RAD),
            _agrees(self.cfx & 2, -posture.bend_rad, BORDER_RAD),
            _agrees(self.cfx & 4, -posture.front_m, BORDER_M),
        )
        if not all(sides):
            return 0
        border = math.degrees(BORDER_RAD)
        given = zip((self.cf1, self.cf4, self.cf6), np.degrees(posture.pendant_rad[[0, 3, 5]]).tolist(), strict=True)
        return 1 + all(
            quarter * _QUARTER_DEG - border <= angle <= (quarter + 1) * _QUARTER_DEG + border
            for quarter, angle in given
        )


def chosen(robot: Robot, solutions: Array, configuration: Configuration) -> tuple[Array, int]:
    """The solution that a configuration means: the first of those that agree best.

    Args:
        robot: The arm.
        solutions: What `joints_for_pose` returns, shape (k, 6). [rad]
        configuration: What the program says.

    Returns:
        The solution, shape (6,) [rad], and how far it agrees: 2 in all, 1 but for turns, 0 not even in its branch: the
        first solution, that is the nearest.
    """
    agreements = [configuration.agreement(posture) for posture in postures(robot, solutions)]
    best = int(np.argmax(agreements))
    return solutions[best], agreements[best]


def _agrees(wanted: object, amount: float, border: float) -> bool:
    """Whether an amount is above zero where that is wanted, and below where not, the border belonging to both."""
    return amount > -border if wanted else amount < border


def _number(bits: Sequence[bool]) -> int:
    return sum(1 << place for place, bit in enumerate(bits) if bit)


def _whole_turns(degrees: float) -> int:
    """Turns as FANUC counts them: 0 from -180 to 180 deg, 1 from 180 to 540 deg."""
    return math.ceil((degrees - 180.0) / _TURN_DEG) if degrees >= 0.0 else math.floor((degrees + 180.0) / _TURN_DEG)
