"""Whether a log can be what it says: units, signs and saturation of positions, power and torques against the robot."""

from __future__ import annotations

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.signals import Signals
from robojoule.errors import InputError
from robojoule.robots.robot import Robot

WRONG_UNIT_RATIO = 30.0  # measured over expected power beyond which the unit must be wrong
WRONG_TORQUE_RATIO = 5.0
IMPOSSIBLE_LOAD_RATIO = 2.5  # torque over effort limit; noise and wrong inertias stay well below


def check_load(signals: Signals, robot: Robot, source: str) -> None:
    """Positions that jump, or stay at an end of the sensor's range, need torques that no drive has."""
    ratio = np.abs(signals.load_nm) / robot.effort_nm
    row, joint = (int(i) for i in np.unravel_index(np.argmax(ratio), ratio.shape))
    if ratio[row, joint] > IMPOSSIBLE_LOAD_RATIO:
        raise InputError(
            f"the motion at t = {signals.time_s[row]:.4f} s needs {ratio[row, joint]:.3g} times the effort limit of "
            f"{robot.joint_names[joint]}: a position jumps or is saturated",
            file=source,
            key=f"q{joint + 1}_rad",
            allowed=f"up to {IMPOSSIBLE_LOAD_RATIO:g} times the limit",
        )


def check_power(log: MeasuredLog, signals: Signals, expected_w: Array) -> None:
    """Unit and saturation of the measured power."""

    def refuse(problem: str, allowed: str | None = None) -> None:
        raise InputError(problem, file=log.source, key="power_w", allowed=allowed)

    power = signals.power_w
    if np.ptp(power) == 0.0:
        refuse("the power never changes")
    ratio = float(np.median(power)) / float(np.median(expected_w))
    if ratio <= 0.0:
        refuse("most of the power is zero or negative", "power drawn from the mains, positive [W]")
    if not 1.0 / WRONG_UNIT_RATIO < ratio < WRONG_UNIT_RATIO:
        hint = "; it looks like kilowatts" if 2e-4 < ratio < 5e-3 else ""
        refuse(f"the power is {ratio:.3g} times what the catalog entry expects{hint}", "watts")
    zeros = int(np.count_nonzero(power == 0.0))
    if zeros > 3:
        refuse(f"{zeros} samples are exactly zero: the meter dropped out", "no dropouts; cut the log there")
    clipped = _clipped(power)
    if clipped:
        refuse(f"{clipped} samples stay at exactly {power.max():.6g} W, the largest value: the meter is saturated")


def check_torque(log: MeasuredLog, signals: Signals, expected_nm: Array) -> None:
    """Unit, sign and saturation of measured torques."""
    if signals.torque_nm is None:
        return
    for joint in range(expected_nm.shape[1]):
        key, slides = f"q{joint + 1}_torque_nm", signals.direction[:, joint] != 0.0
        if np.count_nonzero(slides) < 50:
            continue
        measured, expected = signals.torque_nm[slides, joint], expected_nm[slides, joint]
        clipped = _clipped(np.abs(measured))
        if clipped:
            raise InputError(
                f"{clipped} samples stay at exactly the largest value: the torque is saturated",
                file=log.source,
                key=key,
            )
        slope = float(measured @ expected) / max(float(expected @ expected), 1e-12)
        if not 1.0 / WRONG_TORQUE_RATIO < slope < WRONG_TORQUE_RATIO:
            raise InputError(
                f"the torque is {slope:.3g} times what the robot's inertia and the catalog's friction expect",
                file=log.source,
                key=key,
                allowed="Nm on the link side (motor torque times gear ratio), positive where it drives q upwards",
            )


def _clipped(values: Array) -> int:
    """Number of samples in repeated stays of three or more at exactly the largest value."""
    top = np.concatenate([[False], values == values.max(), [False]])
    change = np.flatnonzero(top[1:] != top[:-1])
    lengths = change[1::2] - change[::2]
    stays = lengths[lengths >= 3]
    return int(stays.sum()) if len(stays) >= 2 else 0
