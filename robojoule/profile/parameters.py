"""Saving, optimal duration and penalty of energy profiles: the one definition for single profiles and whole tables."""

from __future__ import annotations

import numpy as np

from robojoule.arrays import Array, Index


def optimal_run(duration_s: Array, energy_j: Array) -> Index:
    """Run with the least energy of each motion, the fastest of several.

    Args:
        duration_s: Durations of the runs of M motions, shape (M, S). [s]
        energy_j: Their energies, shape (M, S). [J]

    Returns:
        Places of the runs, shape (M,).
    """
    least = energy_j.min(axis=1, keepdims=True)
    return np.asarray(np.where(energy_j == least, duration_s, np.inf).argmin(axis=1))


TARGETS = ("energy_saving_j", "optimal_duration_s", "energy_penalty_j")
"""Parameters of an energy profile: saving [J] at the optimum against full speed, optimal duration [s], penalty [J] of
the slowest speed limit against the optimum."""


def profile_parameters(duration_s: Array, energy_j: Array) -> Array:
    """Saving of the best run against the fastest one, its duration, and the penalty of the slowest run against it.

    Args:
        duration_s: Durations of the runs of M motions, shape (M, S). [s]
        energy_j: Their energies, shape (M, S). [J]

    Returns:
        Saving [J], optimal duration [s] and penalty [J], shape (M, 3).
    """
    rows, best = np.arange(len(energy_j)), optimal_run(duration_s, energy_j)
    fastest, slowest = duration_s.argmin(axis=1), duration_s.argmax(axis=1)
    least = energy_j[rows, best]
    return np.stack([energy_j[rows, fastest] - least, duration_s[rows, best], energy_j[rows, slowest] - least], axis=1)


def steepness(parameters: Array, fastest_s: Array) -> Array:
    """Saving per second of slowing down (thesis Eq. 4.1); 0 where nothing is saved or no time is lost.

    Args:
        parameters: As `profile_parameters` gives them, shape (M, 3).
        fastest_s: Durations of the fastest runs, shape (M,). [s]

    Returns:
        Steepness, shape (M,). [J/s]
    """
    saving, delay = parameters[:, 0], parameters[:, 1] - fastest_s
    worth = (saving > 0) & (delay > 0)
    return np.where(worth, saving, 0.0) / np.where(worth, delay, 1.0)
