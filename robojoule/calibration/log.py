"""Measured logs: CSV or Parquet tables of time, joint positions and power, read and checked.

Columns (`qK` is joint K from the base): `time_s`, `q1_rad ..` or `q1_deg ..`, `power_w`; optionally
`q1_velocity_rad_s ..`, `q1_torque_nm ..` (link side, gear friction and rotor included) or `q1_current_a ..`,
`payload_kg` and `speed_limit_percent`. Other columns are ignored, unless they look like a joint's.
Logs of Universal Robots controllers may keep their own names (`robojoule.calibration.rtde`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Index, Mask, as_array, freeze
from robojoule.calibration.log_table import LogTable, read_table
from robojoule.calibration.rtde import is_rtde, with_own_names
from robojoule.errors import InputError
from robojoule.inputs import as_path, counted, shown
from robojoule.robots.robot import Robot

LIMIT_MARGIN_RAD = 0.02  # overshoot and calibration offsets of a real arm
LARGEST_STEP_S = 0.02  # 50 Hz: a jerk phase of a fast arm must not fall between two samples
LARGEST_SPARSE_STEP_S = 0.05  # the same with velocities, between which positions are interpolated
LARGEST_CONSTANT = 1e3  # of a motor [Nm/A]
COARSE_SHARE = 0.05  # of the samples that have the instant of the one before, yet another position: the clock is coarse
GAP_STEPS, GAP_S = 5.0, 0.05
LARGEST_GAP_S = 0.1  # of packets that a log with velocities may have lost at once: power is not known there
_ROWS_OF_COARSE = 1.5  # with one instant, on average: not packets that came twice
_JOINT_COLUMN = re.compile(r"q(\d+)_(\w+)")
_JOINT_QUANTITIES = ("rad", "deg", "velocity_rad_s", "torque_nm", "current_a")


@dataclass(frozen=True, eq=False)
class MeasuredLog:
    """One checked log, T instants, n joints.

    Attributes:
        source: File it was read from.
        time_s: Instants, rising, not necessarily at equal steps, shape (T,). [s]
        position_rad: Joint positions, shape (T, n). [rad]
        power_w: Power, of the mains or on the arm's bus, shape (T,). [W]
        velocity_rad_s: Measured joint velocities, shape (T, n), if logged. [rad/s]
        torque_nm: Measured drive torques on the link side, shape (T, n), if logged. [Nm]
        payload_kg: Payload mass, shape (T,), if logged. [kg]
        speed_limit: Speed limit of the program that held, a fraction in (0, 1], shape (T,), if logged. [-]
        has_power: Whether power was logged; else it is NaN throughout.
        clock_step_s: Step of the clock where it is so coarse that several samples have one instant; else None. [s]
        on_the_arm: Whether the file itself says that its power is that of the bus that feeds the arm.
    """

    source: str
    time_s: Array
    position_rad: Array
    power_w: Array
    velocity_rad_s: Array | None = None
    torque_nm: Array | None = None
    payload_kg: Array | None = None
    speed_limit: Array | None = None
    on_the_arm: bool = False
    has_power: bool = True
    clock_step_s: float | None = None

    def __post_init__(self) -> None:
        freeze(self)

    @property
    def clock_warnings(self) -> tuple[str, ...]:
        """What to know about a clock that is coarse, a sentence each."""
        if self.clock_step_s is None:
            return ()
        return (
            f"the clock's step of {1e3 * self.clock_step_s:.3g} ms is longer than that of the samples: of those that "
            "have one instant only the first counts, and the others' data are lost; log the controller's own clock",
        )


def read_log(
    path: str | Path,
    robot: Robot,
    torque_constants_nm_per_a: ArrayLike | None = None,
    *,
    power_needed: bool = True,
) -> MeasuredLog:
    """Read and check a log.

    Args:
        path: CSV or Parquet file.
        robot: The robot it was measured on.
        torque_constants_nm_per_a: Motor torque over motor current, one per joint; needed if the log holds motor
            currents instead of torques. [Nm/A]
        power_needed: Whether a log without power is refused; else its power is nowhere known (`has_power`).

    Raises:
        InputError: The file cannot be read; columns are missing, doubled or not numbers; cells are empty; time does
            not rise, has gaps or is too coarse; positions or velocities are beyond the robot's limits.
    """
    constants = torque_constants_nm_per_a
    checked = None if constants is None else check_torque_constants(constants, robot)
    table = read_table(as_path(path, "log"))
    on_the_arm = is_rtde(table)
    if on_the_arm:
        table = with_own_names(table, with_currents=checked is not None)
    source, count = table.source, robot.joint_count
    _check_columns(table, count)
    time = table.column("time_s")
    has_power = power_needed or "power_w" in table.names
    power = table.column("power_w") if has_power else np.full(time.shape, np.nan)
    velocity = _joint_columns(table, count, "velocity_rad_s")
    kept = np.append(True, np.diff(time) != 0.0)  # of packets that came twice the first one
    _check_time(time[kept], np.flatnonzero(kept) + 1, source, with_velocity=velocity is not None)
    position = _positions(table, robot)
    lost = ~kept[1:] & (np.diff(position, axis=0) != 0.0).any(axis=1)
    is_coarse = int(np.count_nonzero(lost)) > COARSE_SHARE * time.size
    payload = table.column("payload_kg") if "payload_kg" in table.names else None
    if payload is not None and payload.min() < 0.0:
        raise InputError("a payload is negative", file=source, key="payload_kg", allowed="0 kg or more")
    if payload is not None:
        robot.file.check_payload(float(payload.max()), file=source, key="payload_kg")
    log = MeasuredLog(
        source=source,
        time_s=time[kept],
        position_rad=position[kept],
        power_w=power[kept],
        velocity_rad_s=_of(velocity, kept),
        torque_nm=_of(_torques(table, robot, checked), kept),
        payload_kg=_of(payload, kept),
        speed_limit=_of(_speed_limits(table), kept),
        on_the_arm=on_the_arm,
        has_power=has_power,
        clock_step_s=float(np.median(np.diff(time[kept]))) if is_coarse else None,
    )
    _check_velocity(log, robot)
    return log


def _of(values: Array | None, kept: Mask) -> Array | None:
    """Some rows of a column, if there is one."""
    return None if values is None else values[kept]


def _check_columns(table: LogTable, count: int) -> None:
    for name in table.names:
        match = _JOINT_COLUMN.fullmatch(name)
        if match is None:
            continue
        if match[2] not in _JOINT_QUANTITIES:
            allowed = ", ".join(f"q{match[1]}_{quantity}" for quantity in _JOINT_QUANTITIES)
            raise InputError("unknown joint column", file=table.source, key=name, allowed=allowed)
        if not 1 <= int(match[1]) <= count:
            problem = f"the robot has {counted(count, 'joint')} only"
            raise InputError(problem, file=table.source, key=name, allowed=f"q1 to q{count}")


def _speed_limits(table: LogTable) -> Array | None:
    """Speed limits as fractions, if logged."""
    key = "speed_limit_percent"
    if key not in table.names:
        return None
    limits = table.column(key)
    bad = np.flatnonzero(~((limits > 0.0) & (limits <= 100.0)))
    if bad.size:
        problem = f"row {bad[0] + 1} holds {limits[bad[0]]:.6g}"
        raise InputError(problem, file=table.source, key=key, allowed="above 0 and up to 100 %")
    return limits / 100.0


def _joint_columns(table: LogTable, count: int, quantity: str) -> Array | None:
    names = [f"q{joint}_{quantity}" for joint in range(1, count + 1)]
    missing = [name for name in names if name not in table.names]
    if len(missing) == count:
        return None
    if missing:
        raise InputError("this column is missing (the other joints have theirs)", file=table.source, key=missing[0])
    return np.stack([table.column(name) for name in names], axis=1)


def _positions(table: LogTable, robot: Robot) -> Array:
    source = table.source
    radians = _joint_columns(table, robot.joint_count, "rad")
    degrees = _joint_columns(table, robot.joint_count, "deg")
    if radians is not None and degrees is not None:
        raise InputError("positions are given in radians and in degrees", file=source, key="q1_deg", allowed="one")
    if radians is None and degrees is None:
        raise InputError("this column is missing", file=source, key="q1_rad", allowed="q1_rad .. or q1_deg ..")
    position = radians if radians is not None else np.radians(np.asarray(degrees))
    unit = "rad" if radians is not None else "deg"
    shown = position if radians is not None else np.asarray(degrees)
    lower, upper = robot.lower_rad - LIMIT_MARGIN_RAD, robot.upper_rad + LIMIT_MARGIN_RAD
    beyond = np.argwhere((position < lower) | (position > upper))
    if beyond.size:
        row, joint = (int(i) for i in beyond[0])
        as_degrees = np.radians(position)
        hint = ""
        if unit == "rad" and np.all((as_degrees >= lower) & (as_degrees <= upper)):
            hint = "; the columns look like degrees (name them q1_deg ..)"
        raise InputError(
            f"row {row + 1}: {shown[row, joint]:.6g} {unit} is beyond the limits of {robot.joint_names[joint]}{hint}",
            file=source,
            key=f"q{joint + 1}_{unit}",
            allowed=f"{robot.lower_rad[joint]:.4f} to {robot.upper_rad[joint]:.4f} rad",
        )
    if np.ptp(position, axis=0).max() < 0.05:
        hint = "; the columns look like radians (name them q1_rad ..)" if unit == "deg" else ""
        raise InputError(f"no joint moves by more than 0.05 rad{hint}", file=source, key=f"q1_{unit}")
    return position


def _torques(table: LogTable, robot: Robot, torque_constants_nm_per_a: Array | None) -> Array | None:
    source = table.source
    torque = _joint_columns(table, robot.joint_count, "torque_nm")
    current = _joint_columns(table, robot.joint_count, "current_a")
    if torque is not None and current is not None:
        raise InputError(
            "torques and currents are both given", file=source, key="q1_current_a", allowed="one of the two"
        )
    if current is None:
        return torque
    if torque_constants_nm_per_a is None:
        raise InputError(
            "motor currents need the motors' torque constants",
            file=source,
            key="q1_current_a",
            allowed="torque constants [Nm/A] beside the log, or q1_torque_nm .. in it",
        )
    return np.asarray(current * torque_constants_nm_per_a * robot.drives.gear_ratio)


def check_torque_constants(constants_nm_per_a: ArrayLike, robot: Robot) -> Array:
    """Torque constants as an array, shape (n,). [Nm/A]

    Raises:
        InputError: They are not positive numbers, one per joint.
    """
    key = "torque_constants"
    constants = as_array(constants_nm_per_a, key, "torque constants")
    if constants.shape != (robot.joint_count,) or not np.all((constants > 0.0) & (constants <= LARGEST_CONSTANT)):
        allowed = f"{counted(robot.joint_count, 'number')}, above 0 and up to {LARGEST_CONSTANT:g} Nm/A"
        raise InputError(f"{shown(constants.tolist())} are not valid torque constants", key=key, allowed=allowed)
    return constants


def _check_time(time_s: Array, rows: Index, source: str, *, with_velocity: bool) -> None:
    """Instants, no two alike one after the other, must rise in small steps; `rows` are their rows in the file."""
    key = "time_s"
    steps = np.diff(time_s)
    if len(steps) == 0:
        raise InputError("the log has one row only", file=source)
    falling = np.flatnonzero(steps < 0.0)
    if falling.size:
        raise InputError(f"time falls at row {rows[falling[0] + 1]}", file=source, key=key, allowed="rising times")
    median = float(np.median(steps))
    if median > (LARGEST_SPARSE_STEP_S if with_velocity else LARGEST_STEP_S):
        each = (rows[-1] - rows[0]) / (len(rows) - 1)
        if each > _ROWS_OF_COARSE:
            problem = f"the clock's step of {median:.4g} s is too long: some {each:.0f} rows have one instant"
        else:
            problem = f"the samples are {median:.4g} s apart"
            problem += "; the column looks like milliseconds" if median >= 1.0 else ""
        raise InputError(
            problem,
            file=source,
            key=key,
            allowed=f"at most {LARGEST_STEP_S} s, or {LARGEST_SPARSE_STEP_S} s with velocities",
        )
    limit = max(GAP_STEPS * median, LARGEST_GAP_S if with_velocity else GAP_S)
    gaps = np.flatnonzero(steps > limit)
    if gaps.size:
        at = int(gaps[0])
        raise InputError(
            f"gap of {steps[at]:.4g} s after row {rows[at + 1] - 1} (t = {time_s[at]:.4f} s)",
            file=source,
            key=key,
            allowed=f"at most {limit:.4g} s between samples; cut the log there",
        )


def _check_velocity(log: MeasuredLog, robot: Robot) -> None:
    """Positions over time, and measured velocities, must respect the speed limits: a check of their units."""
    if log.velocity_rad_s is not None:
        ratio = np.abs(log.velocity_rad_s).max(axis=0) / robot.velocity_rad_s
        joint = int(np.argmax(ratio))
        if ratio[joint] > 1.5:
            raise InputError(
                f"the velocity reaches {ratio[joint]:.3g} times the limit of {robot.joint_names[joint]}; "
                "is it in rad/s?",
                file=log.source,
                key=f"q{joint + 1}_velocity_rad_s",
                allowed=f"up to {robot.velocity_rad_s[joint]:.4g} rad/s",
            )
    lag = max(1, round(0.05 / float(np.median(np.diff(log.time_s)))))
    span = (log.time_s[lag:] - log.time_s[:-lag])[:, None]
    if len(span) == 0:
        return
    speed = np.abs((log.position_rad[lag:] - log.position_rad[:-lag]) / span).max(axis=0)
    joint = int(np.argmax(speed / robot.velocity_rad_s))
    if speed[joint] > 1.5 * robot.velocity_rad_s[joint]:
        raise InputError(
            f"the positions move at {speed[joint]:.4g} rad/s, {speed[joint] / robot.velocity_rad_s[joint]:.3g} times "
            f"the limit of {robot.joint_names[joint]}; are time and positions in the units of their names?",
            file=log.source,
            key=f"q{joint + 1}_rad",
        )
