"""Logs with few samples or dropped packets: what lies between two samples, from positions and velocities at both.

Between two samples each joint follows the cubic that has their positions and velocities (Hermite), its velocity the
derivative of that. Power and torque are straight lines there, so their integrals by the trapezoidal rule stay as they
are. Where a log has no velocities nothing is put between its samples.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.log import LARGEST_STEP_S, MeasuredLog

FINE_STEP_S = 0.008  # of what is put between samples: a jerk phase of a fast arm holds several


def is_sparse(log: MeasuredLog) -> bool:
    """Whether samples are so far apart that the log must be interpolated: all of them, or where packets are missing."""
    return log.velocity_rad_s is not None and bool(np.diff(log.time_s).max() > LARGEST_STEP_S)


def interpolated(log: MeasuredLog) -> MeasuredLog:
    """The log with samples at most `FINE_STEP_S` apart where those of the log are more than `LARGEST_STEP_S` apart.

    Args:
        log: Checked log with velocities.
    """
    time, position, velocity = log.time_s, log.position_rad, np.asarray(log.velocity_rad_s)
    steps = np.diff(time)
    parts = np.where(steps > LARGEST_STEP_S, np.ceil(steps / FINE_STEP_S - 1e-9), 1.0).astype(int)
    before = np.append(np.repeat(np.arange(len(steps)), parts), len(steps) - 1)
    part = np.append(np.concatenate([np.arange(count) for count in parts]), parts[-1])
    share = part / parts[before]
    s, step = share[:, None], steps[before][:, None]
    first, last, slope_first, slope_last = (
        values[before + offset] for values in (position, velocity) for offset in (0, 1)
    )
    change = last - first
    fine = first + s * (
        step * slope_first
        + s * (3.0 * change - step * (2.0 * slope_first + slope_last))
        + s**2 * (step * (slope_first + slope_last) - 2.0 * change)
    )
    speed = slope_first + s * (
        2.0 * (3.0 * change / step - 2.0 * slope_first - slope_last)
        + 3.0 * s * (slope_first + slope_last - 2.0 * change / step)
    )

    def straight(values: Array) -> Array:
        weight = share if values.ndim == 1 else s
        return np.asarray(values[before] + weight * (values[before + 1] - values[before]))

    return replace(
        log,
        time_s=straight(time),
        position_rad=fine,
        velocity_rad_s=speed,
        power_w=straight(log.power_w),
        torque_nm=None if log.torque_nm is None else straight(log.torque_nm),
        payload_kg=None if log.payload_kg is None else log.payload_kg[before],
        speed_limit=None if log.speed_limit is None else log.speed_limit[before],
    )
