"""A real UR3e: modelled power against what its controller measured on the bus of the arm.

The recording (RAD, DSN 2022; MIT) has positions, velocities, voltage and current of the bus of 48 V that feeds the arm:
35.5 s at 25 Hz, 19 motions with 1.07 kg. It is power of the arm, not of the mains: controller, fans and supply are
missing. It is judged in two ways:

- with the catalog's figures, nothing fitted: power above that of standing. Standing power itself checks nothing, as the
  catalog's comes from this arm, too (`robojoule/robots/anchors/anchors.yaml`);
- with figures identified on one half of it: energy of each motion of the other half.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np

from robojoule.arrays import Array, Index, Mask
from robojoule.calibration.identification import Identification, identify
from robojoule.calibration.log import MeasuredLog, read_log
from robojoule.calibration.log_model import evaluate, log_parameters
from robojoule.calibration.signals import Signals, prepare
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload, Robot

PAYLOAD = Payload(1.07, (0.0, 0.0, 0.058))  # as logged, in the frame of the flange
NAME = "ur_ur3e"
STILL_RAD_S = 0.002  # below it no joint is taken to move


@dataclass(frozen=True, eq=False)
class Comparison:
    """Modelled and measured power of the arm over W windows.

    Attributes:
        time_s: Middle of each window, shape (W,). [s]
        window_s: Length of each window, shape (W,). [s]
        motion: Motion that each window belongs to, with half of the rests round it, shape (W,).
        standing: Whether the arm stands in all of a window, shape (W,).
        measured_w: Measured power, shape (W,). [W]
        modelled_w: Power of the model, shape (W,). [W]
    """

    time_s: Array
    window_s: Array
    motion: Index
    standing: Mask
    measured_w: Array
    modelled_w: Array

    @property
    def rest_w(self) -> tuple[float, float]:
        """Mean power while the arm stands, measured and modelled. [W]"""
        length = self.window_s[self.standing]
        measured, modelled = (
            float(length @ power[self.standing] / length.sum()) for power in (self.measured_w, self.modelled_w)
        )
        return measured, modelled

    @property
    def above_rest_j(self) -> tuple[float, float]:
        """Energy of the part above standing, measured and modelled. [J]"""
        rest = self.rest_w
        measured, modelled = (
            float(self.window_s @ (power - own))
            for power, own in zip((self.measured_w, self.modelled_w), rest, strict=True)
        )
        return measured, modelled

    @property
    def above_rest_error_percent(self) -> float:
        """Error of that energy. [%]"""
        measured, modelled = self.above_rest_j
        return 100.0 * (modelled / measured - 1.0)

    @property
    def energy_error_percent(self) -> float:
        """Error of the energy of the recording, standing power taken as measured. [%]"""
        measured, modelled = self.above_rest_j
        return 100.0 * (modelled - measured) / float(self.window_s @ self.measured_w)

    @property
    def rmse_above_rest_w(self) -> float:
        """Root mean square error of the power above standing. [W]"""
        measured, modelled = self.rest_w
        error = self.modelled_w - modelled - self.measured_w + measured
        return float(np.sqrt(self.window_s @ error**2 / self.window_s.sum()))

    @property
    def rmse_w(self) -> float:
        """Root mean square error of the power as it is. [W]"""
        return float(np.sqrt(self.window_s @ (self.modelled_w - self.measured_w) ** 2 / self.window_s.sum()))

    @property
    def motion_errors_percent(self) -> Array:
        """Error of the energy of each motion with half of the rests round it. [%]"""
        count = int(self.motion.max()) + 1
        measured, modelled = (
            np.bincount(self.motion, self.window_s * power, count) for power in (self.measured_w, self.modelled_w)
        )
        return np.asarray(100.0 * (modelled / measured - 1.0))


def recording_path() -> Path:
    """File of the committed recording."""
    return Path(str(resources.files("reproduction.validation") / "data" / "ur3e_power.parquet"))


def recorded_robot() -> Robot:
    """The UR3e of the catalog with the payload of the recording."""
    return load_robot(NAME, PAYLOAD)


def load_recording(robot: Robot) -> MeasuredLog:
    """The committed recording."""
    return read_log(recording_path(), robot)


def halves(log: MeasuredLog) -> tuple[MeasuredLog, MeasuredLog]:
    """The recording cut in the rest next to its middle."""
    still = np.abs(np.asarray(log.velocity_rad_s)).max(axis=1) < STILL_RAD_S
    middle = (log.time_s[0] + log.time_s[-1]) / 2.0
    rests = np.flatnonzero(still)
    cut = int(rests[np.argmin(np.abs(log.time_s[rests] - middle))])
    parts = []
    for rows in (slice(None, cut + 1), slice(cut, None)):
        columns = {name: getattr(log, name)[rows] for name in ("time_s", "position_rad", "velocity_rad_s", "power_w")}
        parts.append(replace(log, **columns))
    return parts[0], parts[1]


def compare(log: MeasuredLog, robot: Robot) -> Comparison:
    """Model and measurement over a log.

    Args:
        log: Recording, or a part of it.
        robot: Robot as its own controller sees it, see `Robot.arm_side`.
    """
    signals = prepare(log, robot)
    vector = log_parameters(robot)
    modelled = evaluate(vector, signals, vector.start).window_power_w
    return _compared(signals, modelled)


def _compared(signals: Signals, modelled_w: Array) -> Comparison:
    return Comparison(
        time_s=signals.average(signals.time_s),
        window_s=signals.window_s,
        motion=signals.window_block,
        standing=signals.average(signals.moving.astype(float)) == 0.0,
        measured_w=signals.average(signals.power_w),
        modelled_w=modelled_w,
    )


def with_catalog() -> Comparison:
    """The whole recording with the catalog's figures: nothing is fitted."""
    robot = recorded_robot()
    return compare(load_recording(robot), robot.arm_side())


def identified_on_one_half(first: bool = True) -> tuple[Identification, Comparison]:
    """Figures identified on one half of the recording, and how they hold on the other one.

    Args:
        first: Whether to identify on the first half.
    """
    robot = recorded_robot()
    parts = halves(load_recording(robot))
    known, other = parts if first else parts[::-1]
    found = identify(known, robot, power_side="arm")
    return found, compare(other, Robot(found.robot_file(), PAYLOAD).arm_side())
