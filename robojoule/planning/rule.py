"""Plans by rule: given durations, and waiting at the end of the cycle for the rest of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.graph import OptimizationGraph
from robojoule.planning.schedule import Schedule, check_cycle_time


def rule_plan(graph: OptimizationGraph, durations_s: ArrayLike, cycle_time_s: float) -> Schedule:
    """Plan with given durations of one robot that waits at the end of the cycle (HOME) for the rest of it.

    Args:
        graph: Graph of one robot.
        durations_s: Duration of each vertex, shape (V,). [s]
        cycle_time_s: Cycle time. [s]

    Raises:
        CycleTimeTooShort: Durations and required waits do not fit.
        InputError: More than one robot.
    """
    if len(graph.robots) != 1:
        raise InputError("a rule plans for one robot only", key="vertices")
    durations = np.asarray(durations_s, dtype=float)
    check_cycle_time(graph, durations, cycle_time_s)
    prior = np.array([vertex.least_prior_wait_s for vertex in graph.vertices])
    post = np.array([vertex.least_post_wait_s for vertex in graph.vertices])
    post[-1] += max(cycle_time_s - float((prior + durations + post).sum()), 0.0)
    ends = np.cumsum(prior + durations + post)
    starts = ends - post - durations
    return Schedule("rule", cycle_time_s, durations, prior, post, np.zeros_like(post), starts)


def rule_plans(batch: TreeBatch, durations_s: Array, cycle_times_s: Array) -> list[list[Schedule]]:
    """R plans for each tree of a batch; see `rule_plan`.

    Args:
        batch: Trees.
        durations_s: Durations of the motions, shape (M, R). [s]
        cycle_times_s: Cycle times of each tree, shape (T, R). [s]
    """
    return [
        [rule_plan(graph, durations_s[rows, r], float(time)) for r, time in enumerate(row)]
        for graph, rows, row in zip(batch.graphs, batch.rows, cycle_times_s, strict=True)
    ]
