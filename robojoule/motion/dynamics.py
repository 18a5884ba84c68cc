"""Inverse dynamics: at states, and projected on joint-space paths.

Along a path the rigid-body joint torques are m(s) s'' + c(s) s'^2 + g(s) (see `robojoule.motion.path`). Inverse
dynamics at a few path nodes therefore describes a motion at every speed limit at once. On a straight line the three
are entire functions of s (sums of sines and cosines of the joint angles), so a Chebyshev series through K nodes
represents them to rounding once K exceeds the sum w of the joint changes in radians by a margin: its coefficients fall
as (w / 2)^k / k!. A first joint about the vertical turns the arm without changing its torques, so it does not count.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.motion.path import Path
from robojoule.robots.mechanism import installed_pinocchio
from robojoule.robots.recursion import path_points
from robojoule.robots.robot import Robot

DynamicsEngine = Literal["pinocchio", "recursion"]
NODE_LADDER = np.array([13, 17, 21, 29, 41, 57, 81, 113, 161, 225])  # few steps: motions of one step run together
LIMIT_NODES = 29  # path positions at least where torque limits are looked at
_FACTOR_NODES = 2  # further nodes for each degree of the slopes of a curved path: their squares are factors
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
        values_s: These path positions, shape (M, L). [-]
    """

    counts: Index
    coefficients: Array
    values: Array
    values_s: Array

    def of(self, rows: Index | slice) -> PathTorques:
        """Those of some of the motions."""
        return PathTorques(self.counts[rows], self.coefficients[rows], self.values[rows], self.values_s[rows])

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


def node_counts(robot: Robot, travel_rad: Array, degree: int = 1) -> Index:
    """Numbers of nodes that represent the torques along paths to rounding, shape (M,).

    Args:
        robot: The robot.
        travel_rad: Joint travels of straight paths, or the largest slopes of curved ones, shape (M, n). [rad]
        degree: Degree of the paths. Slopes and curvature of curved ones are factors of the torques, so the series must
            be longer by their degrees.
    """
    mechanism = robot.mechanism
    across = np.cross(mechanism.placements[0].rotation @ mechanism.axes[0], mechanism.gravity_m_s2)
    turning = (travel_rad[:, 1:] if np.allclose(across, 0.0, atol=1e-12) else travel_rad).sum(axis=1)
    factors = np.arange(1, NODE_LADDER[-1] + 1)
    with np.errstate(divide="ignore"):
        left = NODE_LADDER - _FACTOR_NODES * (degree - 1)
        terms = np.maximum(left, 1)
        decay = np.log(turning / 2.0)[:, None] * terms - np.cumsum(np.log(factors))[terms - 1]
    enough = (decay <= np.log(SERIES_TOLERANCE)) & (left >= 1)
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


def inverse_dynamics(robot: Robot, q: Array, qd: Array, qdd: Array, *, engine: DynamicsEngine | None = None) -> Array:
    """Rigid-body joint torques (no friction, no rotor inertia).

    Args:
        robot: Robot with its payload.
        q: Positions, shape (N, n). [rad]
        qd: Velocities, shape (N, n). [rad/s]
        qdd: Accelerations, shape (N, n). [rad/s2]
        engine: What computes them: Pinocchio or the recursion along paths; if not given, Pinocchio where it is
            installed.

    Returns:
        Torques, shape (N, n). [Nm]

    Raises:
        MissingPackage: Pinocchio is asked for and not installed.
    """
    if len(q) == 0:
        return np.zeros_like(q)
    if engine == "recursion" or (engine is None and installed_pinocchio() is None):
        inertial = path_points(robot.mechanism, q.T, qdd.T)[0]
        _, centrifugal, gravity = path_points(robot.mechanism, q.T, qd.T)
        return np.ascontiguousarray((inertial + centrifugal + gravity).T)
    model = robot.model
    pin: Any = installed_pinocchio()
    columns = (np.asfortranarray(x.T) for x in (q, qd, qdd))
    # Pinocchio gives a flat array for a single joint.
    return np.ascontiguousarray(pin.rneaInParallel(1, pin.ModelPool(model, 1), *columns).T.reshape(q.shape))


def _at_points(robot: Robot, q: Array, along: Array, engine: DynamicsEngine) -> Array:
    """m, c and g at path points, arguments and result as of `path_points`."""
    if engine == "recursion":
        return path_points(robot.mechanism, q, along)
    q, along = q.T, along.T
    none = np.zeros_like(q)
    states = ((none, along), (along, none), (none, none))
    torques = np.stack([inverse_dynamics(robot, q, *state, engine=engine).T for state in states])
    torques[:2] -= torques[2]
    return torques


def path_torques(
    robot: Robot, path: Path, count: int | None = None, *, engine: DynamicsEngine = "recursion"
) -> PathTorques:
    """Project the inverse dynamics on M paths.

    Args:
        robot: Robot with its payload.
        path: The paths.
        count: Number of nodes; as many as represent each path to rounding if not given.
        engine: What computes the torques at the nodes.

    Raises:
        MissingPackage: Pinocchio is asked for and not installed.
    """
    motions, joints = path.start_rad.shape
    counts = node_counts(robot, path.steepest_rad, path.degree) if count is None else np.full(motions, count)
    width = int(counts.max(initial=0))
    groups = [np.flatnonzero(counts == k) for k in np.unique(counts)]
    steps = [chebyshev_nodes(int(counts[rows[0]])) for rows in groups]
    points, along = [np.zeros((joints, 0))], [np.zeros((joints, 0))]
    for rows, nodes in zip(groups, steps, strict=True):
        at = path.positions_rad(rows, nodes)
        points.append(at.reshape(joints, -1))
        along.append(np.broadcast_to(path.slopes_rad(rows, nodes).swapaxes(0, 1), at.shape).reshape(joints, -1))
    torques = _at_points(robot, np.concatenate(points, 1), np.concatenate(along, 1), engine)
    if path.degree > 1:
        bending = [np.zeros((joints, 0))]
        for rows, nodes in zip(groups, steps, strict=True):
            bending.append(path.curvatures_rad(rows, nodes).swapaxes(0, 1).reshape(joints, -1))
        torques[1] += _at_points(robot, np.concatenate(points, 1), np.concatenate(bending, 1), engine)[0]
    coefficients = np.zeros((motions, 3 * joints, width))
    limit_nodes = np.maximum(LIMIT_NODES, 2 * counts - LIMIT_NODES // 2 + 1)
    values = np.zeros((motions, 3 * joints, int(limit_nodes.max(initial=0))))
    values_s = np.ones((motions, values.shape[2]))
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
        values_s[rows, : len(looked_at)] = looked_at
    return PathTorques(counts, coefficients, values, values_s)
