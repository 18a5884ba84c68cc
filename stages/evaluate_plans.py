"""Plan the experiment trees with every method, simulate the plans, and compare (thesis chapter 6)."""

from __future__ import annotations

from reproduction.claims import read_claims, write_claims
from reproduction.config import Params, load_params
from reproduction.experiment.claims import plan_claims
from reproduction.experiment.data import read_experiment
from reproduction.experiment.evaluation import evaluate, result_tables
from reproduction.experiment.results import metrics, plans_table
from reproduction.layout import Layout
from reproduction.tables import write_csv, write_parquet
from robojoule.documents import write_document
from stages.cli import run, say


def evaluate_plans(params: Params, layout: Layout) -> None:
    """Write data/plans.parquet, Tables 6.1-6.3, the sensitivity to the payload, the claims of all chapters, metrics."""
    settings = params.evaluate_plans
    claims = read_claims(layout.feature_claims) + read_claims(layout.predictor_claims)
    data = read_experiment(params.robot.robot(), layout, settings.predicted_speed_limits)
    found, payloads = evaluate(params.robot, settings, data, say("evaluate_plans"))
    write_parquet(layout.plans, plans_table(found, data.batch))
    for name, rows in (result_tables(found) | {"payload_sensitivity": payloads}).items():
        write_csv(layout.tables_dir / f"{name}.csv", rows)
    claims += plan_claims(found, data.batch, settings.krc_slowest_percent / 100.0)
    write_claims(layout.tables_dir / "claims.csv", claims if params.robot.is_reference else [])
    write_document(layout.metrics_dir / "plans.json", metrics(found))


if __name__ == "__main__":
    run(evaluate_plans, load_params)
