"""What the predictor was meant to reach beside what it reached, from the tables of the regimes."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

from stages._study import StudyLayout, run, write_parquet, write_table

if TYPE_CHECKING:
    from reproduction.study.config import StudyParams

NAME = "judge_bars"


def judge_bars(params: StudyParams, layout: StudyLayout) -> None:
    """Write one row a bar: value, limit, held or not."""
    from reproduction.study.targets import bar_rows

    names = ("motions_errors", "motions_gaps", "robots_errors", "robots_gaps")
    rows = bar_rows(*(_read(layout.tables_dir / f"{name}.csv") for name in names))
    write_table(layout.tables_dir / "bars.csv", rows)
    write_parquet(layout.data_dir / "bars.parquet", rows)
    held = sum(row["held"] == "yes" for row in rows)
    print(f"{NAME}: {held} of {len(rows)} bars held", flush=True)


def _read(path: Path) -> list[dict[str, object]]:
    with path.open(newline="", encoding="utf-8") as file:
        return [dict(row) for row in csv.DictReader(file)]


if __name__ == "__main__":
    run(NAME, judge_bars)
