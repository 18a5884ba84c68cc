"""Headline figures of the energy model: `reports/metrics/energy_model.json`."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from reproduction.reference_robot.figures import energy_model_figures
from reproduction.validation.kr300 import kr300_energy_error_percent
from robojoule.motion.simulation import MotionPaths
from robojoule.robots.robot import Robot


def energy_model_metrics(robot: Robot, motions: pa.Table, runs: pa.Table) -> dict[str, float]:
    """Idle power, profiles, torques; power at full speed over the experiment trees, as in the thesis.

    Args:
        robot: Robot with its payload.
        motions: Table of the motions.
        runs: Table of their runs, ordered by motion and speed limit.
    """
    speeds = len(runs) // len(motions)
    duration, energy = (runs[name].to_numpy().reshape(-1, speeds) for name in ("duration_s", "energy_j"))
    experiment = np.flatnonzero(np.array(motions["split"].to_pylist()) == "experiment")
    tree = np.unique(motions["tree_id"].to_pylist(), return_inverse=True)[1]
    figures = energy_model_figures(duration, energy, tree, experiment)
    idle_home = float(MotionPaths(robot, robot.home_rad, robot.home_rad).idle_power_start_w[0])
    idle = motions["idle_power_end_w"].to_numpy()
    figures |= {
        "idle_power_home_w": idle_home,
        "idle_power_min_w": float(idle.min()),
        "idle_power_median_w": float(np.median(idle)),
        "idle_power_max_w": float(idle.max()),
        "rising_slope_over_idle": figures["rising_chord_w"] / idle_home,
        "torque_above_limit_percent": 100.0 * float((runs["peak_torque_ratio"].to_numpy() > 1.0).mean()),
        "kr300_energy_error_percent": kr300_energy_error_percent(),
    }
    return {name: round(value, 6) for name, value in figures.items()}
