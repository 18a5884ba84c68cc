"""What the movements of a cycle cost, and what a schedule costs by that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robojoule.errors import InputError
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.schedule import Schedule
from robojoule.profile.piecewise import PiecewiseLinearProfile


@dataclass(frozen=True)
class VertexCosts:
    """What a vertex costs.

    Attributes:
        profile: Energy of the movement over its duration.
        idle_prior_w: P_N, idle power at its start. [W]
        idle_post_w: P_W, idle power at its end. [W]
    """

    profile: PiecewiseLinearProfile
    idle_prior_w: float
    idle_post_w: float


def joined_costs(
    profiles: Sequence[PiecewiseLinearProfile], idle_prior_w: ArrayLike, idle_post_w: ArrayLike
) -> list[VertexCosts]:
    """Costs of vertices by their profiles, V of them, and the idle power at their start and end, shape (V,). [W]"""
    prior, post = np.asarray(idle_prior_w, dtype=float).tolist(), np.asarray(idle_post_w, dtype=float).tolist()
    return [VertexCosts(profile, n, w) for profile, n, w in zip(profiles, prior, post, strict=True)]


def check_costs(graph: OptimizationGraph, costs: Sequence[VertexCosts]) -> None:
    """Refuse costs that do not fit the graph.

    Raises:
        InputError: Not one cost a vertex, or an idle power that is negative or not finite.
    """
    if len(costs) != len(graph.vertices):
        raise InputError(f"{len(costs)} costs given for {len(graph.vertices)} vertices", key="costs")
    for vertex, cost in zip(graph.vertices, costs, strict=True):
        for power in (cost.idle_prior_w, cost.idle_post_w):
            if not 0.0 <= power < float("inf"):
                raise InputError(f"the idle power {power} W is not usable", key=vertex.name, allowed="0 W or more")


def plan_energy_j(costs: Sequence[VertexCosts], plan: Schedule) -> float:
    """Objective (3.2) of a plan under given costs. [J]"""
    waits = plan.post_waits_s + plan.collision_waits_s
    return sum(
        float(cost.profile.value(plan.durations_s[v]))
        + cost.idle_prior_w * float(plan.prior_waits_s[v])
        + cost.idle_post_w * float(waits[v])
        for v, cost in enumerate(costs)
    )
