"""Write plans back (thesis 2.1.2): speed limits and waits in operation trees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robojoule.arrays import Array
from robojoule.planning.batch import TreeBatch, percent_of
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.schedule import Schedule
from robojoule.programs.operation_tree import OperationTree

_SAME_STEP = 1e-5  # of a step: rounding
_SAME_S = 1e-14  # what sums leave of a wait that has few digits
ROUNDING_S = 1e-12  # below: what is left of sums and differences of times


def speed_limits_of_plans(batch: TreeBatch, plans: Sequence[Sequence[Schedule]]) -> Array:
    """Lowest speed limits that keep the durations of plans.

    Args:
        batch: Trees.
        plans: K plans for each tree.

    Returns:
        Shape (M, K); within the batch's range. [-]
    """
    durations = stacked_durations(plans)
    columns = [batch.planned.speed_limits_for_durations(np.maximum(column, batch.d_min_s)) for column in durations.T]
    return np.asarray(np.clip(np.stack(columns, axis=1), *(limit[:, None] for limit in batch.speed_range)))


def stacked_durations(plans: Sequence[Sequence[Schedule]]) -> Array:
    """Durations of K plans for each tree, shape (M, K). [s]"""
    return np.concatenate([np.stack([plan.durations_s for plan in row], axis=1) for row in plans])


def write_plans(
    batch: TreeBatch,
    plans: Sequence[Sequence[Schedule]],
    speed_limits: Array | None = None,
    *,
    wait_step_s: float = 0.0,
) -> list[list[OperationTree]]:
    """Write K plans into each tree of a batch; see `write_plan`.

    Args:
        batch: Trees.
        plans: K plans for each tree.
        speed_limits: Speed limits of the motions, shape (M, K); the lowest that keep the plans' durations if not
            given. [-]
        wait_step_s: Step of added waits, see `write_plan`. [s]
    """
    limits = speed_limits_of_plans(batch, plans) if speed_limits is None else speed_limits
    durations = batch.planned.durations(limits)
    return [
        [write_plan(tree, graph, plan, limits[rows, k], durations[rows, k], wait_step_s) for k, plan in enumerate(row)]
        for tree, graph, rows, row in zip(batch.trees, batch.graphs, batch.rows, plans, strict=True)
    ]


def write_plan(
    tree: OperationTree,
    graph: OptimizationGraph,
    plan: Schedule,
    speed_limits: Array,
    durations_s: Array,
    wait_step_s: float = 0.0,
) -> OperationTree:
    """Write speed limits and waits into the tree so that the cycle takes the plan's cycle time.

    What a motion is faster than planned (rounding of the speed limit) becomes wait after it. Without a step of waits
    the cycle takes exactly its time; with one, added waits are multiples of it, and the cycle is shorter by less than
    one step.

    Args:
        tree: The tree that was planned.
        graph: Its graph.
        plan: Plan for it.
        speed_limits: Speed limit of each vertex, shape (V,). [-]
        durations_s: Duration that the simulation gives at these speed limits, shape (V,). [s]
        wait_step_s: Step of added waits; any length if 0. [s]

    Returns:
        The tree with the plan in it.
    """
    least_prior = np.array([vertex.least_prior_wait_s for vertex in graph.vertices])
    least_post = np.array([vertex.least_post_wait_s for vertex in graph.vertices])
    prior = np.maximum(plan.prior_waits_s, least_prior)
    slack = plan.durations_s - durations_s
    post = np.maximum(plan.post_waits_s + plan.collision_waits_s + slack, least_post)
    missing = plan.cycle_time_s - float((prior + durations_s + post).sum())
    if missing >= 0.0:
        post[-1] += missing
    else:
        _shorten(prior, post, least_prior, least_post, -missing)
    if wait_step_s > 0.0:
        added = _in_steps(np.concatenate([prior - least_prior, post - least_post]), wait_step_s)
        prior, post = (least + part for least, part in zip((least_prior, least_post), np.split(added, 2), strict=True))
    before, after = {}, {}
    for v, vertex in enumerate(graph.vertices):
        # Waits and process steps of the program stay as they are: what goes beyond them is added, and marked so.
        before[vertex.moves[0]] = _wait(float(prior[v] - least_prior[v]))
        after[vertex.moves[-1]] = _wait(float(post[v] - least_post[v]))
    limits = move_percents(tree, graph, speed_limits)
    return tree.with_plan(limits, added_waits_before_s=before, added_waits_after_s=after)


def move_percents(tree: OperationTree, graph: OptimizationGraph, speed_limits: Array) -> dict[str, float]:
    """Speed limits of the moves under those of their vertices, (V,) [-]: each as far as its own range allows. [%]

    Vertices that are tied have the speed limit of the first one of them.
    """
    moves = {move.name: move for move in tree.moves()}
    percents = {}
    leaders = {vertex.leader for vertex in graph.vertices}
    for vertex, limit in zip(graph.vertices, speed_limits[graph.leaders].tolist(), strict=True):
        for name in vertex.moves:
            move = moves[name]
            highest = move.speed_limit_percent
            if len(vertex.moves) > 1 or vertex.leader is not None or vertex.name in leaders:
                limit_here = max(limit, (highest if move.fixed else move.least_speed_percent or 0.0) / 100.0)
                percents[name] = min(percent_of(limit_here, highest), highest)
            else:
                percents[name] = percent_of(limit, highest)
    return percents


def _in_steps(waits_s: Array, step_s: float) -> Array:
    """Waits as multiples of a step; the longest one gets what the others lose, as far as that makes whole steps. [s]"""
    steps = np.floor(waits_s / step_s + _SAME_STEP)
    left = np.floor((waits_s.sum() / step_s) - steps.sum() + _SAME_STEP)
    steps[int(np.argmax(waits_s))] += max(left, 0.0)
    return np.asarray(steps * step_s)


def _wait(seconds: float) -> float:
    """A wait as it is written: what only rounding left of it is none, and few digits stand for those near them."""
    plain = round(seconds, 9)
    if abs(seconds - plain) <= _SAME_S:
        return plain
    return seconds if seconds > ROUNDING_S else 0.0


def _shorten(prior: Array, post: Array, least_prior: Array, least_post: Array, by_s: float) -> None:
    """Take `by_s` (rounding) from the waits that are longer than required, the longest first; changes the arrays."""
    for waits, least, v in sorted(
        ((w, b, v) for w, b in ((prior, least_prior), (post, least_post)) for v in range(w.size)),
        key=lambda item: -(item[0][item[2]] - item[1][item[2]]),
    ):
        taken = min(float(waits[v] - least[v]), by_s)
        waits[v] -= taken
        by_s -= taken
