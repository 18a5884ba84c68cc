"""The plan experiment as a whole: every method with the pipeline's payload, the optimum with other payloads, tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from threadpoolctl import threadpool_limits

from reproduction.config import EvaluatePlansParams, RobotParams
from reproduction.experiment.data import ExperimentData
from reproduction.experiment.gaps import win_rows
from reproduction.experiment.outcomes import (
    Outcome,
    cycle_times_s,
    full_speed_energies_j,
    simulate_plans,
    verify,
)
from reproduction.experiment.results import (
    ExperimentResults,
    gaps_table,
    payload_rows,
    table_6_1,
    table_6_1_thesis,
    table_by_tree,
)
from reproduction.methods.method import Method, Variant
from reproduction.methods.optimum import Optimum
from reproduction.methods.registry import METHODS, Knowledge
from reproduction.methods.unoptimized import Unoptimized
from reproduction.pools import worker_pool
from reproduction.tables import Row
from robojoule.planning.batch import TreeBatch
from robojoule.programs.operation_tree import OperationTree

# Cycle times of the thesis's tables, shares of the least one. [%]
TABLE_6_2 = (110.0, 121.0, 133.0)
TABLE_6_3 = (150.0, 175.0, 200.0)
Progress = Callable[[str], None]


def evaluate(
    robot: RobotParams, settings: EvaluatePlansParams, data: ExperimentData, progress: Progress
) -> tuple[ExperimentResults, list[Row]]:
    """Plan and simulate with every method, and the optimum with other payloads on a second processor.

    Args:
        robot: Which robot carries what.
        settings: Cycle times, chords, form of the three-segment profile, density of the true profiles, payloads.
        data: Trees and what methods know of them.
        progress: Called with a line of text now and then; a function that other processes can load.

    Returns:
        The experiment's results, and the rows of the sensitivity to the payload.
    """
    compared = [payload for payload in settings.payload_sensitivity_kg if robot.carries(payload)]
    if left_out := [f"{payload:g} kg" for payload in settings.payload_sensitivity_kg if payload not in compared]:
        progress(f"{robot.name} is not rated for {', '.join(left_out)}: left out of the sensitivity to the payload")
    others = [payload for payload in compared if payload != robot.payload_kg]
    with threadpool_limits(1), worker_pool(1) as pool:
        slowest = data.batch.slowest_speed_limit
        jobs = {
            payload: pool.submit(_with_payload, robot, settings, data.batch.trees, slowest, payload, progress)
            for payload in others
        }
        outcomes = run_experiment(data.batch, data.knowledge, settings, progress)
        found = _results(data.batch, data.complexities, settings, outcomes)
        payloads = [
            row
            for payload in compared
            for row in (jobs[payload].result() if payload in jobs else payload_rows(found, payload))
        ]
    return found, payloads


def _with_payload(
    robot: RobotParams,
    settings: EvaluatePlansParams,
    trees: Sequence[OperationTree],
    slowest: float,
    payload_kg: float,
    progress: Progress,
) -> list[Row]:
    """Rows of the sensitivity for one payload; runs in a process of its own."""
    with threadpool_limits(1):
        batch = TreeBatch(robot.robot(payload_kg), trees, slowest)
        outcomes = plan_and_simulate(
            batch,
            [Unoptimized(), Optimum(settings.dense_speed_limits)],
            settings.relaxations_percent,
            lambda text: progress(f"{payload_kg:g} kg: {text}"),
        )
        complexities = ("",) * len(trees)  # the rows do not tell trees apart
        return payload_rows(_results(batch, complexities, settings, outcomes), payload_kg)


def _results(
    batch: TreeBatch,
    complexities: tuple[str, ...],
    settings: EvaluatePlansParams,
    outcomes: dict[Variant, Outcome],
) -> ExperimentResults:
    return ExperimentResults(
        tuple(tree.name for tree in batch.trees),
        complexities,
        batch.least_cycles_s,
        full_speed_energies_j(batch),
        tuple(settings.relaxations_percent),
        outcomes,
    )


def run_experiment(
    batch: TreeBatch, known: Knowledge, settings: EvaluatePlansParams, progress: Progress
) -> dict[Variant, Outcome]:
    """Plan with every method of the registry, write back, simulate.

    Args:
        batch: Experiment trees.
        known: What the pipeline's files tell methods about their motions.
        settings: Cycle times, chords, form of the three-segment profile, density of the true profiles.
        progress: Called with a line of text now and then.

    Raises:
        PlanningError: The solver failed, a plan is longer than its cycle time, or better than the optimum.
    """
    methods = [method for variants in METHODS.values() for method in variants(known, settings)]
    outcomes = plan_and_simulate(batch, methods, settings.relaxations_percent, progress)
    verify(outcomes, settings.relaxations_percent)
    return outcomes


def plan_and_simulate(
    batch: TreeBatch, methods: Sequence[Method], cycle_times_percent: Sequence[float], progress: Progress
) -> dict[Variant, Outcome]:
    """Outcomes of methods, in their order, at cycle times that are shares of the least one. [%]"""
    planned = {}
    for method in methods:
        planned[method.variant] = method.plan(batch, cycle_times_s(batch, cycle_times_percent))
        spacing = f", runs equidistant in {method.variant.point_spacing}" if method.variant.point_spacing else ""
        progress(f"{method.variant.name}{spacing}")
    outcomes = simulate_plans(batch, list(planned.values()))
    progress(f"{len(planned) * len(batch.trees) * len(cycle_times_percent)} plans written back and simulated")
    return dict(zip(planned, outcomes, strict=True))


def result_tables(found: ExperimentResults) -> dict[str, list[Row]]:
    """Tables by the name of their file."""
    return {
        "table_6_1": table_6_1(found),
        "table_6_1_thesis": table_6_1_thesis(found),
        "table_6_2": table_by_tree(found, TABLE_6_2),
        "table_6_3": table_by_tree(found, TABLE_6_3),
        "gaps": gaps_table(found),
        "wins": win_rows(found.plan_energies(), {}),
    }
