"""Saving, optimal duration and penalty of whole profiles."""

from __future__ import annotations

import numpy as np

from robojoule.arrays import Array

TARGETS = ("energy_saving_j", "optimal_duration_s", "energy_penalty_j")
"""Parameters of an energy profile: saving [J] at the optimum against full speed, optimal duration [s], penalty [J] of
the slowest speed limit against the optimum."""


def profile_parameters(duration_s: Array, energy_j: Array) -> Array:
    """The three parameters in the order of `TARGETS`; of several optima the fastest.

    Args:
        duration_s: Durations of the runs of M motions, shape (M, S). [s]
        energy_j: Their energies, shape (M, S). [J]

    Returns:
        Saving [J], optimal duration [s] and penalty [J], shape (M, 3).
    """
    rows = np.arange(len(energy_j))
    by_duration = np.argsort(duration_s, axis=1, kind="stable")
    d = np.take_along_axis(duration_s, by_duration, axis=1)
    e = np.take_along_axis(energy_j, by_duration, axis=1)
    best = e.argmin(axis=1)
    return np.stack([e[:, 0] - e[rows, best], d[rows, best], e[:, -1] - e[rows, best]], axis=1)
