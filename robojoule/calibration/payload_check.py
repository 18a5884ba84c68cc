"""Whether a log fits the payload that it is said to have: what mass would explain the power better."""

from __future__ import annotations

import numpy as np

from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.log_fit import MAD_TO_SIGMA, Solution
from robojoule.calibration.log_model import evaluate
from robojoule.calibration.parameters import ParameterVector
from robojoule.calibration.signals import Signals, prepare
from robojoule.robots.robot import Payload, Robot

STEP = 0.2  # of the rated payload: change of mass from which its effect is taken
LEAST_SHARE = 0.15  # of the rated payload by which a mass must differ to be told
SURE = 4.0  # standard deviations
FEWEST_MOTIONS = 6  # that are fitted: below, a mass stands for friction of motions that are not there


def payload_that_fits(
    log: MeasuredLog, robot: Robot, vector: ParameterVector, signals: Signals, solution: Solution, window_s: float
) -> float | None:
    """Mass of a payload that explains the power clearly better than the given one; None where the given one fits.

    Other figures are free to move along, as in the fit itself: a mass that friction can stand for is not told. [kg]

    Args:
        log: The log; one with payloads of its own, or of few motions, is not checked.
        robot: The robot with the payload that is said.
        vector: Parameters of the fit.
        signals: The prepared log.
        solution: The fit.
        window_s: Length over which power was averaged. [s]
    """
    given, rated = robot.payload.mass_kg, robot.file.rated_payload_kg
    if log.payload_kg is not None or rated <= 0.0 or signals.training_blocks < FEWEST_MOTIONS:
        return None
    step = STEP * rated if given + STEP * rated <= rated else -STEP * rated
    other = Robot(robot.file, Payload(given + step, robot.payload.com_m)).variant(drives=robot.drives)
    heavier = prepare(log, other, signals.smoothing_s, window_s)
    before, after = (evaluate(vector, one, solution.x) for one in (signals, heavier))
    rows = ~signals.held_out
    size = np.sqrt(np.maximum(np.abs(signals.average(signals.power_w)[rows]), 1.0))
    residual = (signals.average(signals.power_w)[rows] - before.window_power_w[rows]) / size
    along = (after.window_power_w[rows] - before.window_power_w[rows]) / step / size
    basis = before.jacobian[rows][:, solution.free] / size[:, None]
    free = along - basis @ np.linalg.lstsq(basis, along, rcond=None)[0]  # what no other figure can stand for
    square = float(free @ free)
    if square <= 0.0:
        return None
    found = float(free @ residual) / square
    noise = MAD_TO_SIGMA * float(np.median(np.abs(residual)))
    deviation = noise / np.sqrt(square)
    if abs(found) < SURE * deviation or abs(found) < LEAST_SHARE * robot.file.rated_payload_kg:
        return None
    return max(given + found, 0.0)
