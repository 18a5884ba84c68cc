"""Plans of whole cells: what speeds, brakes and all power modes save."""

from __future__ import annotations

from concurrent.futures import Executor

from reproduction.cells.study import cell_rows
from reproduction.layout import Layout
from reproduction.parts import Parts
from reproduction.study.config import StudyParams, load_study_params
from reproduction.tables import Row, table_of_rows, write_csv, write_parquet
from stages.cli import run, say


def compute(params: StudyParams, layout: Layout, executor: Executor | None = None) -> tuple[Parts, list[Row]]:
    """Parts of the stage, computed by an executor or by processes here, and the figures of every plan."""
    parts = Parts.of_stage("plan_cells", layout, params.model_dump(mode="json"), executor=executor)
    return parts, cell_rows(params.plan_cells, say("plan_cells"), parts)


def plan_cells(params: StudyParams, layout: Layout) -> None:
    """Write the figures of every plan."""
    parts, rows = compute(params, layout)
    write_csv(layout.study_tables_dir / "cells.csv", rows)
    write_parquet(layout.study_data_dir / "cells.parquet", table_of_rows(rows))
    parts.forget()


if __name__ == "__main__":
    run(plan_cells, load_study_params, "studies/params.yaml")
