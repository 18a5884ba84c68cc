"""Plans of a cycle of one robot with convex profiles, exactly and without a solver.

Without collisions and hand-overs the planning model is one budget: durations and waits add up to the cycle time. With
convex profiles it is solved by lengthening segments in the order of their slopes, from the steepest fall on, until the
budget is used or a slope reaches the least idle power; what is left is waited where idling is cheapest. A study needs
tens of thousands of plans; the same plans through the planning model are a test.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robojoule.drive import Array
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.model import VertexCosts
from robojoule.planning.solve import PlanSolver, SpeedPlan, check_cycle_time


def chain_plans(
    graph: OptimizationGraph, costs: Sequence[VertexCosts], cycle_times_s: Array, preference_w: float = 0.0
) -> list[SpeedPlan]:
    """Plans for some cycle times; through the planning model where a profile is not convex.

    Args:
        graph: Graph of one robot whose waits are free.
        costs: Costs of each vertex.
        cycle_times_s: Shape (R,). [s]
        preference_w: Power by which waiting is preferred to moving slowly. [W]

    Raises:
        CycleTimeTooShort: A cycle time in which the fastest cycle does not fit.
    """
    required = sum(v.least_prior_wait_s + v.least_post_wait_s for v in graph.vertices)
    if len(graph.robots) != 1 or required > 0.0 or not all(cost.profile.is_convex for cost in costs):
        solver = PlanSolver(graph, costs, preference_w=preference_w)
        return [solver.solve(float(time)) for time in cycle_times_s]
    hulls = [cost.profile.lower_hull for cost in costs]
    fastest = np.array([hull.d_min_s for hull in hulls])
    vertex = np.repeat(np.arange(len(hulls)), [hull.segments for hull in hulls])
    slope = np.concatenate([hull.slopes_w for hull in hulls])
    width = np.concatenate([np.diff(hull.durations_s) for hull in hulls])
    idle = np.array([[cost.idle_prior_w, cost.idle_post_w] for cost in costs])
    cheapest = np.unravel_index(int(idle.argmin()), idle.shape)
    order = np.argsort(slope, kind="stable")
    order = order[slope[order] < idle[cheapest] - preference_w]
    before = np.cumsum(width[order]) - width[order]
    plans = []
    for cycle_time in np.asarray(cycle_times_s, dtype=float).tolist():
        check_cycle_time(graph, fastest, cycle_time)
        budget = max(cycle_time - float(fastest.sum()), 0.0)
        taken = np.clip(budget - before, 0.0, width[order])
        durations = fastest.copy()
        np.add.at(durations, vertex[order], taken)
        waits = np.zeros_like(idle)
        waits[cheapest] = max(budget - float(taken.sum()), 0.0)
        ends = np.cumsum(waits.sum(axis=1) + durations)
        starts = ends - waits[:, 1] - durations
        plans.append(
            SpeedPlan(
                "optimal", cycle_time, durations, waits[:, 0], waits[:, 1], np.zeros(len(hulls)), np.asarray(starts)
            )
        )
    return plans
