"""Predicted profiles as a source of energy profiles: no run of a motion is simulated or measured for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robojoule.arrays import Array
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.predicted import ProfilePredictor

PREDICTED_SPEED_LIMITS = 41  # at which a profile is predicted


@dataclass(frozen=True)
class PredictedSource:
    """Profiles by a predictor.

    Attributes:
        predictor: Predictor of the robot that moves.
        slowest_speed_limit: Speed limit of the slowest run, a fraction in (0, 1].
        cautious: Whether profiles follow the upper quantile of energy differences instead of the prediction itself.
    """

    name: ClassVar[str] = "predicted"

    predictor: ProfilePredictor
    slowest_speed_limit: float
    cautious: bool = False

    def profiles(self, paths: MotionPaths) -> tuple[list[PiecewiseLinearProfile], Array]:
        """Convex profiles of M motions, and their idle powers at start and end, shape (M, 2) [W].

        Raises:
            InputError: The predictor knows another robot.
        """
        top = np.maximum(paths.fastest_speed_limits(), self.slowest_speed_limit)[:, np.newaxis]
        shares = np.linspace(0.0, 1.0, PREDICTED_SPEED_LIMITS)
        limits = np.minimum(self.slowest_speed_limit + shares * (top - self.slowest_speed_limit), 1.0)
        predicted = self.predictor.predict(paths, limits)
        found = [predicted.piecewise(motion, cautious=self.cautious) for motion in range(paths.motions)]
        return found, np.stack([predicted.idle_start_w, predicted.idle_end_w], axis=1)
