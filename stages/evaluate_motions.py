"""Regimes (a), new motions of a known robot, and (b), a payload never trained on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stages._study import StudyLayout, run, say, write_parquet

if TYPE_CHECKING:
    from reproduction.study.config import StudyParams

NAME = "evaluate_motions"


def evaluate_motions(params: StudyParams, layout: StudyLayout) -> None:
    """Write errors, gaps, wins and coverage of both regimes, and the ablations."""
    from reproduction.study.regimes import same_robot, unseen_payload
    from reproduction.tables import write_csv

    known, unseen = same_robot(params, say(NAME)), unseen_payload(params, say(NAME))
    for table in ("errors", "gaps", "coverage"):
        write_csv(layout.tables_dir / f"motions_{table}.csv", getattr(known, table) + getattr(unseen, table))
    write_csv(layout.tables_dir / "ablations.csv", known.ablations)
    together = [row for row in known.wins if row["payload_kg"] == "all"]
    write_csv(layout.tables_dir / "motions_wins.csv", together)
    write_parquet(layout.data_dir / "motions_plans.parquet", known.plans + unseen.plans)


if __name__ == "__main__":
    run(NAME, evaluate_motions)
