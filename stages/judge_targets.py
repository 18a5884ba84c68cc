"""What the predictor was meant to reach beside what it reached, from the tables of the regimes."""

from __future__ import annotations

from reproduction.layout import Layout
from reproduction.study.config import StudyParams, load_study_params
from reproduction.study.targets import target_rows
from reproduction.tables import read_csv, table_of_rows, write_csv, write_parquet
from stages.cli import run, say


def judge_targets(params: StudyParams, layout: Layout) -> None:
    """Write one row per target: value, limit, held or not."""
    names = ("motions_errors", "motions_gaps", "robots_errors", "robots_gaps")
    rows = target_rows(*(read_csv(layout.study_tables_dir / f"{name}.csv") for name in names))
    write_csv(layout.study_tables_dir / "targets.csv", rows)
    write_parquet(layout.study_data_dir / "targets.parquet", table_of_rows(rows))
    held = sum(row["held"] == "true" for row in rows)
    say("judge_targets")(f"{held} of {len(rows)} targets held")


if __name__ == "__main__":
    run(judge_targets, load_study_params, "studies/params.yaml")
