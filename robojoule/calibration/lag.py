"""How late a power meter is against the positions: the delay at which measured and modelled power agree best."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.log_model import evaluate, log_parameters
from robojoule.calibration.signals import WINDOW_S, prepare
from robojoule.robots.robot import Robot

LONGEST_LAG_S = 0.5
LEAST_SAMPLES = 1.0  # a lag of less than this many steps of the log is none
LEAST_GAIN = 0.01  # of the coefficient of determination by which a lag must explain more
LEAST_R2 = 0.6  # with the lag; below it the shape of the power is not recognised, whatever is best


@dataclass(frozen=True)
class MeterLag:
    """What was found.

    Attributes:
        lag_s: By how much power comes later than the positions that it belongs to; 0 if none is seen. [s]
        r2: Share of the power's variance that the model explains with the lag. [-]
        r2_without: The same without it. [-]
    """

    lag_s: float
    r2: float
    r2_without: float


def meter_lag(log: MeasuredLog, robot: Robot, smoothing_s: float | None = None, window_s: float = WINDOW_S) -> MeterLag:
    """Find the lag of the meter by the robot's figures as they are: only the shape of the power counts.

    Args:
        log: Checked log.
        robot: The robot with its payload.
        smoothing_s: See `robojoule.calibration.signals.prepare`. [s]
        window_s: See there. [s]
    """
    signals = prepare(log, robot, smoothing_s, window_s)
    vector = log_parameters(robot)
    modelled = evaluate(vector, signals, np.clip(vector.start, vector.lower, vector.upper)).power_w
    time, step = signals.time_s, float(np.median(np.diff(log.time_s)))
    lags = np.arange(-LONGEST_LAG_S, LONGEST_LAG_S + step / 2.0, step)
    lags -= lags[np.argmin(np.abs(lags))]
    found = np.array([_explained(time, signals.power_w, modelled, lag) for lag in lags])
    best, none = int(found.argmax()), int(np.argmin(np.abs(lags)))
    lag = float(lags[best]) + step * _vertex(found, best)
    is_told = 0 < best < len(lags) - 1 and found[best] >= LEAST_R2  # the best is not at an end of the search
    if not is_told or abs(lag) < LEAST_SAMPLES * step or found[best] - found[none] < LEAST_GAIN:
        return MeterLag(0.0, float(found[none]), float(found[none]))
    return MeterLag(lag, float(found[best]), float(found[none]))


def without_lag(log: MeasuredLog, lag_s: float) -> MeasuredLog:
    """A log whose power is moved to the positions that it belongs to; ends that have no power any more are left out."""
    if lag_s == 0.0:
        return log
    kept = (log.time_s + lag_s >= log.time_s[0]) & (log.time_s + lag_s <= log.time_s[-1])
    changed = {
        name: values[kept]
        for name in ("time_s", "position_rad", "velocity_rad_s", "torque_nm", "payload_kg", "speed_limit")
        if (values := getattr(log, name)) is not None
    }
    power = np.interp(log.time_s[kept] + lag_s, log.time_s, log.power_w)
    return replace(log, power_w=power, **changed)


def _explained(time_s: Array, power_w: Array, modelled_w: Array, lag_s: float) -> float:
    """Share of the measured power's variance that the modelled power explains, in a straight line, at a lag. [-]"""
    inside = (time_s + lag_s >= time_s[0]) & (time_s + lag_s <= time_s[-1])
    seen = np.interp(time_s[inside] + lag_s, time_s, power_w)
    return float(np.corrcoef(seen, modelled_w[inside])[0, 1] ** 2) if np.ptp(seen) > 0.0 else 0.0


def _vertex(values: Array, at: int) -> float:
    """Where between its neighbours a maximum lies, by the parabola through the three, in steps."""
    if at in (0, len(values) - 1):
        return 0.0
    left, middle, right = values[at - 1 : at + 2]
    bend = left - 2.0 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0.0 else 0.0
