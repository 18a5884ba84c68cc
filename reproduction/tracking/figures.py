"""Figures 5.1-5.4 for one model, as its record shows them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from robojoule.profile.parameters import TARGETS
from robojoule.profile.sampled import SampledProfile, sampled_profile


class _Profiles:
    """Simulated profiles of single motions, as the figures ask for them."""

    def __init__(self, runs: pa.Table) -> None:
        self._runs = {
            name: runs[name].to_numpy() for name in ("motion_id", "duration_s", "energy_j", "speed_limit_percent")
        }

    def profile(self, motion_id: int) -> SampledProfile:
        """Distinct runs of a motion."""
        runs = self._runs
        rows = runs["motion_id"] == motion_id
        return sampled_profile(
            runs["duration_s"][rows], runs["energy_j"][rows], runs["speed_limit_percent"][rows] / 100
        )


def figures(runs: Path, model: str, predictions: pa.Table, features: pa.Table) -> list[tuple[str, Any]]:
    """Figures of a model's predictions for the test trees, with their names.

    Args:
        runs: data/runs.parquet.
        model: Name of the model.
        predictions: Predictions of held-out motions by all models.
        features: Features of all motions.
    """
    from reproduction.methods.three_segment_profile import ThreeSegmentShape
    from reproduction.report.predictor_figures import overlapping_profiles, predicted_against_simulated
    from robojoule.plots.style import Style

    joined = predictions.join(features.select(["motion_id", "duration_fastest_s", "duration_slowest_s"]), "motion_id")
    joined = joined.sort_by("motion_id")
    rows = {name: np.asarray(joined[name].to_pylist()) for name in joined.column_names}
    chosen = (rows["model"] == model) & (rows["split"] == "test")
    rows = {name: values[chosen] for name, values in rows.items()}
    style = Style()
    drawn = []
    with style.applied():
        for number, target in enumerate(TARGETS, start=1):
            drawn.append((f"figure_5_{number}", predicted_against_simulated(rows, target, style).figure))
        moving = rows["duration_slowest_s"] > rows["duration_fastest_s"]
        rows = {name: values[moving] for name, values in rows.items()}
        error = np.abs(rows["energy_saving_j"] - rows["energy_saving_j_measured"])
        best_first = np.argsort(error / (rows["energy_saving_j_measured"] + 1), kind="stable")
        rows = {name: values[best_first] for name, values in rows.items()}
        profiles = _Profiles(pq.read_table(runs))
        drawn.append(("figure_5_4", overlapping_profiles(rows, profiles, style, ThreeSegmentShape()).figure))
    return drawn
