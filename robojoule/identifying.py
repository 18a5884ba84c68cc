"""Drives, friction and timing of a machine from its own logs and runs: the tasks of identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from robojoule.calls import finite
from robojoule.checks import checked_robot, checked_runs, known_program, model_program, moving_batch
from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.robots.robot import Robot

if TYPE_CHECKING:
    from robojoule.calibration.friction import FrictionIdentification
    from robojoule.calibration.identification import Identification, PowerSide
    from robojoule.calibration.log import MeasuredLog
    from robojoule.calibration.run_table import MeasuredRuns
    from robojoule.calibration.timing import TimingIdentification


@finite
def identify(
    log: str | Path | MeasuredLog,
    robot: Robot,
    *,
    torque_constants: Sequence[float] | None = None,
    smoothing_s: float | None = None,
    window_s: float | None = None,
    power_side: PowerSide = "mains",
) -> Identification:
    """Drives of a robot, and its controller's timing, from a measured log of its motions and mains power.

    Timing comes from the motions that go straight from rest to rest, at the speed limits that the log says or else at
    full speed.

    Args:
        log: CSV or Parquet file, or a log that was read.
        robot: The robot that was measured, with its payload; its link inertias and gear ratios are taken as given.
        torque_constants: Motor torque over motor current, one per joint, for a file with motor currents. [Nm/A]
        smoothing_s: Length over which positions are differentiated; chosen by their noise if not given. [s]
        window_s: Length over which power is averaged; 0.1 s if not given. [s]
        power_side: Where power was measured: at the mains, or on the bus that feeds a collaborative arm, as its own
            controller does.

    Raises:
        InputError: The log cannot be read, is too short or contradicts itself.
    """
    from robojoule.calibration import identification  # late: brings scipy
    from robojoule.calibration.lag import meter_lag, without_lag
    from robojoule.calibration.log import MeasuredLog, check_torque_constants, read_log
    from robojoule.calibration.log_motions import log_timing
    from robojoule.calibration.signals import WINDOW_S

    robot = checked_robot(robot)
    if torque_constants is not None:
        check_torque_constants(torque_constants, robot)
    if not isinstance(log, MeasuredLog):
        log = read_log(log, robot, torque_constants)
    if not log.has_power:
        problem = "the log holds no power"
        raise InputError(problem, file=log.source, key="power_w", allowed="power, or identify_friction for torques")
    if log.on_the_arm and power_side == "mains":
        problem = "the power of this log is that of the bus that feeds the arm, not of the mains"
        raise InputError(problem, file=log.source, key="power_side", allowed="arm")
    window = WINDOW_S if window_s is None else window_s
    lag = meter_lag(log, robot, smoothing_s, window)
    found = identification.identify(
        without_lag(log, lag.lag_s), robot, smoothing_s=smoothing_s, window_s=window, power_side=power_side
    )
    timing, no_timing = log_timing(log, robot)
    return replace(found, lag=lag, timing=timing, no_timing=no_timing)


@finite
def identify_friction(
    log: str | Path | MeasuredLog,
    robot: Robot,
    *,
    torque_constants: Sequence[float] | None = None,
    smoothing_s: float | None = None,
) -> FrictionIdentification:
    """Friction of the joints, and the controller's timing, from torques or motor currents of a log without power.

    Args:
        log: CSV or Parquet file, or a log that was read.
        robot: The robot that was measured, with its payload.
        torque_constants: Motor torque over motor current, one per joint, for a file with motor currents. [Nm/A]
        smoothing_s: Length over which positions are differentiated; chosen by their noise if not given. [s]

    Raises:
        InputError: The log cannot be read, holds no torques, or is too short.
    """
    from robojoule.calibration import friction
    from robojoule.calibration.log import MeasuredLog, read_log

    robot = checked_robot(robot)
    if not isinstance(log, MeasuredLog):
        log = read_log(log, robot, torque_constants, power_needed=False)
    return friction.identify_friction(log, robot, smoothing_s)


@finite
def identify_timing(runs: str | Path | MeasuredRuns, program: Program, robot: Robot) -> TimingIdentification:
    """The controller's rule for time laws from measured runs of a program's moves.

    Args:
        runs: Table of runs (see `robojoule.calibration.run_table`), or as read.
        program: The program whose moves they are.
        robot: Robot with its payload; its entry is what the search starts from.

    Raises:
        InputError: The runs cannot be read, are of too few moves, or do not fit the program.
    """
    from robojoule.calibration import timing

    program = model_program(known_program(program, robot), robot)
    batch = moving_batch(program, robot)
    return timing.identify_timing(batch.paths, checked_runs(runs, program))
