"""Speed limits of a program's motions: what they say, as shares of the joint velocity limits."""

from __future__ import annotations

from dataclasses import dataclass

from robojoule.formats.vendor.poses import NotKnown, Poses, Position
from robojoule.formats.vendor.speeds import (
    leading_share,
    percent_for_duration,
    percent_for_tool_speed,
    snapped,
)
from robojoule.formats.vendor.tool_paths import path_motion
from robojoule.formats.vendor.trace import Motion, NeedsRobot
from robojoule.programs.operation_tree import ToolPath

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
        path: The way of the tool; None: it is a joint motion, or counts as one.
    """

    percent: float | None
    is_fixed: bool = False
    remark: str = ""
    reason: str = ""
    path: ToolPath | None = None


@dataclass(frozen=True)
class SpeedLimits:
    """Speed limits for one robot.

    Attributes:
        poses: Its places of the tool; None: no robot is known.
    """

    poses: Poses | None

    def of(self, execution: Execution, *, is_blended: bool = False) -> Limit:
        """The speed limit of a motion.

        Args:
            execution: The motion.
            is_blended: Whether a zone joins it to the motion before or behind it.

        Raises:
            NeedsRobot: Its figure can be understood for a robot only.
        """
        motion = execution.motion
        speed = motion.speed
        if motion.kind != "joint":
            return self._of_path(execution, is_blended=is_blended)
        if speed.percent is not None:
            return Limit(speed.percent, not speed.writable)
        if speed.duration_s is None and speed.leading_rad_s is None and speed.tool_m_s is None:
            if not speed.writable:
                return Limit(None, True, reason="its speed is known only while the program runs")
            return Limit(100.0, remark="the program does not say how fast the motion is: taken as 100 %")
        if self.poses is None:
            raise NeedsRobot("the speed is not a share of the robot's own, which needs a robot", key=motion.place)
        if speed.duration_s is None and speed.leading_rad_s is not None:
            share = leading_share(execution.start_rad, execution.target_rad, self.poses.robot)
            return Limit(snapped(100.0 * share * speed.leading_rad_s) if share > 0.0 else 100.0, not speed.writable)
        if speed.duration_s is None:
            ends = [self.poses.model(position) for position in (execution.start_rad, execution.target_rad)]
            bounded = percent_for_tool_speed(self.poses.robot, ends[0], ends[1], motion.tool, speed)
            return Limit(bounded, not speed.writable)
        percent, off_s = self._timed(execution, self.poses)
        remarks = [f"by the robot's figures the motion takes {off_s:.3f} s longer than the program says"][
            : off_s > LATE_S
        ]
        if is_blended:
            remarks.append(
                "the duration of the motion is taken for that from stop to stop, as if no zone joined it to another"
            )
        return Limit(percent, not speed.writable, ", ".join(remarks))

    def _of_path(self, execution: Execution, *, is_blended: bool) -> Limit:
        """A motion of the tool along a path keeps its speed, as its duration or what it is for hangs on it."""
        motion = execution.motion
        if self.poses is None:
            raise NeedsRobot(f"the {motion.kind} motion needs a robot", key=motion.place)
        try:
            found = path_motion(motion, execution.start_rad, execution.target_rad, self.poses, is_blended=is_blended)
        except NotKnown as error:
            return Limit(None, True, reason=str(error))
        off_s = found.taken_s - found.wanted_s
        late = f" (+{off_s:.3f} s)" if off_s > LATE_S else ""
        if found.reason:
            text = f"the {motion.kind} motion is kept, and counted as a joint motion of the same duration{late}"
            return Limit(found.percent, True, f"{text}: {found.reason}")
        remarks = [f"the {motion.kind} motion keeps its speed"]
        if late:
            remarks.append(f"by the robot's figures it takes {off_s:.3f} s longer than the program says")
        if found.is_of_flange:
            remarks.append("as its tool is not known, the flange is taken to keep to the path")
        return Limit(found.percent, True, ", ".join(remarks), path=found.path)

    def _timed(self, execution: Execution, poses: Poses) -> tuple[float, float]:
        """Speed limit at which a joint motion takes as long as its program says, and by how much it differs. [%, s]"""
        wanted_s = execution.motion.speed.duration_s
        assert wanted_s is not None
        ends = [poses.model(position) for position in (execution.start_rad, execution.target_rad)]
        percent, taken_s = percent_for_duration(poses.robot, ends[0], ends[1], wanted_s)
        return percent, taken_s - wanted_s
