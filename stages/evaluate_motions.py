"""Regimes (a), new motions of a known robot, and (b), a payload never trained on."""

from __future__ import annotations

from concurrent.futures import Executor

from reproduction.layout import Layout
from reproduction.parts import Parts
from reproduction.study.config import StudyParams, load_study_params
from reproduction.study.regime_tables import RegimeTables
from reproduction.study.regimes import same_robot, unseen_payload
from reproduction.tables import table_of_rows, write_csv, write_parquet
from stages.cli import run, say


def compute(
    params: StudyParams, layout: Layout, executor: Executor | None = None
) -> tuple[Parts, RegimeTables, RegimeTables]:
    """Parts of the stage, computed by an executor or by processes here, and the tables of both regimes."""
    progress = say("evaluate_motions")
    parts = Parts.of_stage("evaluate_motions", layout, params.model_dump(mode="json"), executor=executor)
    return parts, same_robot(params, progress, parts), unseen_payload(params, progress, parts)


def evaluate_motions(params: StudyParams, layout: Layout) -> None:
    """Write errors, gaps, wins and coverage of both regimes, and the ablations."""
    parts, known, unseen = compute(params, layout)
    for table in ("errors", "gaps", "coverage"):
        write_csv(layout.study_tables_dir / f"motions_{table}.csv", getattr(known, table) + getattr(unseen, table))
    write_csv(layout.study_tables_dir / "ablations.csv", known.ablations)
    together = [row for row in known.wins if row["payload_kg"] == "all"]
    write_csv(layout.study_tables_dir / "motions_wins.csv", together)
    write_parquet(
        layout.study_data_dir / "motions_plans.parquet", table_of_rows(known.plans + unseen.plans, ["payload_kg"])
    )
    parts.forget()


if __name__ == "__main__":
    run(evaluate_motions, load_study_params, "studies/params.yaml")
