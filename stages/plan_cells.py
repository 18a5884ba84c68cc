"""Plans of whole cells: what speeds, brakes and all power modes save."""

from __future__ import annotations

from reproduction.cells.study import cell_rows
from reproduction.layout import Layout
from reproduction.study.config import StudyParams, load_study_params
from reproduction.tables import table_of_rows, write_csv, write_parquet
from stages.cli import run, say


def plan_cells(params: StudyParams, layout: Layout) -> None:
    """Write the figures of every plan."""
    rows = cell_rows(params.plan_cells, say("plan_cells"))
    write_csv(layout.study_tables_dir / "cells.csv", rows)
    write_parquet(layout.study_data_dir / "cells.parquet", table_of_rows(rows))


if __name__ == "__main__":
    run(plan_cells, load_study_params, "studies/params.yaml")
