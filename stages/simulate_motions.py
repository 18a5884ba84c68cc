"""Simulate every motion of every tree at every speed limit: motions, runs, path torques and time series."""

from __future__ import annotations

from concurrent.futures import Executor

from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.motions.energy_model import energy_model_metrics
from reproduction.motions.simulate import Shard, forget, gathered, make_shards, planned_shards, read_motions
from reproduction.reference_robot.check import FIGURE_COLUMNS, energy_model_rows
from reproduction.tables import write_csv, write_parquet
from robojoule.documents import write_document
from stages.cli import run, say


def compute(params: Params, layout: Layout, executor: Executor | None = None) -> list[Shard]:
    """All shards; those that are missing are simulated by an executor, or on all processors here."""
    motions = read_motions(layout.trees, params.robot.robot().joint_count)
    shards = planned_shards(params.robot, params.simulate_motions, motions, layout.scratch_dir / "simulate_motions")
    make_shards(shards, say("simulate_motions"), executor)
    return shards


def simulate_motions(params: Params, layout: Layout) -> None:
    """Simulate all motions of `data/trees.parquet`, in shards on all processors."""
    shards = compute(params, layout)
    found, robot = gathered(shards, layout.samples_dir), params.robot.robot()
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
