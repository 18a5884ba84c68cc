"""Figures by which an energy model is held against the thesis: power level, shape of the profiles, example motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array, Index
from robojoule.profile.parameters import optimal_run, profile_parameters

EXAMPLE_MOTION = np.array([[0.63, 1340.0], [0.94, 1144.0], [3.76, 2800.0]])
"""Thesis section 4.3: duration [s] and energy [J] at full speed, at the optimum and at 10 %."""


def energy_model_figures(
    duration_s: Array, energy_j: Array, tree: Index, experiment: Index | slice = slice(None)
) -> dict[str, float]:
    """Figures of a set of runs.

    Args:
        duration_s: Durations by motion and rising speed limit, shape (M, S). [s]
        energy_j: Energies, shape (M, S). [J]
        tree: Tree of each motion, shape (M,).
        experiment: Motions over whose trees the power at full speed is taken.

    Returns:
        Mean, least and largest tree power at full speed [W]; medians over the motions of the duration ratio
        (slowest over fastest) and of the R2 of a straight line through the rising part; the share of optima inside [%];
        the median chord from the optimum to the slowest run [W]; the deviation of the motion nearest to the thesis's
        example (largest relative difference over its three durations and energies) [-].
    """
    powers = tree_powers_w(duration_s[experiment], energy_j[experiment], tree[experiment])
    rows = np.flatnonzero(duration_s[:, -1] > 0)
    duration, energy = duration_s[rows], energy_j[rows]
    _, optimal_s, penalty_j = profile_parameters(duration, energy).T
    rising = duration[:, 0] > optimal_s
    chord = penalty_j[rising] / (duration[rising, 0] - optimal_s[rising])
    return {
        "mean_power_full_speed_w": float(powers.mean()),
        "min_tree_power_full_speed_w": float(powers.min()),
        "max_tree_power_full_speed_w": float(powers.max()),
        "duration_ratio_slowest_to_fastest": float(np.median(duration[:, 0] / duration[:, -1])),
        "optimum_inside_percent": 100.0 * float(inside(duration, energy).mean()),
        "rising_linear_r2": rising_linear_r2(duration, energy),
        "rising_chord_w": float(np.median(chord)),
        "example_motion_deviation": float(np.abs(example_deviations(duration, energy)).max(axis=1).min()),
    }


def tree_powers_w(duration_s: Array, energy_j: Array, tree: Index) -> Array:
    """Mean power of each tree at full speed, trees in rising order; arguments as in `energy_model_figures`. [W]"""
    return np.array([energy_j[tree == t, -1].sum() / duration_s[tree == t, -1].sum() for t in np.unique(tree)])


def inside(duration_s: Array, energy_j: Array) -> NDArray[np.bool_]:
    """Whether each profile's optimum lies at neither end; arguments as in `energy_model_figures`, result (M,)."""
    optimal_s = profile_parameters(duration_s, energy_j)[:, 1]
    return np.asarray((optimal_s < duration_s[:, 0]) & (optimal_s > duration_s[:, -1] + 1e-9), dtype=np.bool_)


def example_deviations(duration_s: Array, energy_j: Array) -> Array:
    """Relative deviations of each motion from the thesis's example.

    Args:
        duration_s: Durations by motion and rising speed limit, shape (M, S). [s]
        energy_j: Energies, shape (M, S). [J]

    Returns:
        Duration and energy at full speed, at the optimum and at the slowest speed limit, shape (M, 6). [-]
    """
    number, best = np.arange(len(energy_j)), optimal_run(duration_s, energy_j)
    pairs = [(x[:, -1], x[number, best], x[:, 0]) for x in (duration_s, energy_j)]
    shape = np.stack([values[k] for k in range(3) for values in pairs], axis=1)
    return np.asarray(shape / EXAMPLE_MOTION.ravel() - 1.0)


def rising_linear_r2(duration_s: Array, energy_j: Array) -> float:
    """Median R2 of a line through each profile from one run after the optimum to the slowest run."""
    best = optimal_run(duration_s, energy_j)
    values = []
    for last in range(3, duration_s.shape[1]):  # three points at least: two always lie on a line
        rows = np.flatnonzero(best == last)
        if rows.size == 0:
            continue
        x = duration_s[rows, :last] - duration_s[rows, :last].mean(axis=1, keepdims=True)
        y = energy_j[rows, :last] - energy_j[rows, :last].mean(axis=1, keepdims=True)
        values.append((x * y).sum(axis=1) ** 2 / ((x**2).sum(axis=1) * (y**2).sum(axis=1)))
    return float(np.median(np.concatenate(values))) if values else float("nan")
