"""Motions of the tool along a line or a circle, as moves of operation trees, at the speed that a program gives."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.vendor.poses import NotKnown, Poses
from robojoule.formats.vendor.speeds import percent_for_duration
from robojoule.formats.vendor.trace import Motion, PoseTarget, Speed
from robojoule.motion.time_laws import duration_at_peak_s, reachable_velocity
from robojoule.motion.tool_motions import ToolMotions, ToolMove
from robojoule.programs.operation_tree import LEAST_SPEED_PERCENT, ToolPath
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Robot
from robojoule.robots.tool_courses import ToolCourse
from robojoule.robots.vendor_frames import vendor_flange

TOOL_ACCELERATION_M_S2 = 2.0  # of path motions whose program does not say: what industrial controllers set, roughly
TOOL_TURN_RAD_S = math.pi  # likewise, of turns of the tool
TOOL_TURN_RAD_S2 = 4.0 * math.pi
MOST_OF_A_JOINT = 3.0  # speed limits that a joint may need: beyond, the path is as good as through a singularity
_SAME_TURN_RAD = 1e-4  # by which a tool turns that keeps its orientation, in the digits of programs
_DIGITS = 9  # of points of the tool [m]


@dataclass(frozen=True)
class PathMotion:
    """A motion of the tool as a move.

    Attributes:
        percent: Share of the joint velocity limits. [%]
        wanted_s: Duration that the program means. [s]
        taken_s: Duration that the move takes. [s]
        path: The path; None: it counts as a joint motion.
        reason: Why it counts as one; empty: it does not.
        is_of_flange: Whether the flange keeps to the path, as the tool, which turns on it, is not known.
    """

    percent: float
    wanted_s: float
    taken_s: float
    path: ToolPath | None = None
    reason: str = ""
    is_of_flange: bool = False


def path_motion(
    motion: Motion, start_rad: tuple[float, ...], target_rad: tuple[float, ...], poses: Poses, *, is_blended: bool
) -> PathMotion:
    """A motion of the tool as a move along its path; as a joint motion that takes as long where it cannot be that.

    Args:
        motion: The motion.
        start_rad: Where it begins, angles as the program counts them. [rad]
        target_rad: Where it ends. [rad]
        poses: Places of the tool of the robot that executes it.
        is_blended: Whether a zone joins it to the motion before or behind it.

    Raises:
        NotKnown: Nobody can tell how long it takes; says why.
    """
    robot, tool_m = poses.robot, _tool_point_m(motion, poses)
    ends = [poses.model(position) for position in (start_rad, target_rad)]
    via_m = None if motion.via is None else poses.place(motion.via, start_rad).origin_m.round(_DIGITS)
    course, problem = _course(poses, start_rad, target_rad, np.array(tool_m), via_m)
    wanted_s = duration_s(motion.speed, course, robot)
    if wanted_s is None:
        raise NotKnown(f"the program does not say how fast the {motion.kind} motion is")
    if is_blended:
        problem = "a zone joins it to its neighbour"
    elif motion.kind == "circular" and via_m is None:
        problem = "the point that it passes is not known"
    if not problem:
        acceleration = motion.speed.tool_m_s2 or TOOL_ACCELERATION_M_S2
        path = ToolPath(
            type="linear" if via_m is None else "circular",
            tool_m=tool_m,
            via_m=None if via_m is None else (float(via_m[0]), float(via_m[1]), float(via_m[2])),
            acceleration_m_s2=acceleration if course.length_m > 0.0 else None,
            acceleration_rad_s2=TOOL_TURN_RAD_S2 if course.turned_rad > 0.0 else None,
        )
        move = ToolMove(ends[0], ends[1], tool_m, path.via_m, path.acceleration_m_s2, path.acceleration_rad_s2)
        try:
            found = _followed(motion.speed, move, path, course, robot, wanted_s)
            is_of_flange = _tool_of(motion) is None and course.turned_rad > _SAME_TURN_RAD
            return replace(found, is_of_flange=is_of_flange)
        except InputError as error:
            problem = error.problem
    percent, taken_s = percent_for_duration(robot, ends[0], ends[1], wanted_s)
    return PathMotion(percent, wanted_s, taken_s, reason=problem)


def duration_s(speed: Speed, course: ToolCourse, robot: Robot) -> float | None:
    """Duration of a motion of the tool along a course; None: no speed is known. [s]

    Accelerations that the program does not say are `TOOL_ACCELERATION_M_S2` and the like; jerk phases are those of the
    robot.
    """
    if speed.duration_s is not None:
        return speed.duration_s
    velocity = _path_velocity(speed, course)
    if velocity is None:
        return None
    if math.isinf(velocity):  # it goes nowhere
        return 0.0
    acceleration, reachable = _reachable(speed, course, robot)
    return float(duration_at_peak_s(min(velocity, reachable), acceleration, robot.drives.filter_time_s))


def _reachable(speed: Speed, course: ToolCourse, robot: Robot) -> tuple[float, float]:
    """Acceleration along a course that is not a point, and the peak velocity that it leaves. [1/s2, 1/s]"""
    accelerations = (
        (speed.tool_m_s2 or TOOL_ACCELERATION_M_S2, course.length_m),
        (TOOL_TURN_RAD_S2, course.turned_rad),
    )
    acceleration = min(most / way for most, way in accelerations if way > 0.0)
    return acceleration, float(reachable_velocity(acceleration, robot.drives.filter_time_s))


def _path_velocity(speed: Speed, course: ToolCourse) -> float | None:
    """Peak velocity along a course; None: no speed is known; infinite: it goes nowhere. [1/s]"""
    along, around = speed.tool_m_s, speed.tool_rad_s
    if not along and not (around and course.turned_rad > 0.0):
        return None
    around = around or TOOL_TURN_RAD_S
    given = [(along, course.length_m), (around, course.turned_rad)]
    return min((most / way for most, way in given if most and way > 0.0), default=math.inf)


def _followed(
    speed: Speed, move: ToolMove, path: ToolPath, course: ToolCourse, robot: Robot, wanted_s: float
) -> PathMotion:
    """The move along its path at the speed limit that the program means.

    Raises:
        InputError: The joints cannot follow; says why.
    """
    motions = ToolMotions(robot, [move])
    full = float(motions.timing.full_velocity[0])
    velocity = _path_velocity(speed, course)
    if not motions.moving[0]:
        share = 1.0
    elif speed.duration_s is not None or velocity is None:
        least_s = float(motions.minimum_durations()[0])
        share = float(motions.speed_limits_for_durations(np.array([max(wanted_s, least_s)]))[0])
        if wanted_s * full < 1.0 / MOST_OF_A_JOINT:
            raise InputError(_too_fast(1.0 / (wanted_s * full)))
    else:
        share = velocity / full
        needed = min(velocity, _reachable(speed, course, robot)[1]) / full
        if needed > MOST_OF_A_JOINT:
            raise InputError(_too_fast(needed))
    percent = min(max(round(100.0 * min(share, 1.0), 6), LEAST_SPEED_PERCENT), 100.0)
    taken_s = float(motions.durations(np.array([[percent / 100.0]]))[0, 0])
    return PathMotion(percent, wanted_s, taken_s, path)


def _too_fast(share: float) -> str:
    return f"a joint would have to turn {share:.0f} times as fast as it can, near a singularity or on a long way"


def _course(
    poses: Poses, start_rad: tuple[float, ...], target_rad: tuple[float, ...], tool_m: np.ndarray, via_m: object
) -> tuple[ToolCourse, str]:
    """The course of a tool, and what is wrong with it; a line in place of a circle that is none."""
    flanges = [poses.flange(position) for position in (start_rad, target_rad)]
    start, end = (Placement(flange.rotation, flange.at(tool_m)) for flange in flanges)
    try:
        return ToolCourse.between(start, end, via_m), ""  # type: ignore[arg-type]
    except InputError as error:
        return ToolCourse.between(start, end), error.problem


def _tool_point_m(motion: Motion, poses: Poses) -> tuple[float, float, float]:
    """The point of the tool in the tool frame of the robot's file. [m]"""
    tool = _tool_of(motion)
    if tool is None:
        return 0.0, 0.0, 0.0
    x, y, z = (round(float(value), _DIGITS) + 0.0 for value in vendor_flange(poses.robot).at(tool.origin_m))
    return x, y, z


def _tool_of(motion: Motion) -> Placement | None:
    target = motion.target
    return target.tool if isinstance(target, PoseTarget) and target.tool is not None else motion.tool
