"""Plans of a cycle of one robot: exactly and without a solver where the profiles are convex.

Without collisions and hand-overs the planning model is one budget, and its optimum for every cycle time at once is the
Pareto curve (`robojoule.planning.pareto`): segments are lengthened in the order of their slopes until the budget is
used or a slope reaches the least idle power; what is left is waited where idling is cheapest. The same plans through
the planning model are a test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robojoule.arrays import Array
from robojoule.planning.costs import VertexCosts
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.pareto import pareto_curve
from robojoule.planning.schedule import RELATIVE_GAP, Schedule, check_cycle_time


def chain_plans(
    graph: OptimizationGraph,
    costs: Sequence[VertexCosts],
    cycle_times_s: Array,
    preference_w: float = 0.0,
    *,
    relative_gap: float = RELATIVE_GAP,
) -> list[Schedule]:
    """Plans for some cycle times; through the planning model where a profile is not convex.

    Args:
        graph: Optimisation graph.
        costs: Costs of each vertex.
        cycle_times_s: Shape (R,). [s]
        preference_w: Power by which waiting is preferred to moving slowly. [W]
        relative_gap: Of the planning model. [-]

    Raises:
        CycleTimeTooShort: A cycle time in which the fastest cycle does not fit.
        PlanningError: The solver failed.
    """
    times = np.asarray(cycle_times_s, dtype=float)
    if len(graph.robots) != 1 or not all(cost.profile.is_convex for cost in costs):
        from robojoule.planning.solver import model_plans  # late: brings Pyomo

        return model_plans(graph, costs, times, preference_w, relative_gap=relative_gap)
    preferred = [
        replace(c, idle_prior_w=c.idle_prior_w - preference_w, idle_post_w=c.idle_post_w - preference_w) for c in costs
    ]
    curve = pareto_curve(graph, preferred)
    required = np.array([[v.least_prior_wait_s, v.least_post_wait_s] for v in graph.vertices])
    idle = np.array([[cost.idle_prior_w, cost.idle_post_w] for cost in costs])
    cheapest = np.unravel_index(int(idle.argmin()), idle.shape)
    plans = []
    for time in times.tolist():
        check_cycle_time(graph, curve.least_durations_s, time)
        cycle_time = max(time, float(curve.cycle_times_s[0]))
        durations, waits = curve.plan_durations_s([cycle_time])[0], required.copy()
        waits[cheapest] += max(cycle_time - float(durations.sum() + required.sum()), 0.0)
        ends = np.cumsum(waits.sum(axis=1) + durations)
        bound = float(curve.energy_j(cycle_time))
        plans.append(
            Schedule(
                status="optimal",
                cycle_time_s=cycle_time,
                durations_s=durations,
                prior_waits_s=waits[:, 0],
                post_waits_s=waits[:, 1],
                collision_waits_s=np.zeros(len(durations)),
                starts_s=ends - waits[:, 1] - durations,
                energy_j=bound + preference_w * float(waits.sum()),
                bound_j=bound,
            )
        )
    return plans
