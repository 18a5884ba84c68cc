"""The three-segment energy profile (thesis Eq. 5.1-5.11): falling, constant, rising.

Three numbers describe it: optimal duration d_opt, energy saving against the fastest run, energy penalty of the slowest
run. With d_1 = d_opt - f_l (d_opt - d_min) and d_2 = d_opt + f_r (d_max - d_opt), a falling line runs from
(d_min, c + saving) to (d_1, c), a constant one to (d_2, c), and a rising one to (d_max, c + penalty). The offset c
moves the profile as a whole and changes no plan. The slope of the rising line is taken as the idle power (thesis 5.1).
Eq. 5.7-5.10 as printed use the distances delta_1, delta_2 in the place of d_1, d_2; here the lines join.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robojoule.profile.piecewise import PiecewiseLinearProfile

# A falling or rising line over a shorter time than this is left out: no controller resolves it, and its slope would
# spoil the numbers of a solver. [s]
LEAST_LINE_S = 1e-4


@dataclass(frozen=True)
class ThreeSegmentShape:
    """Constants of the profile's form.

    Attributes:
        left_fraction: f_l, share of [d_min, d_opt] that belongs to the constant part. [-]
        right_fraction: f_r, share of [d_opt, d_max] that belongs to the constant part. [-]
        offset_j: c, energy of the constant part. [J]
    """

    left_fraction: float = 0.4
    right_fraction: float = 0.04
    offset_j: float = 50.0


def three_segments(
    d_min_s: float,
    d_opt_s: float,
    d_max_s: float,
    saving_j: float,
    penalty_j: float,
    shape: ThreeSegmentShape = ThreeSegmentShape(),
) -> tuple[PiecewiseLinearProfile, float]:
    """Build the profile and the idle power that it implies.

    Predicted values that no profile can have are moved to the nearest possible one: d_opt into [d_min, d_max], saving
    and penalty to at least zero.

    Args:
        d_min_s: Duration at full speed. [s]
        d_opt_s: Optimal duration. [s]
        d_max_s: Duration at the lowest speed limit. [s]
        saving_j: Energy saving of the optimum against full speed. [J]
        penalty_j: Energy penalty of the lowest speed limit against the optimum. [J]
        shape: Constants of the form.

    Returns:
        The profile and the slope of its rising line [W] (zero where there is no rising line).

    Raises:
        ValueError: A value is not finite or d_max < d_min.
    """
    if not np.isfinite([d_min_s, d_opt_s, d_max_s, saving_j, penalty_j]).all() or d_max_s < d_min_s:
        raise ValueError("a three-segment profile needs finite values and d_min <= d_max")
    d_opt_s = min(max(d_opt_s, d_min_s), d_max_s)
    saving_j, penalty_j = max(saving_j, 0.0), max(penalty_j, 0.0)
    d_1 = d_opt_s - shape.left_fraction * (d_opt_s - d_min_s)
    d_2 = d_opt_s + shape.right_fraction * (d_max_s - d_opt_s)
    c = shape.offset_j
    falls, rises = d_1 - d_min_s >= LEAST_LINE_S, d_max_s - d_2 >= LEAST_LINE_S
    points = [(d_min_s, c + saving_j), (d_1, c)] if falls else [(d_min_s, c)]
    points += [(d_2, c), (d_max_s, c + penalty_j)] if rises else [(d_max_s, c)]
    distinct = [points[0], *(b for a, b in pairwise(points) if b[0] > a[0])]
    durations, energies = zip(*distinct, strict=True)
    idle_w = penalty_j / (d_max_s - d_2) if rises else 0.0
    return PiecewiseLinearProfile(np.array(durations), np.array(energies)), idle_w
