"""What the predictors read and what they predict: names, order, and the arrays behind them."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import count

import numpy as np

from robojoule.arrays import Array

_PLACE = ("vertical_distance_m", "horizontal_distance_m", "rotation_angle_rad")
_JOINT = (
    "angle_difference_rad",
    "speed_difference_rad_s",
    "acceleration_difference_rad_s2",
    "deceleration_difference_rad_s2",
    "jerk_acceleration_difference_rad_s3",
    "jerk_deceleration_difference_rad_s3",
)


def input_names(joint_count: int = 6) -> tuple[str, ...]:
    """Names of the inputs, in order (thesis 5.2): distances, rotation, then angle and dynamic differences by joint.

    Args:
        joint_count: Number of joints n.

    Returns:
        3 + 6 n column names of the features table.
    """
    return _PLACE + tuple(f"j{joint}_{name}" for joint in range(1, joint_count + 1) for name in _JOINT)


def joint_count(columns: Iterable[str]) -> int:
    """Number of joints whose inputs are among some columns."""
    names = set(columns)
    return next(joints for joints in count() if f"j{joints + 1}_{_JOINT[0]}" not in names)


def bounded(predictions: Array, duration_fastest_s: Array, duration_slowest_s: Array) -> Array:
    """Predictions moved into what is possible: no negative saving or penalty, a duration that the motion can take.

    Durations are the trajectory's own and known without a simulation of energy.

    Args:
        predictions: Columns in the order of `TARGETS`, shape (N, 3).
        duration_fastest_s: Durations at full speed, shape (N,). [s]
        duration_slowest_s: Durations at the slowest speed limit, shape (N,). [s]

    Returns:
        Possible values, shape (N, 3).
    """
    result = np.maximum(predictions, 0.0)
    result[:, 1] = np.clip(predictions[:, 1], duration_fastest_s, duration_slowest_s)
    return result
