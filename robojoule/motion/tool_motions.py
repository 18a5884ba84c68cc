"""Runs of motions along which the tool keeps to a straight line or a circle.

The joints follow by inverse kinematics (`robojoule.robots.tool_following`); the path coordinate s is the share of the
tool's way, so that the time law s(t) is that of the tool: a jerk-limited ramp, a cruise at constant speed, and a ramp.
A speed limit is a share of the joint velocity limits, as everywhere: it bounds the peak path velocity by the steepest
slope of a joint on the way. Path acceleration is what torques leave (`robojoule.motion.controller`), and not more than
the tool's acceleration that is given.

A motion consists of pieces, each a smooth path on which no joint turns back, with its part of the law. Energies add up,
peaks are the largest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index, Mask
from robojoule.motion.blend_samples import BlendSamples, sampled_parts, single_law
from robojoule.motion.controller import PathTiming
from robojoule.motion.groups import summed_runs
from robojoule.motion.inverse import limits_for
from robojoule.motion.series_path import SeriesPath
from robojoule.motion.simulation import MotionPaths, MotionRuns
from robojoule.motion.time_laws import PHASES, PathLaw, reachable_velocity
from robojoule.motion.torque_limits import TorqueLimits
from robojoule.robots.robot import Robot
from robojoule.robots.tool_courses import ToolCourse
from robojoule.robots.tool_following import Followed, follow

_HALVINGS = 60  # of a phase, to where a piece begins


@dataclass(frozen=True, eq=False)
class ToolMove:
    """A motion of the tool from stop to stop.

    Attributes:
        start_rad: Configuration at the start, shape (n,). [rad]
        end_rad: Configuration at the end, shape (n,). [rad]
        tool_m: Point of the tool that keeps to the course, in the robot's own tool frame. [m]
        via_m: Point in the robot's base frame through which a circle leads; None: a straight line. [m]
        acceleration_m_s2: Largest acceleration of that point along the course; None: what torques leave. [m/s2]
        acceleration_rad_s2: Largest acceleration of the tool's turn; None: what torques leave. [rad/s2]
    """

    start_rad: Array
    end_rad: Array
    tool_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    via_m: tuple[float, float, float] | None = None
    acceleration_m_s2: float | None = None
    acceleration_rad_s2: float | None = None

    def followed(self, robot: Robot) -> Followed:
        """How the joints of a robot follow it.

        Raises:
            InputError: They cannot; says why, without naming the motion.
        """
        return follow(robot, self.start_rad, self.end_rad, self.tool_m, self.via_m or ())

    def largest_acceleration(self, course: ToolCourse) -> float:
        """Largest path acceleration that is given; infinite where none is. [1/s2]"""
        given = (
            (self.acceleration_m_s2, course.length_m),
            (self.acceleration_rad_s2, course.turned_rad),
        )
        return min((most / way for most, way in given if most is not None and way > 0.0), default=np.inf)


class ToolTiming(PathTiming):
    """Time laws of M motions of the tool.

    Args:
        robot: The robot with its payload.
        pieces: The P pieces of all motions.
        owner: Motion of each piece, rising, shape (P,).
        width: Share of its motion that each piece takes, shape (P,). [-]
        largest: Largest path accelerations that are given, shape (M,). [1/s2]
    """

    def __init__(self, robot: Robot, pieces: MotionPaths, owner: Index, width: Array, largest: Array) -> None:
        self.robot, self.pieces, self.owner, self.width, self.largest = robot, pieces, owner, width, largest
        self.motions = len(largest)
        travel, steepest = np.zeros((2, self.motions, robot.joint_count))
        np.add.at(travel, owner, pieces.path.travel_rad)
        np.maximum.at(steepest, owner, pieces.path.steepest_rad / width[:, None])
        self.travel_rad = travel.max(axis=1)
        self.moving = self.travel_rad > 0.0
        with np.errstate(divide="ignore"):
            self.full_velocity = np.min(robot.velocity_rad_s / steepest, axis=1)

    def torque_limits(self, block: slice = slice(None)) -> TorqueLimits:
        """All torque limits of a block of motions, at the nodes of all their pieces.

        Raises:
            InputError: Gravity and friction take all that a joint has in a motion's poses.
        """
        found = []
        for motion in np.arange(self.motions)[block].tolist():
            rows = slice(*np.searchsorted(self.owner, [motion, motion + 1]).tolist())
            limits, torques = self.pieces.timing.torque_limits(rows), self.pieces.torques
            bend = self.pieces.path.curvatures_rad(rows, torques.values_s[rows])
            rotors = (self.robot.drives.reflected_inertia_kg_m2[:, None] * bend).reshape(len(bend), -1)
            width = self.width[rows, None]
            scaled = {
                "inertia": limits.inertia / width,
                "viscous": limits.viscous / width,
                "centrifugal": (limits.centrifugal + rotors) / width**2,
            }
            values = {one.name: scaled.get(one.name, getattr(limits, one.name)) for one in fields(TorqueLimits)}
            found.append(TorqueLimits(**{name: value.reshape(1, -1) for name, value in values.items()}))
        return TorqueLimits.joined(found)

    @cached_property
    def full_speed(self) -> tuple[Array, Array]:
        """See `PathTiming.full_speed`, with the tool's own acceleration where that is less."""
        velocity, allowed = self.by_torques()
        acceleration = np.minimum(allowed, self.largest)
        return np.minimum(velocity, reachable_velocity(acceleration, self.filter_time_s)), acceleration

    def by_torques(self) -> tuple[Array, Array]:
        """Peak path velocities [1/s] and accelerations [1/s2] that torques leave, shape (M,) each."""
        plain = PathTiming.__dict__["full_speed"].func(self)
        return plain[0], plain[1]

    @property
    def dead_time_s(self) -> float:
        """What every motion takes beyond its time law. [s]"""
        return 0.0 if self.robot.controller is None else self.robot.controller.dead_time_s


