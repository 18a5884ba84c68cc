"""Speed limits for given durations, by halving, where durations have no closed inverse."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array, Mask
from robojoule.errors import InputError

DURATION_TOLERANCE_S = 1e-9
_BISECTIONS = 60
_LEAST_LIMIT = 1e-5


def limits_for(durations: Callable[[Array], Array], wanted_s: ArrayLike, fastest_s: Array, moving: Mask) -> Array:
    """Smallest speed limits that give at most the requested durations.

    Args:
        durations: From speed limits (M, 1) to durations (M, 1), which fall with them. [s]
        wanted_s: Requested durations, shape (M,). [s]
        fastest_s: Durations at full speed, shape (M,). [s]
        moving: Whether each motion moves, shape (M,).

    Returns:
        Speed limits, shape (M,); 1 where the fastest run is needed and for motions of zero length. [-]

    Raises:
        InputError: A duration is shorter than the motion's fastest.
    """
    wanted = np.asarray(wanted_s, dtype=float)
    check_durations(wanted, fastest_s)
    target = np.maximum(wanted, fastest_s)
    low, high = np.full(len(moving), _LEAST_LIMIT), np.ones(len(moving))
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        enough = durations(middle[:, None])[:, 0] <= target
        high, low = np.where(enough, middle, high), np.where(enough, low, middle)
    fastest_runs = target <= fastest_s + DURATION_TOLERANCE_S
    return np.where(fastest_runs | ~moving, 1.0, high)


def check_durations(wanted_s: Array, fastest_s: Array) -> None:
    """Refuse durations that are shorter than the fastest ones, each of shape (M,). [s]

    Raises:
        InputError: One is; names the motion.
    """
    short = np.flatnonzero(wanted_s < fastest_s - DURATION_TOLERANCE_S)
    if short.size:
        i = int(short[0])
        raise InputError(
            f"motion {i + 1} cannot take {wanted_s[i]:.6g} s", allowed=f"at least {fastest_s[i]:.6g} s (full speed)"
        )
