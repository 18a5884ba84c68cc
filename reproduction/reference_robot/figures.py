"""Figures that hold an energy model against the thesis: power, trees, profiles, idle power, joints, an example."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array, Index
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.parameters import optimal_run, profile_parameters
from robojoule.robots.robot import Robot

EXAMPLE_MOTION = np.array([[0.63, 1340.0], [0.94, 1144.0], [3.76, 2800.0]])
"""Thesis section 4.3: duration [s] and energy [J] at full speed, at the optimum and at 10 %."""

LARGE, SMALL = 0.9, 0.1  # quantiles that stand for a large and a small saving
SLOWED = 0.6  # the speed limit of thesis Figure 6.2 at which motions are most often seen beside full speed


@dataclass(frozen=True)
class TreeRuns:
    """Runs of the motions of some trees.

    Attributes:
        speed_limit: Rising speed limits up to full speed, shape (S,). [-]
        duration_s: Durations, shape (M, S). [s]
        energy_j: Energies, shape (M, S). [J]
        idle_power_w: Idle power at the end of each motion, shape (M,). [W]
        tree: Tree of each motion, shape (M,).
        joint_change_rad: Absolute change of each joint, shape (M, n). [rad]
    """

    speed_limit: Array
    duration_s: Array
    energy_j: Array
    idle_power_w: Array
    tree: Index
    joint_change_rad: Array

    def of(self, rows: Index) -> TreeRuns:
        """Those of some motions."""
        return replace(
            self,
            duration_s=self.duration_s[rows],
            energy_j=self.energy_j[rows],
            idle_power_w=self.idle_power_w[rows],
            tree=self.tree[rows],
            joint_change_rad=self.joint_change_rad[rows],
        )


def idle_power_home_w(robot: Robot) -> float:
    """Idle power at HOME. [W]"""
    return float(MotionPaths(robot, robot.home_rad, robot.home_rad).idle_power_start_w[0])


def energy_model_figures(runs: TreeRuns, experiment: Index, home_w: float) -> dict[str, float]:
    """Figures of a set of runs.

    Args:
        runs: The runs.
        experiment: Motions over whose trees power, duration and energy at full speed are taken.
        home_w: Idle power at HOME. [W]

    Returns:
        The figures by name, as `targets.yaml` lists them.
    """
    duration_tree, energy_tree = of_trees(runs.of(experiment))
    power = energy_tree / duration_tree
    moving = runs.of(np.flatnonzero(runs.duration_s[:, -1] > 0))
    duration, energy = moving.duration_s, moving.energy_j
    saving_j, optimal_s, penalty_j = profile_parameters(duration, energy).T
    rising = duration[:, 0] > optimal_s
    chords = penalty_j[rising] / (duration[rising, 0] - optimal_s[rising])
    chord = float(np.median(chords)) if chords.size else float("nan")
    slowed = at_speed_limit(moving, SLOWED)
    return {
        "idle_power_home_w": home_w,
        "mean_power_full_speed_w": float(power.mean()),
        "min_tree_power_full_speed_w": float(power.min()),
        "max_tree_power_full_speed_w": float(power.max()),
        "mean_tree_duration_s": float(duration_tree.mean()),
        "min_tree_duration_s": float(duration_tree.min()),
        "max_tree_duration_s": float(duration_tree.max()),
        "mean_tree_energy_j": float(energy_tree.mean()),
        "idle_power_q05_w": float(np.quantile(runs.idle_power_w, 0.05)),
        "idle_power_q95_w": float(np.quantile(runs.idle_power_w, 0.95)),
        "median_optimal_duration_s": float(np.median(optimal_s)),
        "median_saving_j": float(np.median(saving_j)),
        "median_penalty_j": float(np.median(penalty_j)),
        "large_saving_j": float(np.quantile(saving_j, LARGE)),
        "small_saving_j": float(np.quantile(saving_j, SMALL)),
        "duration_ratio_slowest_to_fastest": float(np.median(duration[:, 0] / duration[:, -1])),
        "duration_ratio_at_60_percent": float(np.median(slowed / duration[:, -1])),
        "optimum_inside_percent": 100.0 * float(inside(duration, energy).mean()),
        "rising_linear_r2": rising_linear_r2(duration, energy),
        "rising_slope_over_idle": chord / home_w,
        "example_motion_deviation": float(np.abs(example_deviations(duration, energy)).max(axis=1).min()),
        **travel_correlations(moving.joint_change_rad, saving_j),
    }


def travel_correlations(joint_change_rad: Array, saving_j: Array) -> dict[str, float]:
    """How the energy saving goes with the travel of the joints, as Pearson's r (thesis section 4.3, Figure 4.5).

    Args:
        joint_change_rad: Absolute change of each joint, shape (M, n) with n of 4 or more. [rad]
        saving_j: Energy savings, shape (M,). [J]

    Returns:
        Correlation with the sum over all joints, the least and that of joint 2 over the others' best among joints
        1-3, the largest of the wrist's joints; nan each where motions or savings do not differ. [-]
    """
    total = np.column_stack([joint_change_rad, joint_change_rad.sum(axis=1)])
    x, y = total - total.mean(axis=0), saving_j - saving_j.mean()
    scale = np.sqrt((x**2).sum(axis=0) * (y @ y))
    r = np.divide(y @ x, scale, out=np.full(len(scale), np.nan), where=scale > 0.0)
    return {
        "saving_correlation_theta_sum": float(r[-1]),
        "saving_correlation_least_main": float(r[:3].min()),
        "saving_correlation_joint_2_lead": float(r[1] - max(r[0], r[2])),
        "saving_correlation_most_wrist": float(r[3:-1].max()),
    }


def at_speed_limit(runs: TreeRuns, speed_limit: float) -> Array:
    """Durations at a speed limit, shape (M,): one of those simulated, or the next higher one. [s]"""
    place = int(np.searchsorted(runs.speed_limit, speed_limit - 1e-9))
    return runs.duration_s[:, min(place, len(runs.speed_limit) - 1)]


def of_trees(runs: TreeRuns) -> tuple[Array, Array]:
    """Duration [s] and energy [J] of each tree at full speed, trees in rising order."""
    trees = np.unique(runs.tree, return_inverse=True)[1]
    duration, energy = np.zeros((2, int(trees.max()) + 1))
    np.add.at(duration, trees, runs.duration_s[:, -1])
    np.add.at(energy, trees, runs.energy_j[:, -1])
    return duration, energy


def inside(duration_s: Array, energy_j: Array) -> NDArray[np.bool_]:
    """Whether each profile's optimum, of runs (M, S) by rising speed limit, lies at neither end; shape (M,)."""
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
