"""Plans of a study: what each method believes of the motions, the plan that follows, and what the plant makes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from reproduction.experiment.experiment import cycle_times
from reproduction.experiment.gaps import PlanEnergies
from reproduction.methods.methods import (
    WAIT_PREFERENCE_W,
    greedy,
    polynomial_costs,
    profiling_speed_limits,
    sampled_profiles,
    three_segment_costs,
    uniform_speed_limits,
)
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.study.cases import PlantBatch
from robojoule.arrays import Array
from robojoule.motion.simulation import MotionPaths
from robojoule.planning.batch import TreeBatch
from robojoule.planning.chain import chain_plans
from robojoule.planning.costs import VertexCosts
from robojoule.planning.rule import rule_plan
from robojoule.planning.schedule import Schedule
from robojoule.planning.writeback import stacked_durations
from robojoule.profile.sampled import sampled_profile
from robojoule.profile.source import ProfileSource

THREE_SEGMENT_METHODS = ("predicted_three_segment", "mean")  # whose rising slope is their idle power
Costs = list[list[VertexCosts]]
BRACKETS = 33
BISECTIONS = 18
REFINED = np.array([-0.5, -0.25, 0.0, 0.25, 0.5])  # further samples of the true profile, in steps of the first ones


def path_costs(batch: TreeBatch, paths: MotionPaths, speed_limits: Array) -> Costs:
    """Costs of profiles that a simulation of `paths` gives at speed limits, shape (M, S)."""
    runs = paths.simulate(speed_limits)
    return _hull_costs(batch, paths, speed_limits, runs.duration_s, runs.energy_j)


def _hull_costs(batch: TreeBatch, paths: MotionPaths, limits: Array, duration_s: Array, energy_j: Array) -> Costs:
    start, end = paths.idle_power_start_w, paths.idle_power_end_w
    return [
        [
            VertexCosts(
                sampled_profile(duration_s[m], energy_j[m], limits[m]).piecewise().lower_hull,
                float(start[m]),
                float(end[m]),
            )
            for m in range(rows.start, rows.stop)
        ]
        for rows in batch.rows
    ]


def source_costs(batch: TreeBatch, source: ProfileSource) -> Costs:
    """Costs by the profiles and the idle power of a source."""
    start, end = source.idle_start_w, source.idle_end_w
    return [
        [VertexCosts(source.enclosure(m).above, float(start[m]), float(end[m])) for m in range(rows.start, rows.stop)]
        for rows in batch.rows
    ]


def polynomial_method(batch: PlantBatch, segments: int) -> Costs:
    """The original plug-in: five runs of the plant, Eq. 3.1, equidistant chords, true idle power."""
    limits = profiling_speed_limits(batch, "speed")
    runs = batch.paths.simulate(limits)
    profiles = sampled_profiles(runs.duration_s, runs.energy_j, limits)
    return [
        polynomial_costs(profiles[rows], segments, batch.idle_prior_w[rows], batch.idle_post_w[rows])
        for rows in batch.rows
    ]


def three_segment_method(batch: TreeBatch, parameters: Array) -> Costs:
    """The thesis's predictor: three numbers of each motion (saving, optimal duration, penalty), shape (M, 3)."""
    return [
        three_segment_costs(
            batch.d_min_s[rows],
            parameters[rows, 1],
            batch.d_max_s[rows],
            parameters[rows, 0],
            parameters[rows, 2],
            ThreeSegmentShape(),
        )
        for rows in batch.rows
    ]


def evaluate_plans(
    batch: PlantBatch, methods: Mapping[str, Costs], relaxations_percent: Sequence[float], dense_speed_limits: int
) -> PlanEnergies:
    """Plan every tree by every method and simulate the plans on the plant.

    Args:
        batch: Trees on their plant.
        methods: Costs by method; `THREE_SEGMENT_METHODS` prefer waiting as in the thesis.
        relaxations_percent: Cycle times as shares of the least one. [%]
        dense_speed_limits: Speed limits of the true profiles for the optimum.

    Returns:
        Energies, also of `unoptimized`, `uniform`, `greedy` and `optimum`: the best plan found on the true profiles
        or by any method.
    """
    times = cycle_times(batch, relaxations_percent)
    plans: dict[str, list[list[Schedule]]] = _rules(batch, times)
    for method, costs in methods.items():
        preference = WAIT_PREFERENCE_W if method in THREE_SEGMENT_METHODS else 0.0
        plans[method] = _solved(batch, costs, times, preference)
    plans["optimum"] = _optimum(batch, times, dense_speed_limits)
    limits = np.concatenate([planned_speed_limits(batch, of_method) for of_method in plans.values()], axis=1)
    runs = batch.paths.simulate(limits)
    count = times.shape[1]
    energies = {}
    for place, (method, of_method) in enumerate(plans.items()):
        columns = slice(place * count, (place + 1) * count)
        energies[method] = _cycle_energies(batch, of_method, runs.duration_s[:, columns], runs.energy_j[:, columns])
    # Hulls hide where a true profile is not convex: a plan of another method may then be better by some 0.01 %.
    energies["optimum"] = np.min(list(energies.values()), axis=0)
    return PlanEnergies(tuple(relaxations_percent), energies)


