"""The plan experiment (thesis chapter 6): every method plans every tree at every cycle time; each plan is simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from reproduction.config import EvaluatePlansParams
from reproduction.methods.methods import (
    PREDICTOR_RUNS,
    PROFILING_RUNS,
    WAIT_PREFERENCE_W,
    greedy,
    polynomial_costs,
    profiling_speed_limits,
    sampled_profiles,
    three_segment_costs,
    uniform_speed_limits,
)
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from robojoule.arrays import Array
from robojoule.errors import PlanningError
from robojoule.planning.batch import TreeBatch
from robojoule.planning.costs import VertexCosts
from robojoule.planning.cycle_run import CycleRun, simulate_trees
from robojoule.planning.optimum import solve_optimum
from robojoule.planning.rule import rule_plan
from robojoule.planning.schedule import Schedule
from robojoule.planning.solver import PlanSolver
from robojoule.planning.source_plans import plan_on_source
from robojoule.planning.writeback import speed_limits_of_plans, write_plan
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.predicted import PredictedProfiles

POINT_SPACINGS = ("speed", "duration")
BELOW_OPTIMUM = 1e-4  # no plan may be better than the optimum by more than this share
LATE_S = 1e-6  # nor longer than its cycle time by more than this
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Variant:
    """A method with its settings.

    Attributes:
        method: Name of the method.
        krc_segments: Number of chords of `krc_polynomial`, else none.
        point_spacing: "speed" or "duration": how its profiling runs are spaced; else none.
    """

    method: str
    krc_segments: int | None = None
    point_spacing: str | None = None


@dataclass(frozen=True, eq=False)
class Beliefs:
    """What methods other than the optimum know about the M motions of the experiment.

    Attributes:
        run_speed_limits: Speed limits of the measured runs, shape (S,), fractions.
        run_durations_s: Their durations, shape (M, S). [s]
        run_energies_j: Their energies, shape (M, S). [J]
        final_power_w: Mean power before the destination of the slowest run, shape (M,). [W]
        predicted_optimal_duration_s: Shape (M,). [s]
        predicted_saving_j: Shape (M,). [J]
        predicted_penalty_j: Shape (M,). [J]
        predicted_profiles: Whole profiles and idle power of the M motions.
    """

    run_speed_limits: Array
    run_durations_s: Array
    run_energies_j: Array
    final_power_w: Array
    predicted_optimal_duration_s: Array
    predicted_saving_j: Array
    predicted_penalty_j: Array
    predicted_profiles: PredictedProfiles


@dataclass(frozen=True, eq=False)
class PlannedCycle:
    """One plan and its simulation.

    Attributes:
        tree: Index of the tree in the batch.
        relaxation_percent: Cycle time as a share of the least one. [%]
        variant: Method and its settings.
        plan: What was planned.
        run: What the simulation of the written tree gave.
        costs: What the method believed about each vertex; none for rules.
        runs_per_motion: Runs of the controller's simulation that the method needs for a new motion, on average.
    """

    tree: int
    relaxation_percent: float
    variant: Variant
    plan: Schedule
    run: CycleRun
    costs: Sequence[VertexCosts] | None
    runs_per_motion: float = 0.0


@dataclass(frozen=True, eq=False)
class _Plans:
    """Plans of one variant: R for each tree.

    A rule that chooses speed limits itself gives them, shape (M, R); other methods give their costs, a list a tree.
    """

    variant: Variant
    plans: list[list[Schedule]]
    speed_limits: Array | None = None
    costs: list[list[VertexCosts]] | None = None
    runs_per_motion: float = 0.0


def run_experiment(
    batch: TreeBatch, beliefs: Beliefs, settings: EvaluatePlansParams, progress: Progress
) -> list[PlannedCycle]:
    """Plan with every method, write back, simulate.

    Args:
        batch: Experiment trees.
        beliefs: Measured and predicted figures of their motions.
        settings: Relaxations, chords, form of the three-segment profile, density of the true profiles.
        progress: Called with a line of text now and then.

    Returns:
        One entry a variant, tree and relaxation.

    Raises:
        PlanningError: The solver failed, a plan is longer than its cycle time, or better than the optimum.
    """
    times = cycle_times(batch, settings.relaxations_percent)
    found = _rules(batch, beliefs, times)
    progress("rules: unoptimized, uniform and greedy plans")
    for spacing in POINT_SPACINGS:
        for segments, costs in _polynomial(batch, beliefs, settings.krc_segments, spacing):
            variant = Variant("krc_polynomial", segments, spacing)
            found.append(_solved(batch, variant, costs, times, runs=PROFILING_RUNS))
            progress(f"krc_polynomial: {segments} chords, runs equidistant in {spacing}")
    costs = _three_segment(batch, beliefs, settings)
    variant = Variant("predicted_three_segment")
    found.append(_solved(batch, variant, costs, times, runs=PREDICTOR_RUNS, preference_w=WAIT_PREFERENCE_W))
    progress("predicted_three_segment")
    predicted = plan_on_source(beliefs.predicted_profiles, batch, times)
    found.append(_Plans(Variant("robojoule_predicted"), predicted.plans, costs=predicted.costs))
    progress("robojoule_predicted")
    profiles = AdaptiveProfiles(batch.paths, batch.slowest_speed_limit)
    simulated = plan_on_source(profiles, batch, times)
    runs = float(profiles.runs.mean())
    found.append(_Plans(Variant("robojoule_simulated"), simulated.plans, None, simulated.costs, runs))
    progress(f"robojoule_simulated: {runs:.1f} runs a motion, at most {profiles.runs.max()}")
    found.append(_optimum(batch, times, settings.dense_speed_limits))
    progress("optimum, with proven bounds")
    cycles = simulate_plans(batch, found, settings.relaxations_percent)
    progress(f"{len(cycles)} plans written back and simulated")
    verify(cycles)
    return cycles


def sensitivity(batch: TreeBatch, settings: EvaluatePlansParams, progress: Progress) -> list[PlannedCycle]:
    """The unoptimized and the optimal plans of trees, e.g. with another payload."""
    times = cycle_times(batch, settings.relaxations_percent)
    found = [_unoptimized(batch, times), _optimum(batch, times, settings.dense_speed_limits, prove=False)]
    progress(f"sensitivity: optimum with {batch.robot.payload.mass_kg:g} kg")
    return simulate_plans(batch, found, settings.relaxations_percent)


def cycle_times(batch: TreeBatch, relaxations_percent: Sequence[float]) -> Array:
    """Cycle times of each tree, shape (T, R): shares of its least cycle time. [s]"""
    return np.asarray(batch.least_cycles_s[:, np.newaxis] * np.asarray(relaxations_percent) / 100.0)


def _unoptimized(batch: TreeBatch, times: Array) -> _Plans:
    plans = _rule_plans(batch, np.repeat(batch.d_min_s[:, np.newaxis], times.shape[1], axis=1), times)
    return _Plans(Variant("unoptimized"), plans, np.ones((batch.paths.motions, times.shape[1])))


def _rules(batch: TreeBatch, beliefs: Beliefs, times: Array) -> list[_Plans]:
    common = uniform_speed_limits(batch, times)
    of_motions = np.repeat(common, [rows.stop - rows.start for rows in batch.rows], axis=0)
    uniform = _rule_plans(batch, batch.paths.durations(of_motions), times)
    limits = np.broadcast_to(beliefs.run_speed_limits, beliefs.run_durations_s.shape)
    measured = sampled_profiles(beliefs.run_durations_s, beliefs.run_energies_j, limits)
    steepest = [
        [greedy(graph, measured[rows], float(time)) for time in row]
        for graph, rows, row in zip(batch.graphs, batch.rows, times, strict=True)
    ]
    return [
        _unoptimized(batch, times),
        _Plans(Variant("uniform"), uniform, of_motions),
        _Plans(Variant("greedy"), steepest, runs_per_motion=len(beliefs.run_speed_limits)),
    ]


def _rule_plans(batch: TreeBatch, durations_s: Array, times: Array) -> list[list[Schedule]]:
    return [
        [rule_plan(graph, durations_s[rows, r], float(time)) for r, time in enumerate(row)]
        for graph, rows, row in zip(batch.graphs, batch.rows, times, strict=True)
    ]


def _polynomial(
    batch: TreeBatch, beliefs: Beliefs, segments: Sequence[int], spacing: str
) -> list[tuple[int, list[list[VertexCosts]]]]:
    limits = profiling_speed_limits(batch, spacing)
    runs = batch.paths.simulate(limits)
    profiles = sampled_profiles(runs.duration_s, runs.energy_j, limits)
    post, prior = beliefs.final_power_w, batch.predecessors(beliefs.final_power_w)
    return [
        (count, [polynomial_costs(profiles[rows], count, prior[rows], post[rows]) for rows in batch.rows])
        for count in segments
    ]


def _three_segment(batch: TreeBatch, beliefs: Beliefs, settings: EvaluatePlansParams) -> list[list[VertexCosts]]:
    form = settings.three_segment
    shape = ThreeSegmentShape(form.left_fraction, form.right_fraction, form.offset_j)
    return [
        three_segment_costs(
            batch.d_min_s[rows],
            beliefs.predicted_optimal_duration_s[rows],
            batch.d_max_s[rows],
            beliefs.predicted_saving_j[rows],
            beliefs.predicted_penalty_j[rows],
            shape,
        )
        for rows in batch.rows
    ]


def _optimum(batch: TreeBatch, times: Array, speed_limits: int, *, prove: bool = True) -> _Plans:
    plans, costs = solve_optimum(batch, times, speed_limits=speed_limits, prove=prove)
    return _Plans(Variant("optimum"), plans, None, costs, speed_limits)


def _solved(
    batch: TreeBatch,
    variant: Variant,
    costs: list[list[VertexCosts]],
    times: Array,
    *,
    runs: int,
    preference_w: float = 0.0,
) -> _Plans:
    """Plans of the planning model: one model a tree for all cycle times."""
    plans = []
    for graph, of_tree, row in zip(batch.graphs, costs, times, strict=True):
        solver = PlanSolver(graph, of_tree, preference_w=preference_w)
        plans.append([solver.solve(float(time)) for time in row])
    return _Plans(variant, plans, None, costs, runs)


def simulate_plans(batch: TreeBatch, found: Sequence[_Plans], relaxations: Sequence[float]) -> list[PlannedCycle]:
    """Write all plans into their trees and simulate these."""
    by_tree = [[plan for variant in found for plan in variant.plans[tree]] for tree in range(len(batch.trees))]
    limits = np.concatenate(
        [speed_limits_of_plans(batch, one.plans) if one.speed_limits is None else one.speed_limits for one in found],
        axis=1,
    )
    durations = batch.paths.durations(limits)
    written = [
        [write_plan(tree, graph, plan, limits[rows, k], durations[rows, k]) for k, plan in enumerate(plans)]
        for tree, graph, rows, plans in zip(batch.trees, batch.graphs, batch.rows, by_tree, strict=True)
    ]
    runs = simulate_trees(batch, written)
    keys = [(one, relaxation) for one in found for relaxation in relaxations]
    return [
        PlannedCycle(
            tree, relaxation, one.variant, plan, run, one.costs[tree] if one.costs else None, one.runs_per_motion
        )
        for tree in range(len(batch.trees))
        for (one, relaxation), plan, run in zip(keys, by_tree[tree], runs[tree], strict=True)
    ]


def full_speed_energies_j(batch: TreeBatch) -> Array:
    """EC_dmin: energy of each tree's fastest cycle, shape (T,): motions at full speed and required waits. [J]"""
    energies = batch.paths.simulate([1.0]).energy_j[:, 0]
    prior, post = (
        np.array([getattr(vertex, name) for graph in batch.graphs for vertex in graph.vertices])
        for name in ("least_prior_wait_s", "least_post_wait_s")
    )
    total = energies + prior * batch.idle_prior_w + post * batch.idle_post_w
    return np.array([total[rows].sum() for rows in batch.rows])


