"""What the predictors read and what they predict: names, order, and the arrays behind them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robojoule.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa

Array = NDArray[np.float64]

TARGETS = ("energy_saving_j", "optimal_duration_s", "energy_penalty_j")
"""Parameters of the energy profile: saving [J] at the optimum against full speed, optimal duration [s], penalty [J] of
the slowest speed limit against the optimum."""

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


def columns(table: pa.Table, names: tuple[str, ...], source: str | Path = "features") -> Array:
    """Columns of a table as one array.

    Args:
        table: Table of features, N rows.
        names: Columns wanted, K names.
        source: File named in an error.

    Returns:
        Values, shape (N, K).

    Raises:
        InputError: A column is missing, or holds a value that is not a finite number.
    """
    for name in names:
        if name not in table.column_names:
            raise InputError(f"column '{name}' is missing", file=source)
    values = np.empty((table.num_rows, len(names)))
    for place, name in enumerate(names):
        values[:, place] = table[name].to_numpy()
        if not np.isfinite(values[:, place]).all():
            raise InputError(f"column '{name}' holds values that are no finite numbers", file=source)
    return values


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


def steepness(profile_parameters: Array, duration_fastest_s: Array) -> Array:
    """Energy saved per second of slowing down (Eq. 4.1); 0 where nothing is saved or no time is lost.

    Args:
        profile_parameters: Columns in the order of `TARGETS`, shape (N, 3).
        duration_fastest_s: Durations at full speed, shape (N,). [s]

    Returns:
        Steepness, shape (N,). [J/s]
    """
    saving, delay = profile_parameters[:, 0], profile_parameters[:, 1] - duration_fastest_s
    worth = (saving > 0) & (delay > 0)
    return np.where(worth, saving, 0.0) / np.where(worth, delay, 1.0)
