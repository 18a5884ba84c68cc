"""Operation trees that several test modules plan."""

from dataclasses import replace

import numpy as np

from robojoule.formats.tree_files import parse_tree
from robojoule.planning.costs import joined_costs
from robojoule.planning.graph import process_energy_j
from robojoule.planning.solver import model_plans
from robojoule.profile.sampled import sampled_profiles

HOME_DEG = (0.0, -90.0, 90.0, 0.0, 0.0, 0.0)
POINTS_DEG = ((40.0, -70.0, 80.0, 10.0, 30.0, 0.0), (40.0, -50.0, 110.0, 10.0, -20.0, 90.0))


def tree(name="there and back", points=POINTS_DEG, extra=()):
    """HOME, the points, back through them; `extra` are (position, operation) insertions."""
    stops = [*points, *points[-2::-1], HOME_DEG]
    operations = [
        {"type": "move", "name": f"m{i}", "target_rad": np.radians(stop).tolist()} for i, stop in enumerate(stops)
    ]
    for position, operation in sorted(extra, key=lambda item: -item[0]):
        operations.insert(position, operation)
    data = {
        "format": "robojoule-operation-tree",
        "version": 1,
        "name": name,
        "start_rad": np.radians(HOME_DEG).tolist(),
        "operations": operations,
    }
    return parse_tree(data, name)


def busy_tree():
    """With a process step, a wait, a wait at a move, a motion of zero length and a tiny one."""
    return tree(
        "busy",
        extra=(
            (0, {"type": "wait", "name": "part", "duration_s": 0.2}),
            (1, {"type": "process", "name": "weld", "duration_s": 0.4, "power_w": 500.0}),
            (2, {"type": "move", "name": "stay", "target_rad": np.radians(POINTS_DEG[1]).tolist()}),
            (
                2,
                {
                    "type": "move",
                    "name": "stay too",
                    "target_rad": np.radians(POINTS_DEG[1]).tolist(),
                    "wait_after_s": 0.1,
                },
            ),
            (2, {"type": "move", "name": "nudge", "target_rad": np.radians((40.1, *POINTS_DEG[0][1:])).tolist()}),
        ),
    )


def dense_plans(batch, cycle_times_s, speed_limits):
    """Plans of the planning model on chords through many equidistant runs: at most as far above the optimum as these.

    No plan of theirs can be better than the optimum, as chords are nowhere below a convex profile.
    """
    limits = batch.speed_limits(speed_limits)
    runs = batch.paths.simulate(limits)
    profiles = sampled_profiles(runs.duration_s, runs.energy_j, limits, 1e-6)
    result = []
    for cycle, graph, rows, times in zip(batch.trees, batch.graphs, batch.rows, cycle_times_s, strict=True):
        chords = [profile.piecewise() for profile in profiles[rows]]
        costs = joined_costs(chords, batch.idle_prior_w[rows], batch.idle_post_w[rows])
        step = process_energy_j(cycle)
        plans = model_plans(graph, costs, times, relative_gap=1e-7)
        result.append([replace(plan, energy_j=plan.energy_j + step) for plan in plans])
    return result