def verify(cycles: Sequence[PlannedCycle]) -> None:
    """Refuse results that cannot be: late cycles, plans better than the proven optimum."""
    best = {(c.tree, c.relaxation_percent): c for c in cycles if c.variant.method == "optimum"}
    for cycle in cycles:
        case = f"{cycle.variant.method}, tree {cycle.tree + 1}, {cycle.relaxation_percent:g} %"
        late = cycle.run.cycle_time_s - cycle.plan.cycle_time_s
        if not abs(late) <= LATE_S:
            raise PlanningError(f"the simulated cycle differs from the planned one by {late:.3g} s ({case})")
        optimum = best[cycle.tree, cycle.relaxation_percent]
        if cycle.run.energy_j < (1.0 - BELOW_OPTIMUM) * optimum.run.energy_j:
            raise PlanningError(
                f"a plan takes {cycle.run.energy_j:.3f} J, less than the optimum, {optimum.run.energy_j:.3f} J ({case})"
            )
        if cycle.variant.method == "optimum" and cycle.plan.bound_j < (1.0 - BELOW_OPTIMUM) * cycle.run.energy_j:
            raise PlanningError(
                f"the proven bound {cycle.plan.bound_j:.3f} J is too far below the optimum's simulated "
                f"{cycle.run.energy_j:.3f} J ({case})"
            )
