"""Where tangents are put so that few of them lie close below a convex energy."""

from __future__ import annotations

import numpy as np

from robojoule.arrays import Array, Index
from robojoule.planning.cells.numbering import Numbering

_LEAST_SHARE = 1e-3


def spread_durations_s(numbers: Numbering, movements: Index, count: int) -> list[Array]:
    """Durations for `count` tangents of each movement, each of shape (number of movements,). [s]

    Between two tangents the error of E = a / d grows with the square root of its curvature, that is with d^(-3/2), so
    equal steps of d^(-1/2) share it equally; the same steps serve other convex energies well enough. Where the shortest
    duration is 0 or next to it, they begin at a thousandth of the longest one.
    """
    longest = numbers.d_max_s[movements]
    low, high = longest**-0.5, np.maximum(numbers.d_min_s[movements], _LEAST_SHARE * longest) ** -0.5
    shares = (np.arange(count) + 0.5) / count
    return [
        np.clip((low + share * (high - low)) ** -2.0, numbers.d_min_s[movements], numbers.d_max_s[movements])
        for share in shares
    ]