def _solved(batch: PlantBatch, costs: Costs, times: Array, preference_w: float = 0.0) -> list[list[Schedule]]:
    return [
        chain_plans(graph, of_tree, row, preference_w)
        for graph, of_tree, row in zip(batch.graphs, costs, times, strict=True)
    ]


def _optimum(batch: PlantBatch, times: Array, dense_speed_limits: int) -> list[list[Schedule]]:
    """Plans on the hulls of densely simulated true profiles, refined once round the planned speed limits."""
    limits = batch.speed_limits(dense_speed_limits)
    runs = batch.paths.simulate(limits)
    plans = _solved(batch, _hull_costs(batch, batch.paths, limits, runs.duration_s, runs.energy_j), times)
    around = planned_speed_limits(batch, plans)
    spacing = (limits[:, -1] - limits[:, 0])[:, np.newaxis, np.newaxis] / (dense_speed_limits - 1)
    finer = around[:, :, np.newaxis] + spacing * REFINED
    refined = np.clip(finer.reshape(len(limits), -1), limits[:, :1], limits[:, -1:])
    more = batch.paths.simulate(refined)
    # Sampled over the whole range too, so that a plan may move away from where the first one was.
    joined = [
        np.concatenate(pair, axis=1)
        for pair in ((limits, refined), (runs.duration_s, more.duration_s), (runs.energy_j, more.energy_j))
    ]
    return _solved(batch, _hull_costs(batch, batch.paths, *joined), times)


def planned_speed_limits(batch: TreeBatch, plans: Sequence[Sequence[Schedule]]) -> Array:
    """Lowest speed limits that keep the durations of plans, K a tree, to within 1e-7 s; shape (M, K). [-]

    As `robojoule.planning.writeback.speed_limits_of_plans`, but bisected from a bracket, for thousands of plans.
    """
    wanted = stacked_durations(plans)
    grid = np.linspace(0.0, 1.0, BRACKETS)
    slowest, top = batch.slowest_speed_limit, batch.saturating_speed_limits[:, np.newaxis]
    limits = np.minimum(slowest + grid * (top - slowest), 1.0)
    # The running minimum makes a table of what limits up to each one reach.
    known = np.minimum.accumulate(batch.paths.durations(limits), axis=1)
    first = (known[:, np.newaxis, :] > wanted[:, :, np.newaxis]).sum(axis=2)
    high = np.take_along_axis(limits, np.minimum(first, BRACKETS - 1), axis=1)
    low = np.take_along_axis(limits, np.clip(first - 1, 0, BRACKETS - 1), axis=1)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        fast_enough = batch.paths.durations(middle) <= wanted
        high, low = np.where(fast_enough, middle, high), np.where(fast_enough, low, middle)
    return np.asarray(high)


def _rules(batch: PlantBatch, times: Array) -> dict[str, list[list[Schedule]]]:
    common = uniform_speed_limits(batch, times)
    of_motions = np.repeat(common, [rows.stop - rows.start for rows in batch.rows], axis=0)
    uniform = batch.paths.durations(of_motions)
    limits = batch.speed_limits(10)
    runs = batch.paths.simulate(limits)
    profiles = sampled_profiles(runs.duration_s, runs.energy_j, limits)
    cases = list(zip(batch.graphs, batch.rows, times, strict=True))
    return {
        "unoptimized": [[rule_plan(g, batch.d_min_s[rows], float(t)) for t in row] for g, rows, row in cases],
        "uniform": [[rule_plan(g, uniform[rows, r], float(t)) for r, t in enumerate(row)] for g, rows, row in cases],
        "greedy": [[greedy(g, profiles[rows], float(t)) for t in row] for g, rows, row in cases],
    }


def _cycle_energies(batch: PlantBatch, plans: list[list[Schedule]], durations_s: Array, energies_j: Array) -> Array:
    """Energies of cycles, shape (T, R); what a motion is faster than planned becomes wait after it. [J]"""
    result = np.empty((len(batch.rows), len(plans[0])))
    for tree, rows in enumerate(batch.rows):
        prior, post = batch.idle_prior_w[rows], batch.idle_post_w[rows]
        for r, plan in enumerate(plans[tree]):
            after = plan.post_waits_s + plan.collision_waits_s + plan.durations_s - durations_s[rows, r]
            result[tree, r] = float(energies_j[rows, r].sum() + plan.prior_waits_s @ prior + after @ post)
    return result
