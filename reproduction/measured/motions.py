"""Runs of a machine out of its logs: one row for each point-to-point motion, with its duration and energy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa

from reproduction.tables import read_table
from robojoule.arrays import Array, Mask
from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.log_motions import logged_motions
from robojoule.calibration.signals import choose_smoothing, local_cubic
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.robot import Robot

_LIMITS = np.linspace(0.02, 1.0, 99)
_BEYOND_S = 0.04  # by which a duration may leave the range of the entry's: logs tell ends to some samples


def measured_motions(log: MeasuredLog, robot: Robot) -> pa.Table:
    """Motions of a log that start and end at rest and go straight.

    A run is known by its duration: the speed limit is the one at which the robot's entry takes as long.

    Args:
        log: The log, with power. Motions in which a payload that it names changes are left out.
        robot: The robot, with the payload of a log that names none.

    Returns:
        Columns log, payload_kg, start_q1_rad .., end_q1_rad .., speed_limit_percent, duration_s, energy_j.

    Raises:
        InputError: There is no such motion.
    """
    velocity = log.velocity_rad_s
    if velocity is None:
        velocity = local_cubic(log.time_s, log.position_rad, choose_smoothing(log.time_s, log.position_rad))[1]
    found = logged_motions(log.source, log.time_s, log.position_rad, velocity, log.speed_limit)
    limits, kept = _limits(found.paths(robot), found.duration_s)
    if not kept.any():
        raise InputError(f"no motion takes as long as one of {robot.name} may", file=log.source)
    payload_kg, constant = _payloads(log, found.begin_s, found.duration_s, robot.payload.mass_kg)
    kept &= constant
    if not kept.any():
        raise InputError("the payload changes in every motion", file=log.source, key="payload_kg")
    energy = _energies(log, found.begin_s, found.duration_s)
    columns: dict[str, object] = {
        "log": [Path(log.source).name] * int(kept.sum()),
        "payload_kg": payload_kg[kept],
    }
    for end, q in (("start", found.start_rad), ("end", found.end_rad)):
        columns |= {f"{end}_q{joint + 1}_rad": q[kept, joint].copy() for joint in range(robot.joint_count)}
    columns["speed_limit_percent"] = 100.0 * limits[kept]
    return pa.table(columns | {"duration_s": found.duration_s[kept], "energy_j": energy[kept]})


def _payloads(log: MeasuredLog, begin_s: Array, duration_s: Array, said_kg: float) -> tuple[Array, Mask]:
    """Payloads of motions, shape (M,) [kg]; and which of them carry theirs from start to end."""
    if log.payload_kg is None:
        return np.full(begin_s.shape, said_kg), np.ones(begin_s.shape, dtype=bool)
    first = np.searchsorted(log.time_s, begin_s)
    changes = np.concatenate([[0], np.cumsum(np.diff(log.payload_kg) != 0.0)])
    last = np.minimum(np.searchsorted(log.time_s, begin_s + duration_s), log.time_s.size - 1)
    return log.payload_kg[first], changes[first] == changes[last]


def _limits(paths: MotionPaths, duration_s: Array) -> tuple[Array, Mask]:
    """Speed limits, shape (M,), at which motions take as long [-]; and which of them may take so long."""
    durations = paths.durations(_LIMITS)
    limits = np.array([np.interp(-t, -row, _LIMITS) for t, row in zip(duration_s, durations, strict=True)])
    kept = (duration_s >= durations[:, -1] - _BEYOND_S) & (duration_s <= durations[:, 0] + _BEYOND_S)
    return limits, kept


def _energies(log: MeasuredLog, begin_s: Array, duration_s: Array) -> Array:
    """Energies of some spans of a log: its power, straight between samples, integrated. [J]"""
    steps = np.diff(log.time_s) * (log.power_w[1:] + log.power_w[:-1]) / 2.0
    work = np.concatenate([[0.0], np.cumsum(steps)])
    ends = (np.interp(at, log.time_s, work) for at in (begin_s, begin_s + duration_s))
    first, last = ends
    return np.asarray(last - first)


def read_measured(path: Path, joints: int) -> pa.Table:
    """The measured set.

    Raises:
        InputError: It cannot be read, or a column is missing or garbled.
    """
    ends = [f"{end}_q{joint + 1}_rad" for end in ("start", "end") for joint in range(joints)]
    numbers = ["payload_kg", *ends, "speed_limit_percent", "duration_s", "energy_j"]
    return read_table(path, "ingest-measurements", numbers=numbers, texts=["log"])
