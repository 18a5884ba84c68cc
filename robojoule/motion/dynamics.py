"""Inverse dynamics projected on straight joint-space paths.

Along q(s) = q0 + s dq the rigid-body joint torques are

    tau(s) = m(s) s'' + c(s) s'^2 + g(s) ,   m = M(q(s)) dq ,  c = C(q(s), dq) dq ,  g = gravity .

Inverse dynamics at a few path nodes therefore describes a motion at every speed limit at once. The three functions are
entire functions of s (sums of sines and cosines of the joint angles), so a Chebyshev series through K nodes represents
them to rounding once K exceeds the sum w of the joint changes in radians by a margin: its coefficients fall as
(w / 2)^k / k!. A first joint about the vertical turns the arm without changing its torques, so that it does not count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robojoule.arrays import Array
from robojoule.motion.recursion import joint_axis, path_points
from robojoule.robots.robot import Robot

NODE_LADDER = np.array([13, 17, 21, 29, 41, 57, 81, 113, 161, 225])  # few steps: motions of one step run together
LIMIT_NODES = 29  # path positions at least where torque limits are looked at
SERIES_TOLERANCE = 1e-9  # of the first neglected coefficient, relative to an amplitude at the highest frequency


@dataclass(frozen=True)
class PathTorques:
    """Chebyshev series (first kind, over x = 2 s - 1) of m, c and g for M motions.

    Attributes:
        counts: Number of nodes and coefficients of each motion, shape (M,).
        coefficients: Coefficients of m [Nm s2], c [Nm s2] and g [Nm], joint by joint, zeros behind those of the motion,
            shape (M, 3 n, K), K being the largest of the counts.
        values: m, c and g at path positions from 0 to 1, at least 29, where torque limits are looked at, likewise with
            the last position repeated up to L, the largest of their numbers, shape (M, 3 n, L).
    """

    counts: NDArray[np.intp]
    coefficients: Array
    values: Array

    @property
    def at_nodes(self) -> tuple[Array, Array, Array]:
        """Values of m [Nm s2], c [Nm s2] and g [Nm], three arrays of shape (M, L, n)."""
        inertia, velocity, gravity = np.split(self.values.swapaxes(1, 2), 3, axis=2)
        return inertia, velocity, gravity

    def _part(self, index: int) -> Array:
        return np.split(self.coefficients.swapaxes(1, 2), 3, axis=2)[index]

    @property
    def inertia_nm_s2(self) -> Array:
        """Coefficients of m, shape (M, K, n). [Nm s2]"""
        return self._part(0)

    @property
    def velocity_nm_s2(self) -> Array:
        """Coefficients of c, shape (M, K, n). [Nm s2]"""
        return self._part(1)

    @property
    def gravity_nm(self) -> Array:
        """Coefficients of g, shape (M, K, n). [Nm]"""
        return self._part(2)

    @property
    def nodes_s(self) -> Array:
        """Path positions of K nodes, enough for every motion, shape (K,). [-]"""
        return chebyshev_nodes(self.coefficients.shape[2])


def node_counts(robot: Robot, delta_rad: Array) -> NDArray[np.intp]:
    """Numbers of nodes that represent paths with joint changes (M, n) [rad] to rounding, shape (M,)."""
    joint, gravity = robot.model.joints[1], robot.model.gravity.linear
    vertical = np.cross(robot.model.jointPlacements[1].rotation @ joint_axis(joint), gravity)
    turning = np.abs(delta_rad[:, 1:] if np.allclose(vertical, 0.0, atol=1e-12) else delta_rad).sum(axis=1)
    factors = np.arange(1, NODE_LADDER[-1] + 1)
    with np.errstate(divide="ignore"):
        decay = np.log(turning / 2.0)[:, None] * NODE_LADDER - np.cumsum(np.log(factors))[NODE_LADDER - 1]
    enough = decay <= np.log(SERIES_TOLERANCE)
    far = np.ceil(NODE_LADDER[-1] + 2.0 * turning).astype(np.intp)
    return np.asarray(np.where(enough.any(axis=1), NODE_LADDER[enough.argmax(axis=1)], far))


def chebyshev_nodes(count: int) -> Array:
    """Chebyshev-Lobatto nodes mapped to [0, 1], rising, both ends included, shape (count,). [-]"""
    return np.asarray((1.0 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2.0)


def chebyshev_basis(s: Array, count: int) -> Array:
    """Chebyshev polynomials T_0 .. T_{count-1} at x = 2 s - 1.

    Args:
        s: Path positions, any shape. [-]
        count: Number of polynomials.

    Returns:
        Shape (*s.shape, count).
    """
    x = 2.0 * s - 1.0
    twice = 2.0 * x
    basis = np.empty((count, *np.shape(s)))
    basis[0] = 1.0
    if count > 1:
        basis[1] = x
    for k in range(2, count):
        np.multiply(twice, basis[k - 1], out=basis[k])
        basis[k] -= basis[k - 2]
    return np.moveaxis(basis, 0, -1)


def inverse_dynamics(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    """Rigid-body joint torques (no friction, no rotor inertia).

    Args:
        robot: Robot with its payload.
        q: Positions, shape (N, n). [rad]
        qd: Velocities, shape (N, n). [rad/s]
        qdd: Accelerations, shape (N, n). [rad/s2]

    Returns:
        Torques, shape (N, n). [Nm]
    """
    if len(q) == 0:
        return np.zeros_like(q)
    pool = pin.ModelPool(robot.model, 1)
    columns = (np.asfortranarray(x.T) for x in (q, qd, qdd))
    # Pinocchio gives a flat array for a single joint.
    return np.ascontiguousarray(pin.rneaInParallel(1, pool, *columns).T.reshape(q.shape))


def path_torques(robot: Robot, start_rad: Array, delta_rad: Array, count: int | None = None) -> PathTorques:
    """Project the inverse dynamics on M straight paths.

    Args:
        robot: Robot with its payload.
        start_rad: Start configurations, shape (M, n). [rad]
        delta_rad: Joint changes, shape (M, n). [rad]
        count: Number of nodes; as many as represent each path to rounding if not given.
    """
    motions, joints = start_rad.shape
    counts = node_counts(robot, delta_rad) if count is None else np.full(motions, count)
    width = int(counts.max(initial=0))
    groups = [np.flatnonzero(counts == k) for k in np.unique(counts)]
    steps = [chebyshev_nodes(int(counts[rows[0]])) for rows in groups]
    points = [
        (start_rad[rows].T[..., None] + delta_rad[rows].T[..., None] * nodes).reshape(joints, -1)
        for rows, nodes in zip(groups, steps, strict=True)
    ]
    along = [np.repeat(delta_rad[rows].T, len(nodes), axis=1) for rows, nodes in zip(groups, steps, strict=True)]
    empty = np.zeros((joints, 0))
    torques = path_points(robot.model, np.concatenate([*points, empty], 1), np.concatenate([*along, empty], 1))
    coefficients = np.zeros((motions, 3 * joints, width))
    limit_nodes = np.maximum(LIMIT_NODES, 2 * counts - LIMIT_NODES // 2 + 1)
    values = np.zeros((motions, 3 * joints, int(limit_nodes.max(initial=0))))
    first = 0
    for rows, nodes in zip(groups, steps, strict=True):
        k = len(nodes)
        part = torques[..., first : first + len(rows) * k].reshape(3 * joints, len(rows), k).swapaxes(0, 1)
        first += len(rows) * k
        series = np.matmul(part, np.linalg.inv(chebyshev_basis(nodes, k)).T)
        coefficients[rows, :, :k] = series
        looked_at = chebyshev_nodes(int(limit_nodes[rows[0]]))
        at = np.matmul(series, chebyshev_basis(looked_at, k).T)
        values[rows, :, : len(looked_at)], values[rows, :, len(looked_at) :] = at, at[:, :, -1:]
    return PathTorques(counts, coefficients, values)
