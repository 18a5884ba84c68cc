"""Fewer numbers for the same picture: points of lines left out within a stated error, differences in whole units."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from robojoule.arrays import Array, Index


def needed_points(x: Array, y: Array, tolerance: float) -> Index:
    """Points between which straight lines miss none of the others by more than a tolerance, found one after the other.

    Args:
        x: Positions, never falling, shape (N,); where two are equal, the line jumps.
        y: Values, shape (N,).
        tolerance: Largest error, in the unit of `y`.

    Returns:
        Which points are needed, shape (K,), the first and the last one among them.
    """
    xs, ys = x.tolist(), y.tolist()
    kept, anchor = [0], 0
    while anchor < len(xs) - 1:
        low, high, last = -math.inf, math.inf, anchor + 1
        for point in range(anchor + 1, len(xs)):
            length, rise = xs[point] - xs[anchor], ys[point] - ys[anchor]
            if length <= 0.0:
                break
            if low <= rise / length <= high:
                last = point
            low, high = max(low, (rise - tolerance) / length), min(high, (rise + tolerance) / length)
            if low > high:
                break
        kept.append(last)
        anchor = last
    return np.array(kept, dtype=int)


def in_steps(values: Iterable[float] | Array, unit: float) -> list[int]:
    """Numbers as whole units: the first one, then differences, of which no rounding adds up."""
    whole = np.rint(np.asarray(list(values), dtype=float) / unit).astype(np.int64)
    return [int(one) for one in np.diff(whole, prepend=0)]
