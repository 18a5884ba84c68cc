"""Inverse kinematics: all joint positions within the limits that bring the tool of a six-axis arm to a pose.

Arms whose second and third axis are parallel are solved by geometry (`robojoule.robots.arm_geometry`): closed where
the wrist is spherical or the fourth axis is parallel, too (Universal Robots), by a search in one angle where the fourth
and fifth axis meet (FANUC CRX). Every other arm is solved by Newton steps from many starts, which finds most solutions
but proves nothing. Newton steps on the arm's own kinematics end every way: what is returned meets the pose.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Mask, as_array
from robojoule.errors import InputError
from robojoule.robots.arm_geometry import geometry_of
from robojoule.robots.mechanism import Mechanism
from robojoule.robots.rigid_body import Placement, product
from robojoule.robots.robot import Robot

JOINTS = 6
STARTS = 400  # of Newton steps on arms without a closed form
_STEPS, _POLISHING = 60, 12
_MET = 1e-9  # residual of a pose that is met [m, rad]
_ROUNDED = 2e-5  # and of one that only rounding has put out of reach or beyond a limit: vendors write 0.001 mm and deg
_SAME_RAD = 1e-6  # solutions nearer than that are one
_AMBIGUOUS_RAD = 0.02  # round a solution that is met, others that are not quite are its shadows
_SEED = 20240913


def joints_for_pose(
    robot: Robot, pose: Placement, *, tool: Placement | None = None, near_rad: ArrayLike | None = None
) -> Array:
    """All joint positions within the limits that bring the tool to a pose, whole turns of joints included.

    Where a joint is free (a wrist stretched out, a wrist centre above axis 1), it stays where it was nearby.

    Args:
        robot: A six-axis arm.
        pose: Where the tool is to be in the base frame. [m]
        tool: Placement of the tool on the robot's own tool frame, its flange; that frame itself if not given. [m]
        near_rad: Joint positions to begin with the nearest to, shape (6,); home if not given. [rad]

    Returns:
        Joint positions, shape (k, 6), k >= 1, the nearest first (by the root of the sum of squares). [rad]

    Raises:
        InputError: Another number of joints, a pose out of reach, or one that is reached beyond joint limits only.
    """
    if robot.joint_count != JOINTS:
        problem = f"{robot.name} has {robot.joint_count} joints: poses need a six-axis arm"
        raise InputError(problem, file=robot.source, allowed="joint positions")
    near = robot.home_rad if near_rad is None else as_array(near_rad, "near_rad", "joint positions")
    if near.shape != (JOINTS,) or not np.isfinite(near).all():
        raise InputError("joint positions to be near to must be six numbers", key="near_rad")
    if not (np.isfinite(pose.origin_m).all() and np.isfinite(pose.rotation).all()):
        raise InputError("the pose holds numbers that are not finite", key="pose")
    flange = pose if tool is None else pose @ inverse_of(tool)
    found = _distinct(robot.mechanism, flange, _candidates(robot, flange, near))
    where = ", ".join(f"{value * 1e3:.1f}" for value in flange.origin_m)
    if not len(found):
        problem = f"{robot.name} cannot bring its flange to x, y, z = {where} mm in this orientation"
        raise InputError(problem, allowed="a pose within reach")
    within = _turns_within(robot, found)
    if not len(within):
        raise InputError(_beyond(robot, found, where), allowed="a pose within the joint limits")
    return within[np.argsort(np.linalg.norm(within - near, axis=1), kind="stable")]


def inverse_of(placement: Placement) -> Placement:
    """Where the other frame is in the one that is placed in it."""
    turned = placement.rotation.T
    return Placement(turned, -(turned @ placement.origin_m))


def flange_placement(robot: Robot, q_rad: ArrayLike) -> Placement:
    """Where the robot's own tool frame is at joint positions of shape (n,) [rad]."""
    rotations, origins, _, _ = tool_kinematics(robot.mechanism, np.asarray(q_rad, dtype=float)[None])
    return Placement(rotations[..., 0], origins[0])


def _candidates(robot: Robot, flange: Placement, near: Array) -> Array:
    """Joint positions, shape (N, 6), near every solution. [rad]"""
    geometry = geometry_of(robot.mechanism)
    closed = geometry.solutions(flange, near)
    if closed is not None:
        return closed
    random = np.random.default_rng(_SEED).uniform(-math.pi, math.pi, (STARTS, JOINTS))
    starts = np.vstack([near, random])
    return _newton(robot.mechanism, flange, starts, _STEPS)


def _distinct(mechanism: Mechanism, flange: Placement, candidates: Array) -> Array:
    """Candidates that meet the pose, each once, angles from -pi to pi, shape (N, 6). [rad]"""
    if not len(candidates):
        return candidates
    q = _newton(mechanism, flange, candidates, _POLISHING)
    residual = np.abs(_residual(mechanism, flange, q)[0]).max(axis=1)
    order = np.argsort(residual, kind="stable")
    found: list[Array] = []
    for row in order[residual[order] <= _ROUNDED]:
        apart = [np.abs(_wrapped(q[row] - other)).max() for other in found]
        if not apart or min(apart) > (_SAME_RAD if residual[row] <= _MET else _AMBIGUOUS_RAD):
            found.append(q[row])
    return _wrapped(np.array(found).reshape(-1, JOINTS))


