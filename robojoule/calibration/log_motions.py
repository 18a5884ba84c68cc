"""Point-to-point motions of a log: where each goes and how long it takes.

The arm stands where its joints are slower than a threshold. A motion between two rests counts if its joints go straight
from its start to its end; paths of tools and blended moves do not. Near its ends the path velocity is extended in a
straight line to zero, so that the time below the threshold is counted, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.signals import choose_smoothing, local_cubic
from robojoule.calibration.timing import TimingIdentification, identify_timing
from robojoule.errors import InputError
from robojoule.inputs import counted
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.robot import Robot

STOP_SPEED_RAD_S = 0.03
LEAST_TRAVEL_RAD = 0.05
LEAST_DURATION_S = 0.1
STRAIGHT = 0.04  # of the travel: what joints may leave the straight line by
SAME_RAD = 5e-3  # what ends of a motion that is repeated may be apart: sensors' noise, samples before the arm rests
_REST_SAMPLES = 3


@dataclass(frozen=True, eq=False)
class LoggedMotions:
    """Motions of a log, M of them, n joints.

    Attributes:
        source: The log.
        start_rad: Shape (M, n). [rad]
        end_rad: Shape (M, n). [rad]
        begin_s: When each begins, shape (M,). [s]
        duration_s: Shape (M,). [s]
        speed_limits: Fractions in (0, 1], shape (M,). [-]
        resolution_s: Median step of the log. [s]
        left_out: Number of motions between rests that are not straight.
    """

    source: str
    start_rad: Array
    end_rad: Array
    begin_s: Array
    duration_s: Array
    speed_limits: Array
    resolution_s: float
    left_out: int

    def paths(self, robot: Robot) -> MotionPaths:
        """The motions as a robot plans them."""
        return MotionPaths(robot, self.start_rad, self.end_rad)

    @property
    def runs(self) -> MeasuredRuns:
        """Each motion as a run; those from the same start to the same end are runs of the first of them."""
        count = self.duration_s.size
        ends = np.concatenate([self.start_rad, self.end_rad], axis=1)
        first = np.arange(count)
        for motion in range(count):
            alike = np.abs(ends[:motion] - ends[motion]).max(axis=1) <= SAME_RAD
            if alike.any():
                first[motion] = first[int(alike.argmax())]
        return MeasuredRuns(
            self.source,
            first,
            self.speed_limits,
            self.duration_s,
            np.full(count, np.nan),
            self.resolution_s,
        )


def logged_motions(
    source: str,
    time_s: Array,
    position_rad: Array,
    velocity_rad_s: Array,
    speed_limits: Array | None = None,
) -> LoggedMotions:
    """Find the motions of a log.

    Args:
        source: The log, for messages.
        time_s: Instants, shape (T,). [s]
        position_rad: Joint positions, shape (T, n). [rad]
        velocity_rad_s: Joint velocities, shape (T, n). [rad/s]
        speed_limits: Speed limit that held at each instant, shape (T,); 1 if not given. [-]

    Raises:
        InputError: There is no motion from rest to rest.
    """
    fast = np.abs(velocity_rad_s).max(axis=1) > STOP_SPEED_RAD_S
    change = np.flatnonzero(np.diff(fast.astype(int)))
    first = change[~fast[change]]  # last instants of rests before motions
    found: list[tuple[Array, Array, float, float, float]] = []
    left_out = 0
    for begin in first.tolist():
        ends = change[(change > begin) & fast[change]]
        if ends.size == 0:
            break
        end = int(ends[0]) + 1  # first instant of the rest after it
        if time_s[end] - time_s[begin] < LEAST_DURATION_S:
            continue
        start_q = position_rad[max(begin - _REST_SAMPLES, 0) : begin + 1].mean(axis=0)
        end_q = position_rad[end : end + _REST_SAMPLES + 1].mean(axis=0)
        travel = float(np.abs(end_q - start_q).max())
        rows = np.arange(begin, end + 1)
        if travel < LEAST_TRAVEL_RAD or not _is_straight(position_rad[rows], start_q, end_q):
            left_out += travel >= LEAST_TRAVEL_RAD
            continue
        along = (end_q - start_q) / float((end_q - start_q) @ (end_q - start_q))
        t0, t1 = _ends(time_s[rows], velocity_rad_s[rows] @ along, STOP_SPEED_RAD_S / travel)
        limit = 1.0 if speed_limits is None else float(np.median(speed_limits[rows]))
        found.append((start_q, end_q, t0, t1 - t0, limit))
    if not found:
        between = f" ({counted(left_out, 'motion')} between rests are not straight)" if left_out else ""
        raise InputError(f"no point-to-point motion from rest to rest is found{between}", file=source)
    starts, goals, begins, durations, limits = zip(*found, strict=True)
    return LoggedMotions(
        source=source,
        start_rad=np.array(starts),
        end_rad=np.array(goals),
        begin_s=np.array(begins),
        duration_s=np.array(durations),
        speed_limits=np.array(limits),
        resolution_s=float(np.median(np.diff(time_s))),
        left_out=left_out,
    )


def _is_straight(positions: Array, start: Array, end: Array) -> bool:
    change = end - start
    share = (positions - start) @ change / float(change @ change)
    off = np.abs(positions - start - share[:, None] * change).max()
    return bool(off <= STRAIGHT * np.abs(change).max())


def _ends(time_s: Array, velocity: Array, threshold: float) -> tuple[float, float]:
    """When a motion begins and ends: its path velocity, shape (T,) [1/s], extended to zero from twice the threshold."""
    return _rise(time_s, velocity, threshold), -_rise(-time_s[::-1], velocity[::-1], threshold)


def _rise(time_s: Array, velocity: Array, threshold: float) -> float:
    peak = float(velocity.max())
    low, high = min(threshold, 0.2 * peak), min(3.0 * threshold, 0.5 * peak)
    crossings = []
    for level in (low, high):
        above = int(np.argmax(velocity >= level))
        before = max(above - 1, 0)
        step = velocity[above] - velocity[before]
        share = (level - velocity[before]) / step if step > 0.0 else 0.0
        crossings.append(time_s[before] + np.clip(share, 0.0, 1.0) * (time_s[above] - time_s[before]))
    return float(crossings[0] - (crossings[1] - crossings[0]) * low / (high - low))


def log_timing(log: MeasuredLog, robot: Robot) -> tuple[TimingIdentification | None, str | None]:
    """The controller's timing by the motions of a log, or None and a sentence that says why there is none.

    There is none where too few different motions go from rest to rest, or where their durations cannot be the robot's.

    Args:
        log: The log. Without its speed limits all motions are taken to have run at full speed, and there is no timing
            where no rule explains them so.
        robot: The robot with its payload.
    """
    velocity = log.velocity_rad_s
    if velocity is None:
        velocity = local_cubic(log.time_s, log.position_rad, choose_smoothing(log.time_s, log.position_rad))[1]
    try:
        motions = logged_motions(log.source, log.time_s, log.position_rad, velocity, log.speed_limit)
        found = identify_timing(motions.paths(robot), motions.runs)
    except InputError as error:
        return None, f"no timing by the log's motions, of which each is a row here: {error}"
    if found.is_good or log.speed_limit is not None:
        return found, None
    if found.held_out_error_percent <= found.poor_error_percent:
        return None, f"no timing by the log's motions: {found.warnings[0]}"
    return None, (
        "no timing by the log's motions: without a column speed_limit_percent all are taken to have run at full speed, "
        "and no rule explains them so"
    )
