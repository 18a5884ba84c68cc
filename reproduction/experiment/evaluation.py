"""The plan experiment as a whole: every method with the pipeline's payload, the optimum with other payloads, tables."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from reproduction.config import EvaluatePlansParams, RobotParams
from reproduction.experiment.data import ExperimentData
from reproduction.experiment.gaps import win_rows
from reproduction.experiment.outcomes import (
    Outcome,
    cycle_times_s,
    full_speed_energies_j,
    joined_outcomes,
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
from reproduction.methods.registry import METHODS
from reproduction.methods.robojoule_simulated import RobojouleSimulated
from reproduction.methods.unoptimized import Unoptimized
from reproduction.parts import HERE, Parts
from reproduction.tables import Row
from robojoule.planning.batch import TreeBatch
from robojoule.programs.operation_tree import OperationTree

# Cycle times of the thesis's tables, shares of the least one. [%]
TABLE_6_2 = (110.0, 121.0, 133.0)
TABLE_6_3 = (150.0, 175.0, 200.0)
TREES_OF_A_PART = 5
Progress = Callable[[str], None]


def evaluate(
    robot: RobotParams, settings: EvaluatePlansParams, data: ExperimentData, progress: Progress, parts: Parts = HERE
) -> tuple[ExperimentResults, list[Row]]:
    """Plan and simulate with every method, and the optimum with other payloads, some trees at once.

    Args:
        robot: Which robot carries what.
        settings: Cycle times, chords, form of the three-segment profile, density of the true profiles, payloads.
        data: Trees and what methods know of them.
        progress: Called with a line of text now and then.
        parts: Where parts are computed and kept.

    Returns:
        The experiment's results, and the rows of the sensitivity to the payload.

    Raises:
        PlanningError: The solver failed, a plan is longer than its cycle time, or better than the optimum.
    """
    compared = [payload for payload in settings.payload_sensitivity_kg if robot.carries(payload)]
    if left_out := [f"{payload:g} kg" for payload in settings.payload_sensitivity_kg if payload not in compared]:
        progress(f"{robot.name} is not rated for {', '.join(left_out)}: left out of the sensitivity to the payload")
    tasks = planned_parts(robot, settings, data, [payload for payload in compared if payload != robot.payload_kg])
    made = parts.map(plan_part, [(task,) for task in tasks], _counted(len(tasks), progress))
    outcomes = {payload: _joined(tasks, made, payload) for payload in {robot.payload_kg, *compared}}
    ordered = {method.variant: outcomes[robot.payload_kg][method.variant] for method in _methods(data, settings)}
    verify(ordered, settings.relaxations_percent)
    with threadpool_limits(1):
        found = _results(data.batch, data.complexities, settings, ordered)
        payloads = []
        for payload in compared:
            results = found
            if payload != robot.payload_kg:
                batch = TreeBatch(robot.robot(payload), data.batch.trees, data.batch.slowest_speed_limit)
                results = _results(batch, data.complexities, settings, outcomes[payload])
            payloads += payload_rows(results, payload)
    return found, payloads


@dataclass(frozen=True, eq=False)
class PlanPart:
    """Plans of some trees by some methods with one payload.

    Attributes:
        robot: Which robot.
        payload_kg: What it carries. [kg]
        first_tree: Number of the first tree, from 0.
        trees: The trees.
        slowest_speed_limit: Least speed limit of a plan. [-]
        methods: The methods, with what they know of the trees' motions.
        cycle_times_percent: Cycle times as shares of the least one. [%]
    """

    robot: RobotParams
    payload_kg: float
    first_tree: int
    trees: Sequence[OperationTree]
    slowest_speed_limit: float
    methods: Sequence[Method]
    cycle_times_percent: Sequence[float]


def planned_parts(
    robot: RobotParams, settings: EvaluatePlansParams, data: ExperimentData, other_payloads_kg: Sequence[float]
) -> list[PlanPart]:
    """How the experiment is cut; the cut does not depend on who computes the parts."""
    parts, batch = [], data.batch

    def add(payload_kg: float, first: int, last: int, methods: Sequence[Method]) -> None:
        trees, slowest = batch.trees[first:last], batch.slowest_speed_limit
        parts.append(PlanPart(robot, payload_kg, first, trees, slowest, methods, settings.relaxations_percent))

    add(robot.payload_kg, 0, len(batch.trees), [one for one in _methods(data, settings) if _of_all_trees(one)])
    for first in range(0, len(batch.trees), TREES_OF_A_PART):
        last = min(first + TREES_OF_A_PART, len(batch.trees))
        known = data.knowledge.subset(slice(batch.rows[first].start, batch.rows[last - 1].stop))
        methods = [method for variants in METHODS.values() for method in variants(known, settings)]
        add(robot.payload_kg, first, last, [one for one in methods if not _of_all_trees(one)])
        for payload in other_payloads_kg:
            add(payload, first, last, [Unoptimized(), Optimum(settings.dense_speed_limits)])
    return parts


def _methods(data: ExperimentData, settings: EvaluatePlansParams) -> list[Method]:
    return [method for variants in METHODS.values() for method in variants(data.knowledge, settings)]


def _of_all_trees(method: Method) -> bool:
    """Whether its plans must be made together: it asks for few runs of many trees at once, in one product."""
    return method.variant == RobojouleSimulated.variant


def plan_part(part: PlanPart) -> dict[Variant, Outcome]:
    """Plan the trees of a part, write back, simulate: the outcome of each method."""
    batch = TreeBatch(part.robot.robot(part.payload_kg), part.trees, part.slowest_speed_limit)
    times_s = cycle_times_s(batch, part.cycle_times_percent)
    planned = [method.plan(batch, times_s) for method in part.methods]
    variants = [method.variant for method in part.methods]
    return dict(zip(variants, simulate_plans(batch, planned), strict=True))


def _counted(total: int, progress: Progress) -> Callable[[int, object], None]:
    """Tells how many parts are done."""
    count = itertools.count(1)
    return lambda number, result: progress(f"part {next(count)} of {total} planned and simulated")


def _joined(
    parts: Sequence[PlanPart], made: Sequence[dict[Variant, Outcome]], payload_kg: float
) -> dict[Variant, Outcome]:
    """Outcomes of all trees with one payload."""
    pieces: dict[Variant, list[Outcome]] = {}
    for part, outcomes in zip(parts, made, strict=True):
        if part.payload_kg == payload_kg:
            for variant, outcome in outcomes.items():
                pieces.setdefault(variant, []).append(outcome)
    return {variant: joined_outcomes(found) for variant, found in pieces.items()}


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
