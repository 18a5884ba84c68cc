"""Plan the experiment trees with every method, simulate the plans, and compare (thesis chapter 6)."""

from __future__ import annotations

import json
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pyarrow.parquet as pq
from threadpoolctl import threadpool_limits

from reproduction.claims.plans import plan_claims
from reproduction.config import Params
from reproduction.experiment import results
from reproduction.experiment.data import read_experiment
from reproduction.experiment.experiment import full_speed_energies_j, run_experiment, sensitivity
from reproduction.experiment.gaps import win_rows
from reproduction.tables import Row, write_csv
from robojoule.documents import atomic_path, write_text
from robojoule.formats.tree_files import load_tree
from robojoule.planning.batch import TreeBatch
from stages._cli import run
from stages.layout import Layout

TABLE_6_2 = (110.0, 121.0, 133.0)
TABLE_6_3 = (150.0, 175.0, 200.0)


def evaluate_plans(params: Params, layout: Layout) -> None:
    """Write data/plans.parquet, Tables 6.1-6.3, the sensitivity to the payload, claims and metrics."""
    settings = params.evaluate_plans
    with threadpool_limits(1):  # sums of a matrix product depend on the number of threads
        data = read_experiment(
            params.robot.robot(),
            trees=layout.trees,
            trees_dir=layout.trees_dir,
            motions=layout.motions,
            runs=layout.runs,
            samples_dir=layout.samples_dir,
            predictions=layout.predictions,
            profile_predictor=layout.models_dir / "profile_predictor",
        )
    others = [payload for payload in settings.payload_sensitivity_kg if payload != params.robot.payload_kg]
    # Spawned, not forked: a copy of a process with threads may hang. The second processor takes the other payloads.
    with threadpool_limits(1), ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        slowest = data.batch.slowest_speed_limit
        jobs = {
            payload: pool.submit(_with_payload, params, layout.trees_dir, data.tree_ids, slowest, payload)
            for payload in others
        }
        cycles = run_experiment(data.batch, data.beliefs, settings, _say)
        found = results.ExperimentResults(
            data.tree_ids,
            data.complexities,
            data.batch.least_cycles_s,
            full_speed_energies_j(data.batch),
            tuple(cycles),
        )
        payloads = [
            row
            for payload in settings.payload_sensitivity_kg
            for row in (jobs[payload].result() if payload in jobs else results.payload_rows(found, payload))
        ]
    with atomic_path(layout.plans) as temporary:
        pq.write_table(results.plans_table(found, data.batch), temporary, compression="zstd")
    for name, rows in {
        "table_6_1": results.table_6_1(found),
        "table_6_1_thesis": results.table_6_1_thesis(found),
        "table_6_2": results.table_by_tree(found, TABLE_6_2),
        "table_6_3": results.table_by_tree(found, TABLE_6_3),
        "gaps": results.gaps_table(found),
        "wins": win_rows(found.plan_energies(), {}),
        "payload_sensitivity": payloads,
        "claims_plans": [claim.row() for claim in plan_claims(found, data.batch)],
    }.items():
        write_csv(layout.tables_dir / f"{name}.csv", rows)
    write_text(layout.metrics_dir / "plans.json", json.dumps(results.metrics(found), indent=2) + "\n")


def _with_payload(
    params: Params, trees_dir: Path, tree_ids: tuple[str, ...], slowest: float, payload_kg: float
) -> list[Row]:
    """Rows of the sensitivity for one payload; runs in a process of its own."""
    robot = params.robot.robot(payload_kg)
    with threadpool_limits(1):
        batch = TreeBatch(robot, [load_tree(trees_dir / f"{tree_id}.yaml", robot) for tree_id in tree_ids], slowest)
        cycles = tuple(sensitivity(batch, params.evaluate_plans, _say))
        energies = full_speed_energies_j(batch)
    complexities = ("",) * len(tree_ids)  # the rows do not tell trees apart
    found = results.ExperimentResults(tree_ids, complexities, batch.least_cycles_s, energies, cycles)
    return results.payload_rows(found, payload_kg)


def _say(text: str) -> None:
    print(f"evaluate_plans: {text}", flush=True)


def main() -> None:
    """Run from the command line."""
    run(evaluate_plans)


if __name__ == "__main__":
    main()
