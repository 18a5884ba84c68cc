"""Regime (c): leave one robot of the catalog out, then measure a few of its motions."""

from __future__ import annotations

from concurrent.futures import Executor

from reproduction.layout import Layout
from reproduction.parts import Parts
from reproduction.study.config import StudyParams, load_study_params
from reproduction.study.regime_tables import RegimeTables
from reproduction.study.regimes import unseen_robot
from reproduction.study.summary import median_rows
from reproduction.tables import table_of_rows, write_csv, write_parquet
from stages.cli import run, say


def compute(params: StudyParams, layout: Layout, executor: Executor | None = None) -> tuple[Parts, RegimeTables]:
    """Parts of the stage, computed by an executor or by processes here, and the tables of the regime."""
    parts = Parts.of_stage("evaluate_robots", layout, params.model_dump(mode="json"), executor=executor)
    return parts, unseen_robot(params, say("evaluate_robots"), parts)


def evaluate_robots(params: StudyParams, layout: Layout) -> None:
    """Write errors, gaps, wins and coverage of the regime."""
    parts, found = compute(params, layout)
    write_csv(layout.study_tables_dir / "robots_errors.csv", median_rows(found.errors))
    together = [row for row in found.gaps if row["robot"] == "all"]
    write_csv(layout.study_tables_dir / "robots_gaps.csv", together)
    write_csv(layout.study_tables_dir / "robots_wins.csv", found.wins)
    write_csv(layout.study_tables_dir / "robots_coverage.csv", found.coverage)
    write_parquet(layout.study_data_dir / "robots_errors.parquet", table_of_rows(found.errors, ["payload_kg"]))
    write_parquet(layout.study_data_dir / "robots_plans.parquet", table_of_rows(found.plans, ["payload_kg"]))
    parts.forget()


if __name__ == "__main__":
    run(evaluate_robots, load_study_params, "studies/params.yaml")
