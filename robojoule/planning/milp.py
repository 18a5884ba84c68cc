"""The planning model (thesis Eq. 3.2-3.5; Bukata et al. 2017): a mixed-integer linear program for any number of robots.

Sets
    V          vertices (movements), for each robot in order of execution
    T_v        linear segments of the energy profile of v
    G_v        convex pieces of the profile of v (one if it is convex)
    E          edges (u, v): v follows u on the same robot;  h_uv = 1 if v belongs to the next cycle
    L          links (u, v): v of another robot starts after u
    CR         collisions (u, phase, v, phase) with phase in {N, M, W}

Data
    w          cycle time (mutable: one model serves all cycle times of a tree) [s]
    slope_tv, offset_tv    segment t of the profile of v [W], [J]
    d_lo, d_up             shortest and longest duration of v [s]
    P_N, P_W               idle power at the start and at the end of v [W]
    n_v, w_v               least prior and post wait of v (process steps) [s]

Variables
    s_v        start of the movement of v [s]
    dn_v       wait at the start of v before the movement (phase N lasts from s_v - dn_v to s_v) [s]
    dm_v       duration of the movement (phase M: s_v to s_v + dm_v) [s]
    dw_v       wait at the end of v: process (phase W begins at s_v + dm_v) [s]
    dc_v       wait at the end of v for a collision to clear; part of phase W, links do not wait for it [s]
    E_v        energy of the movement [J]
    k_q        by how many cycles the second vertex of collision q lies after the first (integer)
    y_gv       1 if v is executed on convex piece g of its profile (only where the profile is not convex)

Objective (3.2)
    min  sum_v  P_N dn_v + P_W (dw_v + dc_v) + E_v  (+ preference sum_v dm_v, see `build_model`)

Constraints
    (3.3) profile      E_v >= offset_tv + slope_tv dm_v                            for t in T_v
    (3.4) order        s_u + dm_u + dw_u + dc_u = s_v - dn_v + h_uv w              for (u, v) in E
          links        s_u + dm_u + dw_u <= s_v + h_uv w                           for (u, v) in L
          collisions   end of u's phase <= start of v's phase + k_q w
                       end of v's phase + k_q w <= start of u's phase + w          for q in CR
    (3.5) durations    d_lo <= dm_v <= d_up,  dn_v >= n_v,  dw_v >= w_v,  dc_v >= 0  (0 without a collision of v)

In a cycle that repeats for ever two phases are apart if and only if some whole number of cycles k_q puts the one behind
the other and before the next repetition of it. One integer a collision says so without any big constant. A phase of
length zero still counts as the instant at which the robot is there; touching phases are apart.

A profile that is not convex is the union of its convex pieces; the convex hull formulation (a duration and an energy
for each piece, both zero unless y_gv = 1) is exact and as tight as can be.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pyomo.environ as pyo

from robojoule.planning.costs import VertexCosts, check_costs
from robojoule.planning.graph import Arc, OptimizationGraph, Phase
from robojoule.profile.piecewise import PiecewiseLinearProfile


def build_model(
    graph: OptimizationGraph,
    costs: Sequence[VertexCosts],
    cycle_time_s: float,
    *,
    preference_w: float = 0.0,
) -> pyo.ConcreteModel:
    """Build the model; changing `model.w` and solving again plans for another cycle time.

    Args:
        graph: Optimisation graph.
        costs: Costs of each vertex, in the order of `graph.vertices`.
        cycle_time_s: Cycle time w. [s]
        preference_w: Small power charged on movements only, so that of plans with equal energy the one is chosen that
            waits instead of crawling; `model.energy` leaves it out. [W]

    Raises:
        InputError: Not one cost a vertex, or an idle power that is negative or not finite.
    """
    check_costs(graph, costs)
    model = pyo.ConcreteModel()
    model.V = pyo.RangeSet(0, len(graph.vertices) - 1)
    model.w = pyo.Param(mutable=True, initialize=cycle_time_s)
    _add_variables(model, graph, costs)
    _add_profiles(model, costs)
    _add_order(model, graph)
    _add_links(model, graph)
    _add_collisions(model, graph)
    _fix_origin(model, graph)
    model.energy = pyo.Expression(
        expr=sum(
            cost.idle_prior_w * model.dn[v] + cost.idle_post_w * (model.dw[v] + model.dc[v]) + model.E[v]
            for v, cost in enumerate(costs)
        )
    )
    preference = preference_w * sum(model.dm[v] for v in model.V) if preference_w else 0.0
    model.objective = pyo.Objective(expr=model.energy.expr + preference, sense=pyo.minimize)
    return model


def _add_variables(model: pyo.ConcreteModel, graph: OptimizationGraph, costs: Sequence[VertexCosts]) -> None:
    """Variables and their bounds (3.5)."""
    colliding = {name for pair in graph.collisions for name in (pair.first, pair.second)}
    vertices = graph.vertices
    model.s = pyo.Var(model.V)
    model.dn = pyo.Var(model.V, bounds=lambda _, v: (vertices[v].least_prior_wait_s, None))
    model.dm = pyo.Var(model.V, bounds=lambda _, v: (costs[v].profile.d_min_s, costs[v].profile.d_max_s))
    model.dw = pyo.Var(model.V, bounds=lambda _, v: (vertices[v].least_post_wait_s, None))
    model.dc = pyo.Var(model.V, bounds=lambda _, v: (0.0, None if vertices[v].name in colliding else 0.0))
    model.E = pyo.Var(model.V, bounds=lambda _, v: (float(costs[v].profile.energies_j.min()), None))


def _add_profiles(model: pyo.ConcreteModel, costs: Sequence[VertexCosts]) -> None:
    """Energy profiles (3.3): cuts where convex, else the convex hull formulation over the convex pieces."""
    model.profile = pyo.ConstraintList()
    pieces = {v: cost.profile.convex_pieces() for v, cost in enumerate(costs)}
    split = [(v, g) for v, parts in pieces.items() if len(parts) > 1 for g in range(len(parts))]
    model.G = pyo.Set(initialize=split, dimen=2)
    model.y = pyo.Var(model.G, domain=pyo.Binary)
    model.dm_piece = pyo.Var(model.G)
    model.E_piece = pyo.Var(model.G)
    for v, parts in pieces.items():
        if len(parts) == 1:
            _add_cuts(model, parts[0], model.dm[v], model.E[v], 1.0)
            continue
        for g, part in enumerate(parts):
            y, dm = model.y[v, g], model.dm_piece[v, g]
            _add_cuts(model, part, dm, model.E_piece[v, g], y)
            model.profile.add(dm >= part.d_min_s * y)
            model.profile.add(dm <= part.d_max_s * y)
        count = range(len(parts))
        model.profile.add(sum(model.y[v, g] for g in count) == 1)
        model.profile.add(sum(model.dm_piece[v, g] for g in count) == model.dm[v])
        model.profile.add(sum(model.E_piece[v, g] for g in count) == model.E[v])


def _add_cuts(model: pyo.ConcreteModel, part: PiecewiseLinearProfile, dm: Any, energy: Any, used: Any) -> None:
    """`energy` >= offset * `used` + slope * `dm` for each segment."""
    if part.segments == 0:
        model.profile.add(energy >= float(part.energies_j[0]) * used)
    for slope, offset in zip(part.slopes_w.tolist(), part.intercepts_j.tolist(), strict=True):
        model.profile.add(energy >= offset * used + slope * dm)


def _add_order(model: pyo.ConcreteModel, graph: OptimizationGraph) -> None:
    """Order within a robot (3.4): without a gap, for every second of the cycle is movement or wait."""

    def order(m: pyo.ConcreteModel, e: int) -> object:
        u, v, shift = _ends(graph, graph.edges[e])
        return m.s[u] + m.dm[u] + m.dw[u] + m.dc[u] == m.s[v] - m.dn[v] + shift * m.w

    model.order = pyo.Constraint(range(len(graph.edges)), rule=order)


def _add_links(model: pyo.ConcreteModel, graph: OptimizationGraph) -> None:
    """Order between robots: the movement of v starts after the movement and the process of u."""

    def link(m: pyo.ConcreteModel, e: int) -> object:
        u, v, shift = _ends(graph, graph.links[e])
        return m.s[u] + m.dm[u] + m.dw[u] <= m.s[v] + shift * m.w

    model.links = pyo.Constraint(range(len(graph.links)), rule=link)


def _add_collisions(model: pyo.ConcreteModel, graph: OptimizationGraph) -> None:
    """Phases of CR apart in every cycle, by a whole number of cycles between the two vertices."""
    # Starts lie within |R| cycles of the origin (see `_fix_origin`) and a robot's cycle is one long.
    reach = 2 * len(graph.robots) + 1
    model.Q = pyo.RangeSet(0, len(graph.collisions) - 1)
    model.k = pyo.Var(model.Q, domain=pyo.Integers, bounds=(-reach, reach))

    def interval(m: pyo.ConcreteModel, name: str, phase: Phase) -> tuple[object, object]:
        v = graph.index[name]
        if phase is Phase.PRIOR:
            return m.s[v] - m.dn[v], m.s[v]
        if phase is Phase.MOVE:
            return m.s[v], m.s[v] + m.dm[v]
        return m.s[v] + m.dm[v], m.s[v] + m.dm[v] + m.dw[v] + m.dc[v]

    model.collisions = pyo.ConstraintList()
    for q, pair in enumerate(graph.collisions):
        first_start, first_end = interval(model, pair.first, pair.first_phase)
        second_start, second_end = interval(model, pair.second, pair.second_phase)
        model.collisions.add(first_end <= second_start + model.k[q] * model.w)
        model.collisions.add(second_end + model.k[q] * model.w <= first_start + model.w)


def _fix_origin(model: pyo.ConcreteModel, graph: OptimizationGraph) -> None:
    """Time zero is the first robot's start of cycle; the others' start lies within |R| cycles of it."""
    model.origin = pyo.ConstraintList()
    for robot in graph.robots:
        first = next(v for v, vertex in enumerate(graph.vertices) if vertex.robot == robot)
        start = model.s[first] - model.dn[first]
        if robot == graph.robots[0]:
            model.origin.add(start == 0.0)
        else:
            count = len(graph.robots)
            model.origin.add(start >= -count * model.w)
            model.origin.add(start <= count * model.w)


def _ends(graph: OptimizationGraph, arc: Arc) -> tuple[int, int, int]:
    return graph.index[arc.tail], graph.index[arc.head], arc.cycle_shift
