"""How an arm's joints follow a course of its tool: one solution from the start on, without a jump.

The solution is followed in small steps by Newton's method, then fitted by Chebyshev series piece by piece, each cut in
half until the tool is nowhere off its course. Pieces end where a joint turns back, too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from robojoule.arrays import Array, freeze
from robojoule.errors import InputError
from robojoule.robots.inverse_kinematics import flange_placement, missing_to, tool_kinematics
from robojoule.robots.rigid_body import Placement
from robojoule.robots.robot import Robot
from robojoule.robots.tool_courses import ToolCourse

DEGREE = 10  # of the series
OFF_COURSE = 1e-10  # by which a series may be off [m, rad]
_STEP, _LEAST_STEP = 1.0 / 8.0, 1.0 / 4096.0
_LARGEST_TURN_RAD = 0.2  # of a joint in a step
_LARGEST_SURPRISE_RAD = 0.05  # by which a step may end off what the one before it promised
_NEWTON_STEPS = 8
_MET = 1e-12  # residual of a place that is met [m, rad]
_HALVINGS = 9
_SAME_END_RAD = 1e-6
_STILL_RAD = 1e-9  # a joint that turns less on a piece does not turn
_NARROWEST = 1e-6  # share of a piece that a part of it takes at least
_SAMPLES = 33  # of a piece, at which signs of slopes and joint limits are looked at


@dataclass(frozen=True, eq=False)
class Followed:
    """Joint positions along a course.

    Attributes:
        coefficients_rad: Chebyshev coefficients over each of the P pieces, shape (P, n, K). [rad]
        breaks: Where pieces begin and end, from 0 to 1, shape (P + 1,). [-]
        course: The course.
    """

    coefficients_rad: Array
    breaks: Array
    course: ToolCourse

    def __post_init__(self) -> None:
        freeze(self)

    def points_rad(self, step_rad: float) -> Array:
        """Configurations on the way, no joint moving further between two of them than a step [rad], (N, n). [rad]"""
        parts = []
        for series in self.coefficients_rad:
            slopes = chebyshev.chebval(np.linspace(-1.0, 1.0, _SAMPLES), chebyshev.chebder(series.T))
            count = max(1, int(np.ceil(2.0 * np.abs(slopes).max() / step_rad)))
            parts.append(chebyshev.chebval(np.linspace(-1.0, 1.0, count + 1), series.T).T)
        return np.concatenate(parts)


def follow(
    robot: Robot, start_rad: ArrayLike, end_rad: ArrayLike, tool_m: ArrayLike, via_m: ArrayLike = ()
) -> Followed:
    """Joint positions that lead a tool along a line, or a circle, from one configuration to another.

    Args:
        robot: The arm.
        start_rad: Configuration at the start, shape (n,). [rad]
        end_rad: Configuration at the end, shape (n,). [rad]
        tool_m: Point of the tool in the robot's own tool frame, shape (3,). [m]
        via_m: Point in the robot's base frame through which a circle leads, shape (3,); empty: a line. [m]

    Raises:
        InputError: The arm cannot; says why, without naming the motion.
    """
    rows = (tuple(np.asarray(row, dtype=float).tolist()) for row in (start_rad, end_rad, tool_m, via_m))
    return _follow(robot, *rows)


@lru_cache(maxsize=256)  # programs are looked at several times: when they are read, checked and planned
def _follow(
    robot: Robot, start: tuple[float, ...], end: tuple[float, ...], tool: tuple[float, ...], via: tuple[float, ...]
) -> Followed:
    start_rad, end_rad, tool_m = np.array(start), np.array(end), np.array(tool)
    via_m = np.array(via) if via else None
    arm = _Arm(robot, tool_m)
    course = ToolCourse.between(arm.tool(start_rad), arm.tool(end_rad), via_m)
    if course.length_m == 0.0 and course.turned_rad == 0.0:
        still = np.zeros((1, robot.joint_count, DEGREE + 1))
        still[0, :, 0] = start_rad
        return Followed(still, np.array([0.0, 1.0]), course)
    steps, positions = _marched(arm, course, start_rad)
    _check_end(robot, positions[-1], end_rad)
    lows, widths, fitted = _fitted(arm, course, steps, positions)
    _check_limits(robot, lows, widths, fitted)
    return _cut(lows, widths, fitted, course)


@dataclass(frozen=True, eq=False)
class _Arm:
    """An arm with a point of its tool."""

    robot: Robot
    tool_m: Array

    def tool(self, q_rad: Array) -> Placement:
        """Where the tool is."""
        flange = flange_placement(self.robot, q_rad)
        return Placement(flange.rotation, flange.at(self.tool_m))

    def missing(self, course: ToolCourse, s: Array, q: Array) -> tuple[Array, Array]:
        """What is missing to a course at shares (N,) of it (N, 6), and how it changes with joints q (N, n)."""
        rotations, origins = course.at(s)
        flanges = origins - rotations @ self.tool_m
        at, where, axes, points = tool_kinematics(self.robot.mechanism, q)
        return missing_to(np.einsum("Nij,kjN->Nik", rotations, at), flanges, where, axes, points)

    def solved(self, course: ToolCourse, s: Array, q: Array) -> tuple[Array, Array]:
        """Joint positions at shares (N,) of a course from those near them (N, n), and what is missing then (N,)."""
        q, joints = np.array(q), q.shape[1]
        for step in range(_NEWTON_STEPS + 1):
            residual, jacobian = self.missing(course, s, q)
            squares = np.einsum("Ni,Ni->N", residual, residual)
            if step == _NEWTON_STEPS or squares.max() <= _MET**2:
                break
            transposed = jacobian.transpose(0, 2, 1)
            normal = transposed @ jacobian + (0.01 * squares + 1e-14)[:, None, None] * np.eye(joints)
            q += np.linalg.solve(normal, transposed @ residual[..., None])[..., 0]
        return q, np.abs(residual).max(axis=1)


def _marched(arm: _Arm, course: ToolCourse, start: Array) -> tuple[Array, Array]:
    """Shares of the course (N,) and joint positions (N, n) there, near to each other."""
    shares, positions, slope, step = [0.0], [start], None, _STEP
    while shares[-1] < 1.0:
        step = min(step, 1.0 - shares[-1])
        at = 1.0 if shares[-1] + step > 1.0 - 1e-12 else shares[-1] + step
        expected = positions[-1] if slope is None else positions[-1] + step * slope
        found, off = arm.solved(course, np.array([at]), expected[None])
        turned = np.abs(found[0] - positions[-1]).max()
        surprise = 0.0 if slope is None else np.abs(found[0] - expected).max()
        if off[0] <= OFF_COURSE and turned <= _LARGEST_TURN_RAD and surprise <= _LARGEST_SURPRISE_RAD:
            slope = (found[0] - positions[-1]) / (at - shares[-1])
            shares.append(at)
            positions.append(found[0])
            step = min(2.0 * step, _STEP)
            continue
        step /= 2.0
        if step < _LEAST_STEP:
            raise InputError(f"the arm meets a singularity or the end of its reach at {_percent(at)} of the way")
    return np.array(shares), np.array(positions)


def _fitted(arm: _Arm, course: ToolCourse, steps: Array, positions: Array) -> tuple[Array, Array, Array]:
    """Pieces on which series are on the course: where they begin, their widths, and their coefficients."""
    nodes, between = _nodes(DEGREE + 1), _middles(DEGREE + 1)
    to_series = np.linalg.inv(chebyshev.chebvander(nodes, DEGREE))
    at_middles = chebyshev.chebvander(between, DEGREE)
    joints = positions.shape[1]
    done: list[tuple[float, float, Array]] = []
    pending = [(0.0, 1.0)]
    for _ in range(_HALVINGS + 1):
        low, width = np.array(pending).T
        s = low[:, None] + width[:, None] * (nodes + 1.0) / 2.0
        near = np.stack([np.interp(s.ravel(), steps, positions[:, j]) for j in range(joints)], axis=1)
        found, off = arm.solved(course, s.ravel(), near)
        series = np.einsum("kl,plj->pjk", to_series, found.reshape(len(low), -1, joints))
        inside = low[:, None] + width[:, None] * (between + 1.0) / 2.0
        q = np.einsum("lk,pjk->plj", at_middles, series)
        missing = np.abs(arm.missing(course, inside.ravel(), q.reshape(-1, joints))[0]).max(axis=1)
        worst = np.maximum(missing.reshape(len(low), -1).max(axis=1), off.reshape(len(low), -1).max(axis=1))
        pending = []
        for piece, (a, b) in enumerate(zip(low.tolist(), width.tolist(), strict=True)):
            if worst[piece] <= OFF_COURSE:
                done.append((a, b, series[piece]))
            else:
                pending += [(a, b / 2.0), (a + b / 2.0, b / 2.0)]
        if not pending:
            done.sort(key=lambda one: one[0])
            return np.array([a for a, _, _ in done]), np.array([b for _, b, _ in done]), np.array([c for *_, c in done])
    raise InputError(f"the arm passes a singularity at {_percent(pending[0][0])} of the way")


def _check_end(robot: Robot, reached: Array, end: Array) -> None:
    joint = int(np.argmax(np.abs(reached - end)))
    if abs(reached[joint] - end[joint]) > _SAME_END_RAD:
        found, given = (math.degrees(float(value[joint])) for value in (reached, end))
        raise InputError(
            f"the arm gets there with {robot.joint_names[joint]} at {found:.1f} deg, the end has it at {given:.1f} deg"
        )


def _check_limits(robot: Robot, lows: Array, widths: Array, fitted: Array) -> None:
    """Refuse courses on which a joint gets beyond its limits."""
    x = np.linspace(-1.0, 1.0, _SAMPLES)
    q = np.einsum("lk,pjk->plj", chebyshev.chebvander(x, DEGREE), fitted)
    beyond = np.argwhere((q < robot.lower_rad - _SAME_END_RAD) | (q > robot.upper_rad + _SAME_END_RAD))
    if beyond.size:
        piece, sample, joint = (int(number) for number in beyond[0])
        share = float(lows[piece] + widths[piece] * (x[sample] + 1.0) / 2.0)
        raise InputError(f"{robot.joint_names[joint]} gets beyond its limit at {_percent(share)} of the way")


def _cut(lows: Array, widths: Array, fitted: Array, course: ToolCourse) -> Followed:
    """The pieces, cut where a joint turns back."""
    nodes = _nodes(DEGREE + 1)
    to_series = np.linalg.inv(chebyshev.chebvander(nodes, DEGREE))
    parts, breaks = [], []
    for low, width, series in zip(lows.tolist(), widths.tolist(), fitted, strict=True):
        cuts = [-1.0, *_turning_points(series), 1.0]
        for a, b in pairwise(cuts):
            at = a + (b - a) * (nodes + 1.0) / 2.0
            part = series if (a, b) == (-1.0, 1.0) else chebyshev.chebval(at, series.T) @ to_series.T
            part = np.where(
                (np.abs(part[:, 1:]).sum(axis=1) < _STILL_RAD)[:, None] & (np.arange(DEGREE + 1) > 0), 0.0, part
            )
            parts.append(part)
            breaks.append(low + width * (a + 1.0) / 2.0)
    return Followed(np.array(parts), np.array([*breaks, 1.0]), course)


def _turning_points(series: Array) -> list[float]:
    """Where within -1 to 1 a joint turns back on a piece of coefficients (n, K), rising."""
    slopes = chebyshev.chebder(series.T)
    signs = np.sign(chebyshev.chebval(np.linspace(-1.0, 1.0, _SAMPLES), slopes))
    found: list[float] = []
    for joint in np.flatnonzero((signs.min(axis=1) < 0.0) & (signs.max(axis=1) > 0.0)):
        if np.abs(series[joint, 1:]).sum() < _STILL_RAD:
            continue
        roots = chebyshev.chebroots(slopes[:, joint])
        real = np.real(roots[np.abs(np.imag(roots)) < 1e-9])
        found += real[np.abs(real) < 1.0 - 2.0 * _NARROWEST].tolist()
    kept: list[float] = []
    for root in sorted(found):
        if not kept or root - kept[-1] > 2.0 * _NARROWEST:
            kept.append(root)
    return kept


def _nodes(count: int) -> Array:
    """Chebyshev-Lobatto nodes from -1 to 1, rising."""
    return np.asarray(-np.cos(np.pi * np.arange(count) / (count - 1)))


def _middles(count: int) -> Array:
    """Points between these nodes."""
    return np.asarray(-np.cos(np.pi * (np.arange(count - 1) + 0.5) / (count - 1)))


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
