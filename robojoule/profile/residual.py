"""What physics leaves over: a linear correction of the energy by its elasticities.

Where physics says that energy hangs on a joint's friction, a wrong form of friction shows: the features are the
elasticities of the energy (dE/E over dp/p) of friction, copper and load friction, joint by joint, those of friction
also times the logarithm of the joint's peak speed over its limit, and the share of base power. Smooth in the speed
limit, so that the predicted profile stays so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.parameters import ParameterVector
from robojoule.calibration.run_model import RunEvaluation
from robojoule.motion.path_integrals import PathIntegrals


@dataclass(frozen=True)
class Residual:
    """Correction factor 1 + (f - mean) / scale . weights.

    Attributes:
        mean: Mean of each feature, shape (k,).
        scale: Its scale, shape (k,).
        weights: Shape (k,); zeros: no correction.
        gain: Share of the cross-validated squared residual that it takes away. [-]
    """

    mean: Array
    scale: Array
    weights: Array
    gain: float

    def factor(self, features: Array) -> Array:
        """Correction factor of the energy, shape (..., k) -> (...)."""
        if not self.weights.any():
            return np.ones(features.shape[:-1])
        return np.asarray(1.0 + (features - self.mean) / self.scale @ self.weights)


def no_residual(joints: int) -> Residual:
    """No correction of the energies of an arm with so many joints."""
    width = 1 + 5 * joints
    return Residual(np.zeros(width), np.ones(width), np.zeros(width), 0.0)


def residual_features(vector: ParameterVector, integrals: PathIntegrals, found: RunEvaluation) -> Array:
    """Features of runs, shape (M, S, k).

    Args:
        vector: Parameters of the model.
        integrals: Path integrals of the runs.
        found: The model at some parameters.
    """
    scale = np.where(found.energy_j > 0.0, found.energy_j, 1.0)[..., None]
    elasticity = {part.figure: found.energy_jacobian[..., vector.part(part.name)] / scale for part in vector.groups}
    speed = integrals.peak_velocity[..., None] * np.abs(integrals.delta_rad)[:, None, :]
    pace = np.log(np.maximum(speed / integrals.robot.velocity_rad_s, 1e-3))
    return np.concatenate(
        [
            elasticity["base_power_w"],
            elasticity["coulomb_nm"],
            elasticity["viscous_nm_s_per_rad"],
            elasticity["viscous_nm_s_per_rad"] * pace,
            elasticity["copper_w_per_nm2"],
            elasticity["load_friction"],
        ],
        axis=-1,
    )