class ToolMotions:
    """Physics of M motions of the tool; see `robojoule.motion.motions.MovedMotions`.

    Args:
        robot: Robot with its payload.
        moves: The motions.

    Raises:
        InputError: The joints cannot follow; says why, without naming the motion.
    """

    def __init__(self, robot: Robot, moves: Sequence[ToolMove]) -> None:
        followed = [move.followed(robot) for move in moves]
        counts = [len(one.coefficients_rad) for one in followed]
        breaks = [one.breaks for one in followed]
        self._take(
            robot,
            MotionPaths.along(robot, SeriesPath(np.concatenate([one.coefficients_rad for one in followed]))),
            np.repeat(np.arange(len(moves)), counts),
            np.concatenate([one[:-1] for one in breaks]),
            np.concatenate([one[1:] for one in breaks]),
            np.array([move.largest_acceleration(one.course) for move, one in zip(moves, followed, strict=True)]),
        )

    def _take(self, robot: Robot, pieces: MotionPaths, owner: Index, low: Array, high: Array, largest: Array) -> None:
        self.robot, self.pieces, self.owner = robot, pieces, owner
        self.low, self.high = low, high
        self.timing = ToolTiming(robot, pieces, owner, high - low, largest)
        self.motions = len(largest)
        firsts = np.searchsorted(owner, np.arange(self.motions))
        self._ends = firsts, np.append(firsts[1:], len(owner)) - 1

    @property
    def moving(self) -> Mask:
        """Whether each motion moves, shape (M,)."""
        return np.asarray(self.timing.moving, dtype=np.bool_)

    @property
    def standing_torque_nm(self) -> tuple[Array, Array]:
        """Gravity torques at start and end, each of shape (M, n). [Nm]"""
        start, end = self.pieces.standing_torque_nm
        return start[self._ends[0]], end[self._ends[1]]

    @property
    def idle_power_start_w(self) -> Array:
        """Idle power at the start of each motion, shape (M,). [W]"""
        return np.asarray(self.pieces.idle_power_start_w[self._ends[0]])

    @property
    def idle_power_end_w(self) -> Array:
        """Idle power at the end of each motion, shape (M,). [W]"""
        return np.asarray(self.pieces.idle_power_end_w[self._ends[1]])

    def subset(self, rows: Index | slice) -> ToolMotions:
        """Some of the motions, in the order given."""
        chosen = np.arange(self.motions)[rows]
        pieces = [np.flatnonzero(self.owner == motion) for motion in chosen.tolist()]
        at = np.concatenate(pieces) if pieces else np.zeros(0, dtype=np.intp)
        owner = np.repeat(np.arange(len(chosen)), [len(one) for one in pieces])
        part = ToolMotions.__new__(ToolMotions)
        part._take(self.robot, self.pieces.known(at), owner, self.low[at], self.high[at], self.timing.largest[chosen])
        part.timing.take_full_speed(self.timing, chosen)
        return part

    def durations(self, speed_limits: ArrayLike) -> Array:
        """Durations under speed limits, shape (M, S). [s]"""
        return self.timing.durations(speed_limits) + self.timing.dead_time_s * self.moving[:, None]

    def minimum_durations(self) -> Array:
        """Durations at full speed, shape (M,). [s]"""
        return self.durations(np.ones(1))[:, 0]

    def fastest_speed_limits(self) -> Array:
        """Lowest speed limits that give the fastest runs, shape (M,); 1 for motions of zero length. [-]"""
        return self.timing.fastest_speed_limits()

    def kinks(self) -> list[Array]:
        """See `robojoule.motion.motions.Motions`: none. [-]"""
        return [np.zeros(0)] * self.motions

    def speed_limits_for_durations(self, durations_s: ArrayLike) -> Array:
        """Smallest speed limits that give at most the requested durations, shape (M,). [-]"""
        return limits_for(self.durations, durations_s, self.minimum_durations(), self.moving)

    def simulate(self, speed_limits: ArrayLike) -> MotionRuns:
        """Run every motion at speed limits, (S,) or (M, S)."""
        limits = np.array(np.broadcast_to(speed_limits, (self.motions, np.shape(speed_limits)[-1])), dtype=float)
        if limits.shape[1] > 1 and not np.ptp(limits, axis=1).any():  # plans keep the speeds of most of them
            once = self.simulate(limits[:, :1])
            return MotionRuns(**{f.name: np.repeat(getattr(once, f.name), limits.shape[1], 1) for f in fields(once)})
        velocity = self.timing.peak_velocities(limits)
        law = self._laws(velocity)
        shape = len(self.owner), velocity.shape[1]
        arrays = self.pieces.runs_by(np.ones(shape), lambda pieces: self._piece_laws(law, pieces))
        found = summed_runs([MotionRuns(**arrays)], self.owner, self.motions)
        found["speed_limit"] = limits
        if self.timing.dead_time_s != 0.0:
            ends = self.pieces.known(self._ends[1])
            ends.timing, ends.moving = self.timing, self.moving
            ends.add_dead_time(found)
        return MotionRuns(**found)

    def simulate_moves(self, move_limits: Array) -> MotionRuns:
        """Run every motion, which is a move each, at speed limits of shape (M, S)."""
        return self.simulate(move_limits)

    def power_samples(self, motion: int, move_limits: Array, rate_hz: float) -> BlendSamples:
        """Time series of one motion at speed limits of all moves, shape (M,), without dead time."""
        law = self._laws(self.timing.peak_velocities(np.asarray(move_limits, dtype=float)[:, None]))
        pieces = np.flatnonzero(self.owner == motion)
        parts = [(self.pieces, int(at), single_law(self._piece_laws(law, np.array([at])))) for at in pieces]
        return sampled_parts(self.robot, parts, rate_hz)

    def _laws(self, velocity: Array) -> PathLaw:
        """Laws of all motions at peak path velocities (M, S) [1/s], arrays (M, S, 7); those that stand have any."""
        rows = np.arange(self.motions)
        return self.timing.laws(np.where(self.moving[:, None], velocity, 1.0), rows)

    def _piece_laws(self, law: PathLaw, pieces: Index) -> PathLaw:
        """The parts of laws in which pieces (P') are passed, from 0 to 1 over each piece, arrays (P', S, 7)."""
        own = law.of(self.owner[pieces])
        low, high = self.low[pieces, None], self.high[pieces, None]
        return _part(own, _instants(own, low), _instants(own, high), low, high)


