"""Newton-Euler recursion along joint-space paths, for many path points at once.

The joint torques along a path of slope dq are m s'' + c s'^2 + g (see `robojoule.motion.path`), m being linear and c
quadratic in dq: with an acceleration in its place m is what that takes, with a velocity c is. The twist of a link under
joint velocities dq is also its acceleration under joint accelerations dq from rest, so one outward pass over the links
carries all that the three need: twist, velocity-product acceleration and gravity in link axes; one inward pass collects
the wrenches. Every operation works on whole arrays of path points, element by element, so that the
torques at a point do not depend on the points beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.robots.mechanism import Mechanism
from robojoule.robots.rigid_body import BODY_PARAMETERS

Factor = float | Array
Vector = list[Array]  # three Cartesian components, each of shape (..., N)

_NEGLIGIBLE = 1e-15  # entries of rotations by right angles that are zero but for rounding
_SQUARE = np.array([[0, 1, 3], [1, 2, 4], [3, 4, 5]])  # places of the inertia among xx, xy, yy, xz, yz, zz
_BLOCK = 2048  # path points at once: keeps the work arrays in the processor's cache


@dataclass(frozen=True)
class _Link:
    """A moving body in axes that are turned so that its joint turns about z.

    Inertial figures are numbers, or arrays of shape (r, 1) of r sets of figures at once.

    Attributes:
        rotation: From body axes at joint angle zero to those of the body before it, three rows. [-]
        offset_m: Joint origin in the axes of the body before it, three numbers. [m]
        mass_kg: Mass. [kg]
        moment_kg_m: Mass times centre of mass, three. [kg m]
        inertia_kg_m2: Inertia about the joint origin, three rows. [kg m2]
        carried_kg: Mass of this body and all behind it. [kg]
    """

    rotation: list[list[Factor]]
    offset_m: list[Factor]
    mass_kg: Factor
    moment_kg_m: list[Factor]
    inertia_kg_m2: list[list[Factor]]
    carried_kg: Factor


def path_points(mechanism: Mechanism, q: Array, along: Array) -> Array:
    """m, c and g at path points.

    Args:
        mechanism: The arm's mechanism.
        q: Joint positions, shape (n, N). [rad]
        along: Joint changes dq along the path, shape (n, N). [rad]

    Returns:
        m [Nm s2], c [Nm s2] and g [Nm], shape (3, n, N).
    """
    result = np.empty((3, *q.shape))
    links = _links(mechanism)
    for first in range(0, q.shape[1], _BLOCK):
        block = slice(first, first + _BLOCK)
        _recursion(links, mechanism.gravity_m_s2, q[:, block], along[:, block], result[:, :, block])
    return result


def path_regressors(mechanism: Mechanism, q: Array, along: Array, directions: Array) -> Array:
    """m, c and g at path points, per unit of each of r changes of the bodies' parameters.

    Torques are linear in these parameters, so these are the torques of bodies whose parameters are the changes.

    Args:
        mechanism: The arm's mechanism; its bodies play no part.
        q: Joint positions, shape (n, N). [rad]
        along: Joint changes dq along the path, shape (n, N). [rad]
        directions: Changes of the parameters of all bodies (see `RigidBody.parameters`), shape (10 n, r).

    Returns:
        Shape (3, n, r, N).
    """
    joints, points = q.shape
    count = directions.shape[1]
    result = np.empty((3, joints, count, points))
    links = _links_of_changes(mechanism, directions)
    size = max(1, 4 * _BLOCK // max(count, 1))
    for first in range(0, points, size):
        block = slice(first, first + size)
        _recursion(links, mechanism.gravity_m_s2, q[:, None, block], along[:, None, block], result[..., block])
    return result


def mass_diagonal(mechanism: Mechanism, q: Array) -> Array:
    """Inertia that each joint feels while the others stand still, shapes (N, n) -> (N, n). [kg m2]"""
    points, joints = q.shape
    alone = np.repeat(np.eye(joints), points, axis=1)
    inertia = path_points(mechanism, np.tile(q.T, joints), alone)[0].reshape(joints, joints, points)
    return np.ascontiguousarray(np.einsum("jjp->pj", inertia))


def _frames(mechanism: Mechanism) -> Iterator[tuple[Array, list[list[Factor]], list[Factor]]]:
    """Of each joint: turned axes in the body's own, rotation and offset towards the turned axes before it."""
    before = np.eye(3)
    for placement, axis in zip(mechanism.placements, mechanism.axes, strict=True):
        turn = _to_z(axis)
        yield (
            turn,
            _clean(before.T @ placement.rotation @ turn).tolist(),
            _clean(before.T @ placement.origin_m).tolist(),
        )
        before = turn


