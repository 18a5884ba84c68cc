"""Time series of one run of a motion that is made of several parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robojoule.arrays import Array
from robojoule.motion.simulation import MotionPaths
from robojoule.motion.time_laws import PathLaw
from robojoule.robots.drives import mains_power_w
from robojoule.robots.robot import Robot

if TYPE_CHECKING:
    from robojoule.motion.blends import BlendedPaths


@dataclass(frozen=True, eq=False)
class BlendSamples:
    """Time series of one run, T instants, n joints.

    Attributes:
        time_s: Instants, shape (T,); the last is the end of the run. [s]
        position_rad: Joint positions, shape (T, n). [rad]
        velocity_rad_s: Joint velocities, shape (T, n). [rad/s]
        acceleration_rad_s2: Joint accelerations, shape (T, n). [rad/s2]
        torque_nm: Link-side joint torques incl. friction and rotor inertia, shape (T, n). [Nm]
        power_w: Mains power, shape (T,). [W]
    """

    time_s: Array
    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array
    torque_nm: Array
    power_w: Array


def sampled(paths: BlendedPaths, motion: int, move_limits: Array, rate_hz: float = 250.0) -> BlendSamples:
    """Time series of one motion at a fixed rate, plus the final instant; without dead time.

    Args:
        paths: The motions.
        motion: Which of them; it must move.
        move_limits: Speed limits of all moves, shape (K,), fractions in (0, 1].
        rate_hz: Samples per second. [Hz]
    """
    return sampled_parts(paths.robot, _parts(paths, motion, move_limits), rate_hz)


def sampled_parts(robot: Robot, parts: Sequence[tuple[MotionPaths, int, PathLaw]], rate_hz: float) -> BlendSamples:
    """Time series of parts that are passed one after the other.

    Args:
        robot: The robot.
        parts: Paths of each part, its row there, and its law.
        rate_hz: Samples per second. [Hz]
    """
    starts = np.cumsum([0.0, *(law.total_s for _, _, law in parts)])
    steps = int(np.floor(starts[-1] * rate_hz * (1.0 - 1e-12)))
    time = np.append(np.arange(steps + 1) / rate_hz, starts[-1])
    owner = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(parts) - 1)
    joints = robot.joint_count
    table, power = np.empty((4, time.size, joints)), np.empty(time.size)
    for part in np.unique(owner).tolist():
        of, row, law = parts[part]
        at = owner == part
        s, s1, s2, _ = law.at(np.clip(time[at] - starts[part], 0.0, law.total_s))
        rows = np.array([row])
        slope = np.broadcast_to(of.path.slopes_rad(rows, s)[0], (joints, s.size)).T
        bend = np.broadcast_to(of.path.curvatures_rad(rows, s)[0], (joints, s.size)).T
        drawn = of.powers(rows, s[None], s1[None], s2[None])
        table[0, at] = of.path.positions_rad(rows, s)[:, 0].T
        table[1, at] = slope * s1[:, None]
        table[2, at] = slope * s2[:, None] + bend * s1[:, None] ** 2
        table[3, at] = drawn.torque_nm[0]
        power[at] = mains_power_w(robot.drives, drawn.bus_w)[0]
    return BlendSamples(time, table[0], table[1], table[2], table[3], power)


def _parts(paths: BlendedPaths, motion: int, move_limits: Array) -> list[tuple[MotionPaths, int, PathLaw]]:
    """Legs and pieces of corners of a motion in order, each with its paths, its row there and its law."""
    corners, limits = paths.corners, move_limits[paths.corners.leg][:, None]
    velocities = paths.timing.velocities(limits)
    found = []
    for leg in np.flatnonzero(corners.chain == motion).tolist():
        found.append((paths.legs, leg, single_law(paths.leg_laws(np.array([leg]), limits, velocities))))
        for piece in np.flatnonzero(corners.before[corners.corner] == leg).tolist():
            found.append((paths.pieces, piece, single_law(paths.timing.piece_laws(velocities, np.array([piece])))))
    return found


def single_law(law: PathLaw) -> PathLaw:
    """The one law of a table of one motion and one speed limit."""
    return PathLaw(law.duration_s[0, 0], law.jerk[0, 0], law.acceleration[0, 0], law.velocity[0, 0], law.position[0, 0])
