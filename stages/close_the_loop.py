"""Plans on controllers that nobody has described: trials on hidden machines."""

from __future__ import annotations

from concurrent.futures import Executor

from reproduction.closed_loop.study import closed_loop_cases
from reproduction.closed_loop.summary import machine_rows, target_rows
from reproduction.layout import Layout
from reproduction.parts import Parts
from reproduction.study.config import StudyParams, load_study_params
from reproduction.tables import Row, table_of_rows, write_csv, write_parquet
from stages.cli import run, say


def compute(params: StudyParams, layout: Layout, executor: Executor | None = None) -> tuple[Parts, list[Row]]:
    """Parts of the stage, computed by an executor or by processes here, and every plan."""
    parts = Parts.of_stage("close_the_loop", layout, params.model_dump(mode="json"), executor=executor)
    return parts, closed_loop_cases(params.close_the_loop, params.motions, say("close_the_loop"), parts)


def close_the_loop(params: StudyParams, layout: Layout) -> None:
    """Write every plan, the figures of each machine, and the targets."""
    parts, cases = compute(params, layout)
    targets = target_rows(cases)
    write_csv(layout.study_tables_dir / "closed_loop.csv", machine_rows(cases))
    write_csv(layout.study_tables_dir / "closed_loop_targets.csv", targets)
    write_parquet(layout.study_data_dir / "closed_loop.parquet", table_of_rows(cases))
    held = sum(row["held"] == "true" for row in targets)
    parts.forget()
    say("close_the_loop")(f"{held} of {len(targets)} targets held")


if __name__ == "__main__":
    run(close_the_loop, load_study_params, "studies/params.yaml")
