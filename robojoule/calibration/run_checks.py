"""Whether measured runs can be of the program and robot that they are said to be of.

What is refused here is a slip of the pen, not a machine that differs from its entry: seconds in milliseconds, speed
limits as fractions, kilojoules, swapped moves, a row of another trial. A fit would follow it to absurd plans.
"""

from __future__ import annotations

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths

LEAST_DURATION, MOST_DURATION = 0.5, 100.0  # of what the robot's entry takes; programs of slow arms run far below it
LEAST_ENERGY, MOST_ENERGY = 0.1, 10.0  # of what the entry draws in that time, half of the runs
ENERGY_APART = 5.0  # of a run's energy from that ratio
ALIKE, ALIKE_S = 1.25, 0.05  # by how much repetitions may differ


def check_runs(paths: MotionPaths, runs: MeasuredRuns) -> None:
    """Refuse runs that cannot be.

    Args:
        paths: The motions by the robot's entry.
        runs: Their measured runs.

    Raises:
        InputError: Runs of a motion of no length, runs that contradict each other, or durations or energies that are
            far from what the entry says; names the rows.
    """
    still = np.flatnonzero(~paths.moving[runs.motion])
    if still.size:
        raise InputError(f"row {still[0] + 1} is of a move that goes nowhere", file=runs.source, key="move")
    limits = np.unique(runs.speed_limits)
    simulated = paths.simulate(limits)
    at = runs.motion, np.searchsorted(limits, runs.speed_limits)
    _check_durations(runs, simulated.duration_s[at])
    _check_contradictions(runs)
    drives = paths.robot.drives
    # What a motion takes longer than by the entry is taken at the power of an arm that stands by.
    longer_s = runs.duration_s - simulated.duration_s[at]
    _check_energies(runs, simulated.energy_j[at] + (drives.base_power_w + drives.drive_active_power_w) * longer_s)


def _check_durations(runs: MeasuredRuns, nominal_s: Array) -> None:
    seen_s = runs.duration_s
    slack_s = 2.0 * runs.resolution_s
    bad = (seen_s + slack_s < LEAST_DURATION * nominal_s) | (seen_s - slack_s > MOST_DURATION * nominal_s)
    if bad.any():
        row = int(bad.argmax())
        took = f"row {row + 1} took {seen_s[row]:g} s at {100.0 * runs.speed_limits[row]:g} %"
        raise InputError(
            f"{took}, where the robot's entry takes {nominal_s[row]:.3g} s",
            file=runs.source,
            key="duration_s",
            allowed=f"{LEAST_DURATION:g} to {MOST_DURATION:g} times that; check order of moves, speed limits in "
            "percent, seconds, robot and payload",
        )


def _check_contradictions(runs: MeasuredRuns) -> None:
    """Nothing is faster at a lower speed limit, and repetitions of a run are alike."""
    slack_s = ALIKE_S + 2.0 * runs.resolution_s
    longest: dict[int, int] = {}
    for row in np.lexsort((-runs.duration_s, -runs.speed_limits)).tolist():
        motion = int(runs.motion[row])
        other = longest.setdefault(motion, row)
        if runs.duration_s[row] * ALIKE + slack_s < runs.duration_s[other]:
            first, second = sorted((row, other))
            took = (f"{runs.duration_s[one]:g} s at {100.0 * runs.speed_limits[one]:g} %" for one in (first, second))
            raise InputError(
                f"rows {first + 1} and {second + 1} contradict each other: {' and '.join(took)}",
                file=runs.source,
                key="duration_s",
                allowed="a lower speed limit takes longer, and runs that are repeated are alike",
            )
        if runs.duration_s[row] > runs.duration_s[other]:
            longest[motion] = row


def _check_energies(runs: MeasuredRuns, nominal_j: Array) -> None:
    """Energies of movements that draw some are positive, and all that are not small go together."""
    _check_ratios(runs, nominal_j)
    none = np.flatnonzero((runs.energy_j <= 0.0) & (nominal_j > 0.0))
    if none.size:
        row = int(none[0])
        raise InputError(
            f"row {row + 1} took {runs.energy_j[row]:g} J, where the robot's entry draws {nominal_j[row]:.3g} J",
            file=runs.source,
            key="energy_j",
            allowed="more than 0 J; empty where it was not measured",
        )


def _check_ratios(runs: MeasuredRuns, nominal_j: Array) -> None:
    usual_j = float(np.median(np.abs(nominal_j)))
    rows = np.flatnonzero(np.isfinite(runs.energy_j) & (nominal_j > usual_j / ENERGY_APART))
    if not rows.size:
        return
    ratios = runs.energy_j[rows] / nominal_j[rows]
    ratio = float(np.median(ratios))
    if not LEAST_ENERGY <= ratio <= MOST_ENERGY:
        raise InputError(
            f"energies are {ratio:.3g} times what the robot's entry draws",
            file=runs.source,
            key="energy_j",
            allowed=f"{LEAST_ENERGY:g} to {MOST_ENERGY:g} times that; check that they are joules of single moves, "
            "robot and payload",
        )
    bad = rows[(ratios < ratio / ENERGY_APART) | (ratios > ratio * ENERGY_APART)]
    if bad.size:
        row = int(bad[0])
        expected_j = ratio * nominal_j[row]
        raise InputError(
            f"row {row + 1} took {runs.energy_j[row]:g} J, where {expected_j:.3g} J would go with the others",
            file=runs.source,
            key="energy_j",
            allowed=f"up to {ENERGY_APART:g} times more or less than that; empty where it was not measured",
        )
