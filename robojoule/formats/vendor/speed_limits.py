"""Speed limits of a program's motions: what they say, as shares of the joint velocity limits."""

from __future__ import annotations

from dataclasses import dataclass

from robojoule.formats.vendor.poses import NotKnown, Poses, Position
from robojoule.formats.vendor.speeds import (
    leading_share,
    path_duration_s,
    percent_for_duration,
    percent_for_tool_speed,
    snapped,
)
from robojoule.formats.vendor.trace import Motion, NeedsRobot, PoseTarget
from robojoule.robots.rigid_body import Placement

LATE_S = 1e-3  # by which a path motion may be off before that is said


@dataclass(frozen=True)
class Execution:
    """One execution of a motion that is part of the tree.

    Attributes:
        motion: The motion.
        start_rad: Where it begins, angles as the program counts them. [rad]
        target_rad: Where it ends. [rad]
    """

    motion: Motion
    start_rad: Position
    target_rad: Position


@dataclass(frozen=True)
class Limit:
    """The speed limit of a motion.

    Attributes:
        percent: Share of the joint velocity limits; None: nobody knows how long the motion takes. [%]
        is_fixed: Whether plans keep it.
        remark: What to know about it; empty: nothing.
        reason: Why the motion is kept as it is, where nobody knows how long it takes.
    """

    percent: float | None
    is_fixed: bool = False
    remark: str = ""
    reason: str = ""


@dataclass(frozen=True)
class SpeedLimits:
    """Speed limits for one robot.

    Attributes:
        poses: Its places of the tool; None: no robot is known.
    """

    poses: Poses | None

    def of(self, execution: Execution) -> Limit:
        """The speed limit of a motion.

        Raises:
            NeedsRobot: Its figure can be understood for a robot only.
        """
        motion = execution.motion
        speed = motion.speed
        if motion.kind != "joint":
            return self._of_path(execution)
        if speed.percent is not None:
            return Limit(speed.percent, not speed.writable)
        if speed.duration_s is None and speed.leading_rad_s is None and speed.tool_m_s is None:
            if not speed.writable:
                return Limit(None, True, reason="its speed is known only while the program runs")
            return Limit(100.0, remark="the program does not say how fast the motion is: taken as 100 %")
        if self.poses is None:
            raise NeedsRobot("the speed is not a share of the robot's own, which needs a robot", key=_at(motion))
        if speed.duration_s is None and speed.leading_rad_s is not None:
            share = leading_share(execution.start_rad, execution.target_rad, self.poses.robot)
            return Limit(snapped(100.0 * share * speed.leading_rad_s) if share > 0.0 else 100.0, not speed.writable)
        if speed.duration_s is None:
            ends = [self.poses.model(position) for position in (execution.start_rad, execution.target_rad)]
            bounded = percent_for_tool_speed(self.poses.robot, ends[0], ends[1], motion.tool, speed)
            return Limit(bounded, not speed.writable)
        percent, off_s = self._timed(execution, self.poses)
        late = f"by the robot's figures the motion takes {off_s:.3f} s longer than the program says"
        reason = "" if percent else "how long it takes cannot be told"
        return Limit(percent, not speed.writable, late if off_s > LATE_S else "", reason)

    def _of_path(self, execution: Execution) -> Limit:
        """A motion of the tool along a path stands as a joint motion between its ends that takes as long."""
        motion = execution.motion
        if self.poses is None:
            raise NeedsRobot(f"the {motion.kind} motion needs a robot", key=_at(motion))
        percent, off_s = self._timed(execution, self.poses)
        if percent is None:
            return Limit(None, True, reason=f"the program does not say how fast the {motion.kind} motion is")
        text = f"the {motion.kind} motion is kept, and counted as a joint motion of the same duration"
        return Limit(percent, True, text + (f" (+{off_s:.3f} s)" if off_s > LATE_S else ""))

    def _timed(self, execution: Execution, poses: Poses) -> tuple[float | None, float]:
        """Speed limit at which a joint motion takes as long as its program says, and by how much it differs. [%, s]"""
        motion = execution.motion
        places = [self._place(position, motion, poses) for position in (execution.start_rad, execution.target_rad)]
        if motion.via is not None:
            try:
                places.insert(1, poses.wanted(motion.via, execution.start_rad))
            except NotKnown:
                return None, 0.0
        wanted_s = path_duration_s(motion.speed, places)
        if wanted_s is None:
            return None, 0.0
        ends = [poses.model(position) for position in (execution.start_rad, execution.target_rad)]
        percent, taken_s = percent_for_duration(poses.robot, ends[0], ends[1], wanted_s)
        return percent, taken_s - wanted_s

    def _place(self, position: Position, motion: Motion, poses: Poses) -> Placement:
        target = motion.target
        if isinstance(target, PoseTarget) and target.tool is not None and target.base is not None:
            return poses.tool_in_base(position, target)
        return poses.flange(position)


def _at(motion: Motion) -> str:
    return f"line {motion.line}"
