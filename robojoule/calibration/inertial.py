"""Inertial figures of the moving bodies as a few unknowns: directions in which errors of the figures change torques.

A body has ten parameters (mass, first moments, inertia about the joint's origin), most of which no torque reveals. The
errors expected of published figures (relative errors of mass, centre and extent, see `InertiaErrors`) span a cloud of
parameter vectors; of its principal axes, weighted by the torques that they change relative to the effort limits, the
first few carry nearly all. Their coordinates are independent with variance 1 under the expected errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.robots.recursion import path_regressors
from robojoule.robots.rigid_body import BODY_PARAMETERS, RigidBody
from robojoule.robots.robot import Robot

_CONFIGURATIONS = 60
_ERRORS = 240
_SEED = 20240229


@dataclass(frozen=True)
class InertiaErrors:
    """Relative errors of one body's figures.

    Attributes:
        mass: Of the mass. [-]
        center: Of each coordinate of the centre of mass, shape (3,). [-]
        extent: Of the mass's mean square extent along each axis, shape (3,). [-]
    """

    mass: float
    center: Array
    extent: Array

    def applied(self, body: RigidBody) -> RigidBody:
        """Body with these errors.

        The second moments of the mass about its centre, S = tr(I)/2 1 - I, become D S D with a diagonal D: whatever
        the errors, S stays positive semi-definite, so the body stays physical.
        """
        if body.mass_kg <= 0.0:
            return body
        inertia = body.inertia_kg_m2
        moments = np.trace(inertia) / 2.0 * np.eye(3) - inertia
        scale = np.sqrt((1.0 + self.mass) * (1.0 + self.extent))
        moments = scale[:, None] * moments * scale
        return RigidBody(
            body.mass_kg * (1.0 + self.mass),
            body.center_m * (1.0 + self.center),
            np.trace(moments) * np.eye(3) - moments,
        )


def draw_errors(rng: np.random.Generator, spread: float) -> InertiaErrors:
    """Draw errors uniformly within +-`spread`. [-]"""
    values = rng.uniform(-spread, spread, 7)
    return InertiaErrors(float(values[0]), values[1:4], values[4:7])


def inertial_directions(robot: Robot, count: int, spread: float) -> Array:
    """Directions of the bodies' parameters with unit variance under errors within +-`spread`.

    Args:
        robot: Nominal robot; what it carries plays no part.
        count: Number of directions kept.
        spread: Largest relative error. [-]

    Returns:
        Changes of the parameters of all bodies, one after another, shape (10 n, r), r <= count.
    """
    bare = Robot(robot.file)
    joints = bare.joint_count
    rng = np.random.default_rng(_SEED)
    width = BODY_PARAMETERS * joints
    covariance = np.zeros((width, width))  # bodies are independent
    for joint, body in enumerate(bare.mechanism.bodies):
        cloud = np.stack([draw_errors(rng, spread).applied(body).parameters - body.parameters for _ in range(_ERRORS)])
        block = slice(BODY_PARAMETERS * joint, BODY_PARAMETERS * (joint + 1))
        covariance[block, block] = np.cov(cloud.T)
    states = []
    for _ in range(_CONFIGURATIONS):
        q = rng.uniform(np.maximum(bare.lower_rad, -np.pi), np.minimum(bare.upper_rad, np.pi))
        v = rng.uniform(-0.5, 0.5, joints) * bare.velocity_rad_s
        states.append((q, v, rng.uniform(-1.0, 1.0, joints) * bare.velocity_rad_s / 0.2))
    q, v, acceleration = np.array(states).transpose(1, 2, 0)
    inertia = path_regressors(bare.mechanism, q, acceleration, np.eye(width))[0]
    _, velocity, gravity = path_regressors(bare.mechanism, q, v, np.eye(width))
    torques = np.stack([gravity, gravity + velocity, gravity + inertia]) / bare.effort_nm[:, None, None]
    regressors = torques.transpose(3, 0, 1, 2).reshape(-1, width)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    _, seen, axes = np.linalg.svd(regressors @ root, full_matrices=False)
    kept = axes[: min(count, int((seen > 1e-9 * seen[0]).sum()))]
    directions = root @ kept.T
    largest = np.abs(directions).argmax(axis=0)
    return np.asarray(directions * np.sign(directions[largest, np.arange(directions.shape[1])]))