def _instants(law: PathLaw, position: Array) -> Array:
    """When laws (..., 7) are at positions that broadcast to (...). [s]"""
    starts = np.cumsum(law.duration_s, axis=-1) - law.duration_s
    total = starts[..., -1] + law.duration_s[..., -1]
    phase = np.clip((law.position <= position[..., None]).sum(axis=-1) - 1, 0, PHASES - 1)[..., None]
    start, length, p, v, a, j = (
        np.take_along_axis(values, phase, axis=-1)[..., 0]
        for values in (starts, law.duration_s, law.position, law.velocity, law.acceleration, law.jerk)
    )
    early, late = np.zeros_like(length), length
    for _ in range(_HALVINGS):
        t = (early + late) / 2.0
        before = p + t * (v + t * (a / 2.0 + t * j / 6.0)) < position
        early, late = np.where(before, t, early), np.where(before, late, t)
    return np.where(position <= 0.0, 0.0, np.where(position >= 1.0, total, start + (early + late) / 2.0))


def _part(law: PathLaw, since: Array, until: Array, low: Array, high: Array) -> PathLaw:
    """Laws (..., 7) between instants [s], from 0 to 1 between positions `low` and `high`.

    Phases that are over before, or begin behind, are empty and have the state in which the part begins, or ends.
    """
    starts = np.cumsum(law.duration_s, axis=-1) - law.duration_s
    ends = starts + law.duration_s
    last = law.duration_s.sum(axis=-1)[..., None]
    since, until = np.minimum(since[..., None], last), np.minimum(until[..., None], last)
    begins, stops = np.clip(starts, since, until), np.clip(ends, since, until)
    # An empty phase takes the state of the phase that holds its time.
    holder = np.clip((starts[..., None, :] <= begins[..., None]).sum(axis=-1) - 1, 0, PHASES - 1)
    phase = np.where((ends > since) & (starts < until), np.arange(PHASES), holder)
    p, v, a, j, own = (
        np.take_along_axis(values, phase, axis=-1)
        for values in (law.position, law.velocity, law.acceleration, law.jerk, starts)
    )
    t, width = begins - own, (high - low)[..., None]
    position = p + t * (v + t * (a / 2.0 + t * j / 6.0))
    return PathLaw(
        duration_s=np.maximum(stops - begins, 0.0),
        jerk=j / width,
        acceleration=(a + t * j) / width,
        velocity=(v + t * (a + t * j / 2.0)) / width,
        position=np.clip((position - low[..., None]) / width, 0.0, 1.0),
    )
