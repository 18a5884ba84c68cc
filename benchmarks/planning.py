"""Plans of one tree: model and solution, a sweep over cycle times, 500 motions. `python -m benchmarks.planning`.

Profiles of the small tree are chords through 19 simulated runs per motion. The sweep changes the cycle time of one
loaded model, against the same sweep with a model built anew for each cycle time.
"""

from __future__ import annotations

import json
from statistics import median

import numpy as np

from benchmarks.measure import interleaved, ratio, rounded
from reproduction.motions.shards import random_motions
from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts
from robojoule.planning.solver import PlanSolver
from robojoule.planning.source_plans import plan_on_source
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.sampled import sampled_profile
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload

MOTIONS, LARGE = 10, 500
RUNS = 19
CYCLE_TIME_SHARE = 1.2
CYCLE_TIMES = 100
REBUILT = 10  # cycle times of the sweep that are also solved with models of their own


def batch(motions: int) -> TreeBatch:
    """A cycle of random points through HOME."""
    robot = load_robot("kuka_kr16_r2010_2", Payload(10.0))
    points, _ = random_motions(robot, np.random.default_rng(3), motions - 1, (2.1, 4.5))
    return TreeBatch(robot, [tree_from_configurations("random", np.vstack([robot.home_rad, points, robot.home_rad]))])


def measured_costs(trees: TreeBatch) -> list[VertexCosts]:
    """Costs of the first tree's movements from simulated runs."""
    limits = np.linspace(trees.slowest_speed_limit, 1.0, RUNS)
    runs = trees.paths.simulate(limits)
    return [
        VertexCosts(sampled_profile(d, e, limits).piecewise(), float(prior), float(post))
        for d, e, prior, post in zip(runs.duration_s, runs.energy_j, trees.idle_prior_w, trees.idle_post_w, strict=True)
    ]


def measure() -> dict[str, float]:
    """Times of the three cases, and the sweep against rebuilding."""
    small, large = batch(MOTIONS), batch(LARGE)
    costs, graph = measured_costs(small), small.graphs[0]
    least = float(small.least_cycles_s[0])
    sweep = np.linspace(1.0, 2.5, CYCLE_TIMES) * least

    def solve(times: np.ndarray) -> None:
        solver = PlanSolver(graph, costs)
        for time in times:
            solver.solve(float(time))

    def rebuilt() -> None:
        for k in range(0, CYCLE_TIMES, CYCLE_TIMES // REBUILT):
            solve(sweep[k : k + 1])

    seconds = interleaved(
        5,
        once=lambda: solve(np.array([CYCLE_TIME_SHARE * least])),
        sweep=lambda: solve(sweep),
        rebuilt=rebuilt,
    )
    cycle_times = CYCLE_TIME_SHARE * large.least_cycles_s[:, None]

    def profiles() -> AdaptiveProfiles:
        return AdaptiveProfiles(large.paths, large.slowest_speed_limit)

    many = interleaved(3, large=lambda: plan_on_source(profiles(), large, cycle_times))["large"]
    return rounded(
        {
            "rebuilt_over_sweep": ratio(seconds, "rebuilt", "sweep") * CYCLE_TIMES / REBUILT,
            "build_and_solve_ms": 1e3 * median(seconds["once"]),
            "sweep_of_100_s": median(seconds["sweep"]),
            "tree_of_500_s": median(many),
        }
    )


if __name__ == "__main__":
    print(json.dumps(measure()))
