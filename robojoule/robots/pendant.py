"""Joint angles as the pendant of a robot shows them, against those of its model.

A pendant may count a joint in the other sense, from another zero, or include other joints (on FANUC's, J3 is the angle
of the forearm against the floor: it includes J2). Each robot file states what its pendant does, if it is known:

    model angle = zero + sense (pendant angle + pendant angles of the joints that are to be added)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.robots.pendant_file import PendantJointFile

if TYPE_CHECKING:
    from robojoule.robots.robot import Robot


@dataclass(frozen=True)
class PendantAngles:
    """The mapping of one robot of n joints.

    Attributes:
        matrix: Pendant to model, shape (n, n). [-]
        zero_rad: Model angles where the pendant shows zeros, shape (n,). [rad]
    """

    matrix: Array
    zero_rad: Array

    @classmethod
    def of(cls, robot: Robot) -> PendantAngles:
        """The mapping of a robot.

        Raises:
            InputError: Its file does not state it.
        """
        file = robot.file.pendant
        if file is None:
            problem = f"the file of {robot.name} does not say how its pendant counts"
            allowed = "angles of the model, or the key pendant in the robot file"
            raise InputError(problem, file=robot.source, key="pendant", allowed=allowed)
        matrix, zero = np.eye(robot.joint_count), np.zeros(robot.joint_count)
        for row, name in enumerate(robot.joint_names):
            joint = file.joints.get(name, PendantJointFile())
            for other in joint.add:
                matrix[row, robot.joint_names.index(other)] += 1.0
            matrix[row] *= joint.sense
            zero[row] = np.radians(joint.zero_deg)
        return cls(matrix, zero)

    def model_rad(self, pendant_rad: ArrayLike) -> Array:
        """Angles of the model, shape (..., n), of those that the pendant shows. [rad]"""
        return np.asarray(self.zero_rad + np.asarray(pendant_rad, dtype=float) @ self.matrix.T)

    def pendant_rad(self, model_rad: ArrayLike) -> Array:
        """Angles that the pendant shows, shape (..., n), of those of the model. [rad]"""
        turned = np.asarray(model_rad, dtype=float) - self.zero_rad
        return np.asarray(np.linalg.solve(self.matrix, turned[..., None])[..., 0])
