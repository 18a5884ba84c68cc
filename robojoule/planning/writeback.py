"""Close the loop (thesis 2.1.2): plan -> speed limits and waits in the operation tree -> simulation of that tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.graph import OptimizationGraph, graph_of_tree, process_energy_j
from robojoule.planning.schedule import Schedule
from robojoule.programs.operation_tree import OperationTree


@dataclass(frozen=True, eq=False)
class CycleRun:
    """Simulation of one cycle of a tree, in the order of its vertices.

    Attributes:
        speed_limits: Speed limit of each motion, shape (V,), fractions in (0, 1].
        durations_s: Shape (V,). [s]
        prior_waits_s: Wait before each motion, shape (V,). [s]
        post_waits_s: Wait after each motion, shape (V,). [s]
        vertex_energies_j: Energy of each motion with its waits, shape (V,). [J]
        energy_j: Energy of the cycle with waits and process steps. [J]
        cycle_time_s: Length of the cycle. [s]
    """

    speed_limits: Array
    durations_s: Array
    prior_waits_s: Array
    post_waits_s: Array
    vertex_energies_j: Array
    energy_j: float
    cycle_time_s: float


def speed_limits_of_plans(batch: TreeBatch, plans: Sequence[Sequence[Schedule]]) -> Array:
    """Lowest speed limits that keep the durations of plans.

    Args:
        batch: Trees.
        plans: K plans for each tree.

    Returns:
        Shape (M, K); within the batch's slowest speed limit and 1. [-]
    """
    durations = stacked_durations(plans)
    columns = [batch.paths.speed_limits_for_durations(np.maximum(column, batch.d_min_s)) for column in durations.T]
    return np.asarray(np.clip(np.stack(columns, axis=1), batch.slowest_speed_limit, 1.0))


def stacked_durations(plans: Sequence[Sequence[Schedule]]) -> Array:
    """Durations of K plans for each tree, shape (M, K). [s]"""
    return np.concatenate([np.stack([plan.durations_s for plan in row], axis=1) for row in plans])


def write_plan(
    tree: OperationTree, graph: OptimizationGraph, plan: Schedule, speed_limits: Array, durations_s: Array
) -> OperationTree:
    """Write speed limits and waits into the tree so that the cycle takes exactly the plan's cycle time.

    What a motion is faster than planned (rounding of the speed limit) becomes wait after it.

    Args:
        tree: The tree that was planned.
        graph: Its graph; every vertex is one move.
        plan: Plan for it.
        speed_limits: Speed limit of each vertex, shape (V,). [-]
        durations_s: Duration that the simulation gives at these speed limits, shape (V,). [s]

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
    moves = {move.name: move for move in tree.moves()}
    before, after = {}, {}
    for v, vertex in enumerate(graph.vertices):
        first, last = moves[vertex.moves[0]], moves[vertex.moves[-1]]
        # Wait operations and process steps stay as they are: the move's own wait is what goes beyond them.
        before[first.name] = max(float(prior[v] - least_prior[v]) + first.wait_before_s, 0.0)
        after[last.name] = max(float(post[v] - least_post[v]) + last.wait_after_s, 0.0)
    limits = {vertex.moves[-1]: 100.0 * float(p) for vertex, p in zip(graph.vertices, speed_limits, strict=True)}
    return tree.with_plan(limits, waits_before_s=before, waits_after_s=after)


def _shorten(prior: Array, post: Array, least_prior: Array, least_post: Array, by_s: float) -> None:
    """Take `by_s` (rounding) from the waits that are longer than required, the longest first; changes the arrays."""
    for waits, least, v in sorted(
        ((w, b, v) for w, b in ((prior, least_prior), (post, least_post)) for v in range(w.size)),
        key=lambda item: -(item[0][item[2]] - item[1][item[2]]),
    ):
        taken = min(float(waits[v] - least[v]), by_s)
        waits[v] -= taken
        by_s -= taken


def simulate_trees(batch: TreeBatch, written: Sequence[Sequence[OperationTree]]) -> list[list[CycleRun]]:
    """Simulate trees as they stand: their speed limits, waits and process steps.

    Args:
        batch: The trees before planning; the written ones must have the same configurations.
        written: K written trees for each tree of the batch.

    Returns:
        K runs for each tree.

    Raises:
        InputError: A written tree goes elsewhere than the batch's.
    """
    for tree, variants in zip(batch.trees, written, strict=True):
        for variant in variants:
            if not np.array_equal(variant.configurations_rad(), tree.configurations_rad()):
                raise InputError(f"the written tree does not visit the configurations of '{tree.name}'")
    limits = np.concatenate(
        [
            np.array([[move.speed_limit_percent / 100.0 for move in variant.moves()] for variant in variants]).T
            for variants in written
        ]
    )
    runs = batch.paths.simulate(limits)
    result = []
    for rows, variants in zip(batch.rows, written, strict=True):
        result.append(
            [
                _cycle_run(
                    variant,
                    limits[rows, k],
                    runs.duration_s[rows, k],
                    runs.energy_j[rows, k],
                    batch.idle_prior_w[rows],
                    batch.idle_post_w[rows],
                )
                for k, variant in enumerate(variants)
            ]
        )
    return result


def _cycle_run(
    tree: OperationTree, limits: Array, durations: Array, energies: Array, idle_prior_w: Array, idle_post_w: Array
) -> CycleRun:
    vertices = graph_of_tree(tree).vertices
    prior = np.array([vertex.least_prior_wait_s for vertex in vertices])
    post = np.array([vertex.least_post_wait_s for vertex in vertices])
    vertex_energies = energies + idle_prior_w * prior + idle_post_w * post
    return CycleRun(
        speed_limits=limits,
        durations_s=durations,
        prior_waits_s=prior,
        post_waits_s=post,
        vertex_energies_j=vertex_energies,
        energy_j=float(vertex_energies.sum()) + process_energy_j(tree),
        cycle_time_s=float((prior + durations + post).sum()),
    )
