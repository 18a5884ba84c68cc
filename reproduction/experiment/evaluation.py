"""The plan experiment as a whole: every method with the pipeline's payload, the optimum with other payloads, tables."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from threadpoolctl import threadpool_limits

from reproduction.config import EvaluatePlansParams, RobotParams
from reproduction.experiment.data import ExperimentData
from reproduction.experiment.experiment import Progress, full_speed_energies_j, run_experiment, sensitivity
from reproduction.experiment.gaps import win_rows
from reproduction.experiment.results import (
    ExperimentResults,
    gaps_table,
    payload_rows,
    table_6_1,
    table_6_1_thesis,
    table_by_tree,
)
from reproduction.tables import Row
from robojoule.planning.batch import TreeBatch
from robojoule.programs.operation_tree import OperationTree

# Cycle times of the thesis's tables, shares of the least one. [%]
TABLE_6_2 = (110.0, 121.0, 133.0)
TABLE_6_3 = (150.0, 175.0, 200.0)


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
    others = [payload for payload in settings.payload_sensitivity_kg if payload != robot.payload_kg]
    # Spawned, not forked: a copy of a process with threads may hang.
    with threadpool_limits(1), ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        slowest = data.batch.slowest_speed_limit
        jobs = {
            payload: pool.submit(_with_payload, robot, settings, data.batch.trees, slowest, payload, progress)
            for payload in others
        }
        cycles = run_experiment(data.batch, data.beliefs, settings, progress)
        found = ExperimentResults(
            data.tree_ids,
            data.complexities,
            data.batch.least_cycles_s,
            full_speed_energies_j(data.batch),
            tuple(cycles),
        )
        payloads = [
            row
            for payload in settings.payload_sensitivity_kg
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
        cycles = tuple(sensitivity(batch, settings, progress))
        energies = full_speed_energies_j(batch)
    complexities = ("",) * len(trees)  # the rows do not tell trees apart
    tree_ids = tuple(tree.name for tree in trees)
    return payload_rows(ExperimentResults(tree_ids, complexities, batch.least_cycles_s, energies, cycles), payload_kg)


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
