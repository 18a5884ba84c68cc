"""Newton-Euler recursion along straight joint-space paths, for many path points at once.

The joint torques along q(s) = q0 + s dq are m(s) s'' + c(s) s'^2 + g(s) (see `robojoule.motion.dynamics`). The twist of
a link under joint velocities dq is also its acceleration under joint accelerations dq from rest, so one outward pass
over the links carries all that the three need: twist, velocity-product acceleration and gravity in link axes; one
inward pass collects the wrenches. Every operation works on whole arrays of path points, element by element, so that the
torques at a point do not depend on the points beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from robojoule.arrays import Array

Vector = list[Array]  # three Cartesian components, each of shape (..., N)

_NEGLIGIBLE = 1e-15  # entries of rotations by right angles that are zero but for rounding
_BLOCK = 2048  # path points at once: keeps the work arrays in the processor's cache


@dataclass(frozen=True)
class _Link:
    """A moving link in axes that are turned so that its joint turns about z.

    Attributes:
        parent: Index of the link before it, -1 for the base.
        rotation: From link axes at joint angle zero to the parent's axes, shape (3, 3). [-]
        offset_m: Joint origin in the parent's axes, shape (3,). [m]
        mass_kg: Mass. [kg]
        moment_kg_m: Mass times centre of mass, shape (3,). [kg m]
        inertia_kg_m2: Inertia about the joint origin, shape (3, 3). [kg m2]
        carried_kg: Mass of this link and all behind it. [kg]
    """

    parent: int
    rotation: Array
    offset_m: Array
    mass_kg: float
    moment_kg_m: Array
    inertia_kg_m2: Array
    carried_kg: float


def path_points(model: pin.Model, q: Array, along: Array) -> Array:
    """m, c and g at path points.

    Args:
        model: Robot of revolute joints.
        q: Joint positions, shape (n, N). [rad]
        along: Joint changes dq along the path, shape (n, N). [rad]

    Returns:
        m [Nm s2], c [Nm s2] and g [Nm], shape (3, n, N).
    """
    links, gravity = _links(model), np.asarray(model.gravity.linear)
    result = np.empty((3, *q.shape))
    for first in range(0, q.shape[1], _BLOCK):
        block = slice(first, first + _BLOCK)
        _recursion(links, gravity, q[:, block], along[:, block], result[:, :, block])
    return result


def _links(model: pin.Model) -> list[_Link]:
    turns = [np.eye(3)] + [_to_z(joint_axis(joint)) for joint in list(model.joints)[1:]]  # joint axes <- turned axes
    carried = [inertia.mass for inertia in model.inertias]
    for joint in range(model.njoints - 1, 0, -1):
        carried[model.parents[joint]] += carried[joint]
    links = []
    for joint in range(1, model.njoints):
        parent, turn = model.parents[joint], turns[joint]
        placement, inertia = model.jointPlacements[joint], model.inertias[joint]
        before = turns[parent].T
        lever = turn.T @ inertia.lever
        spread = lever @ lever * np.eye(3) - np.outer(lever, lever)
        links.append(
            _Link(
                parent=parent - 1,
                rotation=_clean(before @ placement.rotation @ turn),
                offset_m=_clean(before @ placement.translation),
                mass_kg=inertia.mass,
                moment_kg_m=_clean(inertia.mass * lever),
                inertia_kg_m2=_clean(turn.T @ inertia.inertia @ turn + inertia.mass * spread),
                carried_kg=carried[joint],
            )
        )
    return links


def joint_axis(joint: pin.JointModel) -> Array:
    """Axis of a revolute joint, from its motion at rest, shape (3,). [-]"""
    data = joint.createData()
    joint.calc(data, np.zeros(joint.nq))
    return np.asarray(data.S).ravel()[3:]


def _to_z(axis: Array) -> Array:
    """A rotation whose third column is the axis, with as many zeros as there can be."""
    helper = np.eye(3)[(int(np.argmax(np.abs(axis))) + 1) % 3]
    first = np.cross(helper, axis)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first), axis])


def _clean(values: Array) -> Array:
    nearest = np.round(values)
    return np.where(np.abs(values - nearest) <= _NEGLIGIBLE, nearest, values)


def _combined(weights: Array, vector: Vector) -> Array | None:
    """Sum of the components times constant weights; None if all weights are zero."""
    total: Array | None = None
    for weight, part in zip(weights.tolist(), vector, strict=True):
        if weight == 0.0:
            continue
        term = part if weight == 1.0 else -part if weight == -1.0 else weight * part
        total = term if total is None else total + term
    return total


def _times(matrix: Array, vector: Vector) -> Vector:
    """Constant matrix times vectors."""
    return [np.zeros_like(vector[0]) if x is None else x for x in (_combined(row, vector) for row in matrix)]


def _cross_constant(vector: Vector, constant: Array) -> list[Array | None]:
    """Cross product vector x constant, None for components that are zero."""
    x, y, z = constant
    return [_combined(np.array(row), vector) for row in ((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))]


def _cross(a: Vector, b: list[Array | None]) -> list[Array | None]:
    """Cross product a x b, None for components that are zero."""
    result: list[Array | None] = []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        first, second = b[j], b[i]
        plus = None if first is None else a[i] * first
        minus = None if second is None else a[j] * second
        result.append(plus if minus is None else -minus if plus is None else plus - minus)
    return result


def _add(target: Vector, channels: slice | int, terms: list[Array | None], sign: int = 1) -> None:
    for part, term in zip(target, terms, strict=True):
        if term is not None:
            if sign > 0:
                part[channels] += term
            else:
                part[channels] -= term


# Channels of the motion of a link, in its own axes at its own origin.
_OMEGA, _BETA, _V, _A, _G = range(5)  # twist (angular, linear), velocity-product acceleration, gravity
# Channels of the wrench that a joint carries: forces and moments of m and c, and the first mass moment for g.
_FORCE, _MOMENT, _MASS = slice(0, 2), slice(2, 4), 4


def _recursion(links: list[_Link], gravity: Array, q: Array, along: Array, result: Array) -> None:
    count = q.shape[1]
    base = [np.zeros((5, count)) for _ in range(3)]
    for part, value in zip(base, gravity, strict=True):
        part[_G] = value
    cosines, sines = np.cos(q), np.sin(q)
    motions: list[Vector] = []
    wrenches: list[Vector] = []
    for i, link in enumerate(links):
        before = base if link.parent < 0 else motions[link.parent]
        motion = _outward(link, before, cosines[i], sines[i], along[i])
        motions.append(motion)
        wrenches.append(_body_wrench(link, motion))
    for i in range(len(links) - 1, -1, -1):
        link, wrench, (gx, gy, _) = links[i], wrenches[i], (part[_G] for part in motions[i])
        result[0, i], result[1, i] = wrench[2][_MOMENT]
        result[2, i] = wrench[1][_MASS] * gx - wrench[0][_MASS] * gy
        if link.parent >= 0:
            x, y, z = wrench
            c, s = cosines[i], sines[i]
            inward = _times(link.rotation, [c * x - s * y, s * x + c * y, z])
            force = [part[_FORCE] for part in inward]
            _add(inward, _MOMENT, _cross_constant(force, link.offset_m), -1)
            for part, offset, total in zip(inward, link.offset_m, wrenches[link.parent], strict=True):
                if offset != 0.0:
                    part[_MASS] += link.carried_kg * offset
                total += part


def _outward(link: _Link, before: Vector, c: Array, s: Array, along: Array) -> Vector:
    """Motion of a link from that of the link before it."""
    moved = [part.copy() for part in before]
    angular = [part[: _BETA + 1] for part in before]
    arm = _cross_constant(angular, link.offset_m)
    _add(moved, slice(_V, _A + 1), arm)
    _add(moved, _A, _cross([part[_OMEGA] for part in before], [None if x is None else x[0] for x in arm]))
    x, y, z = _times(link.rotation.T, moved)
    motion = [c * x + s * y, c * y - s * x, z]
    motion[0][_BETA] += motion[1][_OMEGA] * along
    motion[1][_BETA] -= motion[0][_OMEGA] * along
    motion[2][_OMEGA] += along
    return motion


def _body_wrench(link: _Link, motion: Vector) -> Vector:
    """Wrench that moves the link itself, about its origin."""
    shape = motion[0].shape
    if link.mass_kg == 0.0 and not link.inertia_kg_m2.any():
        return [np.zeros(shape) for _ in range(3)]
    omega = [part[_OMEGA] for part in motion]
    arm = _cross_constant([part[:_G] for part in motion], link.moment_kg_m)
    spin = [_combined(row, [part[: _BETA + 1] for part in motion]) for row in link.inertia_kg_m2]
    wrench = []
    for part, moment in zip(motion, link.moment_kg_m, strict=True):
        own = np.zeros(shape)
        np.multiply(part[_V : _A + 1], link.mass_kg, out=own[_FORCE])
        own[_MASS] = moment
        wrench.append(own)
    _add(wrench, _FORCE, [None if x is None else x[: _BETA + 1] for x in arm])
    _add(wrench, 1, _cross(omega, [None if x is None else x[_OMEGA] for x in arm]))
    _add(wrench, _MOMENT, spin)
    _add(wrench, _MOMENT, [None if x is None else x[_V : _A + 1] for x in arm], -1)
    _add(wrench, 3, _cross(omega, [None if x is None else x[_OMEGA] for x in spin]))
    return wrench
