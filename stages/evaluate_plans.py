"""Plan the experiment trees with every method, simulate the plans, and compare (thesis chapter 6)."""

from __future__ import annotations

from concurrent.futures import Executor

from reproduction.claims import read_claims, write_claims
from reproduction.config import Params, load_params
from reproduction.experiment.claims import plan_claims
from reproduction.experiment.data import ExperimentData, read_experiment
from reproduction.experiment.evaluation import evaluate, result_tables
from reproduction.experiment.results import ExperimentResults, metrics, plans_table
from reproduction.layout import Layout
from reproduction.parts import Parts
from reproduction.tables import Row, write_csv, write_parquet
from robojoule.documents import write_document
from stages.cli import run, say


def compute(
    params: Params, layout: Layout, executor: Executor | None = None
) -> tuple[Parts, ExperimentData, ExperimentResults, list[Row]]:
    """Parts of the stage, computed by an executor or by processes here, and what comes of them."""
    settings, files = params.evaluate_plans, (layout.trees, layout.runs, layout.predictions)
    data = read_experiment(params.robot.robot(), layout, settings.predicted_speed_limits)
    profiles = [path.read_bytes() for path in sorted(layout.profile_predictor.iterdir())]
    inputs = [*(path.read_bytes() for path in files), data.knowledge.final_power_w.tobytes(), *profiles]
    key = params.model_dump(mode="json", include={"robot", "evaluate_plans"})
    parts = Parts.of_stage("evaluate_plans", layout, key, inputs, executor)
    return parts, data, *evaluate(params.robot, settings, data, say("evaluate_plans"), parts)


def evaluate_plans(params: Params, layout: Layout) -> None:
    """Write data/plans.parquet, Tables 6.1-6.3, the sensitivity to the payload, the claims of all chapters, metrics."""
    claims = read_claims(layout.feature_claims) + read_claims(layout.predictor_claims)
    parts, data, found, payloads = compute(params, layout)
    write_parquet(layout.plans, plans_table(found, data.batch))
    for name, rows in (result_tables(found) | {"payload_sensitivity": payloads}).items():
        write_csv(layout.tables_dir / f"{name}.csv", rows)
    claims += plan_claims(found, data.batch, params.evaluate_plans.krc_slowest_percent / 100.0)
    write_claims(layout.tables_dir / "claims.csv", claims if params.robot.is_reference else [])
    write_document(layout.metrics_dir / "plans.json", metrics(found))
    parts.forget()


if __name__ == "__main__":
    run(evaluate_plans, load_params)