def _turns_within(robot: Robot, found: Array) -> Array:
    """Every combination of whole turns that is within the limits, shape (N, 6). [rad]"""
    rows: list[Array] = []
    for q in found:
        ways = []
        for value, lower, upper in zip(q, robot.lower_rad, robot.upper_rad, strict=True):
            first = math.ceil((lower - _ROUNDED - value) / math.tau)
            last = math.floor((upper + _ROUNDED - value) / math.tau)
            ways.append([min(max(value + turn * math.tau, lower), upper) for turn in range(first, last + 1)])
        if all(ways):
            rows += list(np.stack(np.meshgrid(*ways, indexing="ij"), axis=-1).reshape(-1, JOINTS))
    return np.array(rows).reshape(-1, JOINTS)


def _beyond(robot: Robot, found: Array, where: str) -> str:
    """What to say of a pose whose solutions are all beyond limits: the joint of the one that is least so."""
    middle = 0.5 * (robot.lower_rad + robot.upper_rad)
    turned = found + math.tau * np.round((middle - found) / math.tau)
    excess = np.maximum(robot.lower_rad - turned, turned - robot.upper_rad)
    row = int(np.argmin(np.maximum(excess, 0.0).max(axis=1)))
    joint = int(np.argmax(excess[row]))
    degrees = math.degrees(turned[row, joint])
    return f"the flange reaches x, y, z = {where} mm only with {robot.joint_names[joint]} at {degrees:.2f} deg or so"


def _wrapped(angles: Array) -> Array:
    """Angles from -pi to pi. [rad]"""
    return np.asarray(angles - math.tau * np.round(angles / math.tau))


def tool_kinematics(mechanism: Mechanism, q: Array) -> tuple[Array, Array, Array, Array]:
    """Tool rotations (3, 3, N), tool origins (N, 3) [m], axes (N, n, 3) and points on them (N, n, 3) [m]."""
    rotations, origins = mechanism.body_placements(q)
    turned = np.einsum("jrcN,jc->Njr", rotations[1:], mechanism.axes)
    at = mechanism.tool_body
    tool = origins[at] + product(rotations[at], mechanism.tool.origin_m[:, None, None])[:, 0]
    orientation = product(rotations[at], mechanism.tool.rotation[..., None])
    return orientation, tool.T, turned, origins[1:].transpose(2, 0, 1)


def _residual(mechanism: Mechanism, flange: Placement, q: Array) -> tuple[Array, Array]:
    """What is missing to the pose (N, 6) [m, rad], and how it changes with the joints (N, 6, n)."""
    rotations, origins, axes, points = tool_kinematics(mechanism, q)
    missing = np.einsum("ij,kjN->Nik", flange.rotation, rotations)
    return missing_to(missing, flange.origin_m, origins, axes, points)


def missing_to(missing: Array, wanted_m: Array, origins: Array, axes: Array, points: Array) -> tuple[Array, Array]:
    """What is missing to poses (N, 6) [m, rad], and how it changes with the joints (N, 6, n).

    Args:
        missing: Rotations from those that are there to those that are wanted, in base axes, shape (N, 3, 3). [-]
        wanted_m: Where the tool's origin is wanted, shape (3,) or (N, 3). [m]
        origins: Where it is, and the joints' axes and points on them, as of `tool_kinematics`. [m]
        axes: Shape (N, n, 3). [-]
        points: Shape (N, n, 3). [m]
    """
    turn = np.stack(
        [
            missing[:, 2, 1] - missing[:, 1, 2],
            missing[:, 0, 2] - missing[:, 2, 0],
            missing[:, 1, 0] - missing[:, 0, 1],
        ],
        axis=1,
    )
    double_sine = np.linalg.norm(turn, axis=1)
    angle = np.arctan2(double_sine, np.trace(missing, axis1=1, axis2=2) - 1.0)
    scale = np.where(double_sine > 1e-12, angle / np.maximum(double_sine, 1e-12), 0.5)
    residual = np.hstack([wanted_m - origins, turn * scale[:, None]])
    jacobian = np.concatenate([np.cross(axes, origins[:, None] - points), axes], axis=2).transpose(0, 2, 1)
    return residual, jacobian


def _newton(mechanism: Mechanism, flange: Placement, q: Array, steps: int) -> Array:
    """Damped Newton steps from all starts at once, shape (N, 6). [rad]"""
    q = np.array(q)
    pending: Mask = np.ones(len(q), dtype=bool)
    for _ in range(steps):
        residual, jacobian = _residual(mechanism, flange, q[pending])
        squares = np.einsum("Ni,Ni->N", residual, residual)
        open_ones = squares > 1e-26
        rows = np.flatnonzero(pending)
        pending[rows[~open_ones]] = False
        if not open_ones.any():
            break
        residual, jacobian, squares = residual[open_ones], jacobian[open_ones], squares[open_ones]
        transposed = jacobian.transpose(0, 2, 1)
        normal = transposed @ jacobian + (0.01 * squares + 1e-14)[:, None, None] * np.eye(JOINTS)
        step = np.linalg.solve(normal, transposed @ residual[..., None])[..., 0]
        longest = np.abs(step).max(axis=1, keepdims=True)
        q[rows[open_ones]] += step / np.maximum(longest / 0.5, 1.0)
    return q
