"""Headline figures of the energy model: `reports/metrics/energy_model.json`."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from reproduction.reference_robot.figures import TreeRuns, energy_model_figures, idle_power_home_w
from reproduction.validation.kr300 import kr300_energy_error_percent
from robojoule.robots.robot import Robot


def energy_model_metrics(robot: Robot, motions: pa.Table, runs: pa.Table) -> dict[str, float]:
    """Idle power, profiles, torques; trees at full speed over the experiment trees, as in the thesis.

    Args:
        robot: Robot with its payload.
        motions: Table of the motions.
        runs: Table of their runs, ordered by motion and speed limit.
    """
    speeds = len(runs) // len(motions)
    duration, energy = (runs[name].to_numpy().reshape(-1, speeds) for name in ("duration_s", "energy_j"))
    speed_limit = runs["speed_limit_percent"].to_numpy()[:speeds] / 100.0
    experiment = np.flatnonzero(np.array(motions["split"].to_pylist()) == "experiment")
    tree = np.unique(motions["tree_id"].to_pylist(), return_inverse=True)[1]
    idle = motions["idle_power_end_w"].to_numpy()
    joints = range(1, robot.joint_count + 1)
    start, end = (np.column_stack([motions[f"{at}_q{j}_rad"] for j in joints]) for at in ("start", "end"))
    tree_runs = TreeRuns(speed_limit, duration, energy, idle, tree, np.abs(end - start))
    figures = energy_model_figures(tree_runs, experiment, idle_power_home_w(robot))
    figures |= {
        "idle_power_min_w": float(idle.min()),
        "idle_power_median_w": float(np.median(idle)),
        "idle_power_max_w": float(idle.max()),
        "torque_above_limit_percent": 100.0 * float((runs["peak_torque_ratio"].to_numpy() > 1.0).mean()),
        "kr300_energy_error_percent": kr300_energy_error_percent(),
    }
    return {name: round(value, 6) for name, value in figures.items()}
