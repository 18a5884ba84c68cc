"""What the predictor was meant to reach beside what it reached, from the tables of the regimes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stages._study import StudyLayout, run, write_parquet

if TYPE_CHECKING:
    from reproduction.study.config import StudyParams

NAME = "judge_targets"


def judge_targets(params: StudyParams, layout: StudyLayout) -> None:
    """Write one row per target: value, limit, held or not."""
    from reproduction.study.targets import target_rows
    from reproduction.tables import read_csv, write_csv

    names = ("motions_errors", "motions_gaps", "robots_errors", "robots_gaps")
    rows = target_rows(*(read_csv(layout.tables_dir / f"{name}.csv") for name in names))
    write_csv(layout.tables_dir / "targets.csv", rows)
    write_parquet(layout.data_dir / "targets.parquet", rows)
    held = sum(row["held"] == "true" for row in rows)
    print(f"{NAME}: {held} of {len(rows)} targets held", flush=True)


if __name__ == "__main__":
    run(NAME, judge_targets)
