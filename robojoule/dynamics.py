"""Inverse dynamics projected on straight joint-space paths.

Along q(s) = q0 + s dq the rigid-body joint torques are

    tau(s) = m(s) s'' + c(s) s'^2 + g(s) ,   m = M(q(s)) dq ,  c = C(q(s), dq) dq ,  g = gravity .

Three inverse-dynamics calls per path node therefore describe a motion at every speed limit at once. The three functions
are entire functions of s (sums of sines and cosines of the joint angles), so a Chebyshev series through K nodes
represents them to rounding once K exceeds the sum of the joint changes in radians by a margin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from robojoule.drive import Array
from robojoule.robots.robot import Robot

NODE_LADDER = (29, 65, 129, 257)  # few steps, so that a motion's figures hardly ever depend on its companions
NODE_MARGIN = 17  # coefficients behind the highest frequency: the series then falls below rounding
NODES_PER_RAD = 2.0


@dataclass(frozen=True)
class PathTorques:
    """Chebyshev coefficients (first kind, over x = 2 s - 1) of m, c and g for M motions.

    Attributes:
        inertia_nm_s2: Coefficients of m, shape (M, K, n). [Nm s2]
        velocity_nm_s2: Coefficients of c, shape (M, K, n). [Nm s2]
        gravity_nm: Coefficients of g, shape (M, K, n). [Nm]
        nodes_s: Path positions of the nodes, shape (K,). [-]
        at_nodes: m, c and g at the nodes, three arrays of shape (M, K, n).
    """

    inertia_nm_s2: Array
    velocity_nm_s2: Array
    gravity_nm: Array
    nodes_s: Array
    at_nodes: tuple[Array, Array, Array]


def node_count(delta_rad: Array) -> int:
    """Number of nodes that represents paths with these joint changes (M, n) to rounding."""
    travel = float(np.abs(delta_rad).sum(axis=1).max()) if delta_rad.size else 0.0
    needed = NODE_MARGIN + NODES_PER_RAD * travel
    return next((count for count in NODE_LADDER if count >= needed), int(np.ceil(needed)))


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
    basis = np.empty((count, *np.shape(s)))
    basis[0] = 1.0
    if count > 1:
        basis[1] = x
    for k in range(2, count):
        np.multiply(2.0 * x, basis[k - 1], out=basis[k])
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
    return np.ascontiguousarray(pin.rneaInParallel(1, pool, *columns).T)


def path_torques(robot: Robot, start_rad: Array, delta_rad: Array, count: int | None = None) -> PathTorques:
    """Project the inverse dynamics on M straight paths.

    Args:
        robot: Robot with its payload.
        start_rad: Start configurations, shape (M, n). [rad]
        delta_rad: Joint changes, shape (M, n). [rad]
        count: Number of nodes; as many as represent the paths to rounding if not given.
    """
    count = count or node_count(delta_rad)
    nodes = chebyshev_nodes(count)
    motions, joints = start_rad.shape
    q = (start_rad[:, None, :] + nodes[None, :, None] * delta_rad[:, None, :]).reshape(-1, joints)
    along = np.repeat(delta_rad, count, axis=0)
    zero = np.zeros_like(q)
    gravity = inverse_dynamics(robot, q, zero, zero)
    inertia = inverse_dynamics(robot, q, zero, along) - gravity
    velocity = inverse_dynamics(robot, q, along, zero) - gravity
    shape = (motions, count, joints)
    at_nodes = (inertia.reshape(shape), velocity.reshape(shape), gravity.reshape(shape))
    to_coefficients = np.linalg.inv(chebyshev_basis(nodes, count))
    m, c, g = (np.matmul(to_coefficients, values) for values in at_nodes)
    return PathTorques(m, c, g, nodes, at_nodes)