def _links(mechanism: Mechanism) -> list[_Link]:
    carried = np.cumsum([body.mass_kg for body in mechanism.bodies[::-1]])[::-1].tolist()
    links = []
    for (turn, rotation, offset), body, mass in zip(_frames(mechanism), mechanism.bodies, carried, strict=True):
        lever = turn.T @ body.center_m
        about_origin = turn.T @ body.inertia_kg_m2 @ turn + body.mass_kg * (
            lever @ lever * np.eye(3) - np.outer(lever, lever)
        )
        links.append(
            _Link(
                rotation=rotation,
                offset_m=offset,
                mass_kg=body.mass_kg,
                moment_kg_m=_clean(body.mass_kg * lever).tolist(),
                inertia_kg_m2=_clean(about_origin).tolist(),
                carried_kg=mass,
            )
        )
    return links


def _links_of_changes(mechanism: Mechanism, directions: Array) -> list[_Link]:
    bodies = directions.reshape(mechanism.joint_count, BODY_PARAMETERS, -1, 1)
    carried = np.cumsum(bodies[::-1, 0], axis=0)[::-1]
    links = []
    for (turn, rotation, offset), body, mass in zip(_frames(mechanism), bodies, carried, strict=True):
        links.append(
            _Link(
                rotation=rotation,
                offset_m=offset,
                mass_kg=body[0],
                moment_kg_m=list(np.einsum("ji,jrx->irx", turn, body[1:4])),
                inertia_kg_m2=[list(row) for row in np.einsum("ki,lj,klrx->ijrx", turn, turn, body[4:][_SQUARE])],
                carried_kg=mass,
            )
        )
    return links


def _to_z(axis: Array) -> Array:
    """A rotation whose third column is the axis, with as many zeros as there can be."""
    helper = np.eye(3)[(int(np.argmax(np.abs(axis))) + 1) % 3]
    first = np.cross(helper, axis)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first), axis])


def _clean(values: Array) -> Array:
    nearest = np.round(values)
    return np.where(np.abs(values - nearest) <= _NEGLIGIBLE, nearest, values)


def _combined(factors: Sequence[Factor], vector: Vector) -> Array | None:
    """Sum of the components times constant factors; None if all factors are zero."""
    total: Array | None = None
    for factor, part in zip(factors, vector, strict=True):
        if not isinstance(factor, float):
            term = factor * part
        elif factor == 0.0:
            continue
        else:
            term = part if factor == 1.0 else -part if factor == -1.0 else factor * part
        total = term if total is None else total + term
    return total


def _times(matrix: Sequence[Sequence[Factor]], vector: Vector) -> Vector:
    """Constant matrix times vectors."""
    return [np.zeros_like(vector[0]) if x is None else x for x in (_combined(row, vector) for row in matrix)]


def _cross_constant(vector: Vector, constant: Sequence[Factor]) -> list[Array | None]:
    """Cross product vector x constant, None for components that are zero."""
    x, y, z = constant
    return [_combined(row, vector) for row in ((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))]


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
    base = [np.zeros((5, *q.shape[1:])) for _ in range(3)]
    for part, value in zip(base, gravity, strict=True):
        part[_G] = value
    cosines, sines = np.cos(q), np.sin(q)
    motions: list[Vector] = []
    wrenches: list[Vector] = []
    for i, link in enumerate(links):
        motion = _outward(link, motions[-1] if i else base, cosines[i], sines[i], along[i])
        motions.append(motion)
        wrenches.append(_body_wrench(link, motion))
    for i in range(len(links) - 1, -1, -1):
        link, wrench, (gx, gy, _) = links[i], wrenches[i], (part[_G] for part in motions[i])
        result[0, i], result[1, i] = wrench[2][_MOMENT]
        result[2, i] = wrench[1][_MASS] * gx - wrench[0][_MASS] * gy
        if i:
            x, y, z = wrench
            c, s = cosines[i], sines[i]
            inward = _times(link.rotation, [c * x - s * y, s * x + c * y, z])
            force = [part[_FORCE] for part in inward]
            _add(inward, _MOMENT, _cross_constant(force, link.offset_m), -1)
            for part, offset, total in zip(inward, link.offset_m, wrenches[i - 1], strict=True):
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
    x, y, z = _times(list(zip(*link.rotation, strict=True)), moved)
    motion = [c * x + s * y, c * y - s * x, z]
    motion[0][_BETA] += motion[1][_OMEGA] * along
    motion[1][_BETA] -= motion[0][_OMEGA] * along
    motion[2][_OMEGA] += along
    return motion


def _body_wrench(link: _Link, motion: Vector) -> Vector:
    """Wrench that moves the link itself, about its origin."""
    shape = np.broadcast_shapes(motion[0].shape, np.shape(link.mass_kg))
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
