"""Regime (c): leave one robot of the catalog out, then measure a few of its motions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stages._study import StudyLayout, run, say, write_parquet

if TYPE_CHECKING:
    from reproduction.study.config import StudyParams

NAME = "evaluate_robots"


def evaluate_robots(params: StudyParams, layout: StudyLayout) -> None:
    """Write errors, gaps, wins and coverage of the regime."""
    from reproduction.study.regimes import unseen_robot
    from reproduction.study.summary import median_rows
    from reproduction.tables import write_csv

    found = unseen_robot(params, say(NAME))
    write_csv(layout.tables_dir / "robots_errors.csv", median_rows(found.errors))
    together = [row for row in found.gaps if row["robot"] == "all"]
    write_csv(layout.tables_dir / "robots_gaps.csv", together)
    write_csv(layout.tables_dir / "robots_wins.csv", found.wins)
    write_csv(layout.tables_dir / "robots_coverage.csv", found.coverage)
    write_parquet(layout.data_dir / "robots_errors.parquet", found.errors)
    write_parquet(layout.data_dir / "robots_plans.parquet", found.plans)


if __name__ == "__main__":
    run(NAME, evaluate_robots)
