"""Simulate every motion of every tree at every speed limit: motions, runs, path torques and time series."""

from __future__ import annotations

from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.motions.energy_model import energy_model_metrics
from reproduction.motions.simulate import forget, planned_shards, read_motions, simulate_shards
from reproduction.reference_robot.check import FIGURE_COLUMNS, energy_model_rows
from reproduction.tables import write_csv, write_parquet
from robojoule.documents import write_document
from stages.cli import run, say


def simulate_motions(params: Params, layout: Layout) -> None:
    """Simulate all motions of `data/trees.parquet`, in shards on all processors."""
    robot = params.robot.robot()
    motions = read_motions(layout.trees, robot.joint_count)
    shards = planned_shards(params.robot, params.simulate_motions, motions, layout.scratch_dir / "simulate_motions")
    found = simulate_shards(shards, layout.samples_dir, say("simulate_motions"))
    write_parquet(layout.motions, found.motions)
    write_parquet(layout.runs, found.runs)
    write_parquet(layout.paths, found.paths)
    metrics = energy_model_metrics(robot, found.motions, found.runs)
    write_document(layout.metrics_dir / "energy_model.json", metrics)
    judged = energy_model_rows(metrics) if params.robot.is_reference else []
    write_csv(layout.tables_dir / "energy_model.csv", judged, FIGURE_COLUMNS)
    forget(shards)


if __name__ == "__main__":
    run(simulate_motions, load_params)
