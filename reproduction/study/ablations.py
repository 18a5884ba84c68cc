"""What each step brings: representation, idle power and predictor exchanged one at a time, all else at its best.

representation   of the true profile, with true idle power by configuration
idle_power       with the true profile in as many pieces as it takes
predictor        of profile and idle power; mean and random forest predict the thesis's three numbers
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reproduction.experiment.gaps import PlanEnergies, gap_rows
from reproduction.methods.method import Method, Variant
from reproduction.methods.on_source import OnSource
from reproduction.study.cases import PlantBatch
from reproduction.study.methods import hull_profiles, three_segment_method
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.profile.parameters import profile_parameters

# Part -> case -> method whose plans it takes; methods of the main comparison, and those of `ablation_methods`.
ABLATIONS = {
    "representation": {"five_runs": "krc_polynomial_6", "three_segments": "three_segments", "dense": "dense"},
    "idle_power": {"constant": "constant_idle", "slope": "slope_idle", "configuration": "dense"},
    "predictor": {
        "mean": "mean",
        "random_forest": "predicted_three_segment",
        "nominal_physics": "nominal_physics",
        "robojoule_predicted": "robojoule_predicted",
    },
}
METHODS = ("three_segments", "dense", "constant_idle", "slope_idle", "mean")


def ablation_methods(batch: PlantBatch, training_mean: Array, speed_limits: int) -> dict[str, Method]:
    """The methods that only ablations need, by name.

    Args:
        batch: Trees on their plant.
        training_mean: Mean saving [J], optimal duration [s] and penalty [J] of training motions, shape (3,).
        speed_limits: Speed limits at which true profiles are known.
    """
    limits = batch.speed_limits(speed_limits)
    runs = batch.paths.simulate(limits)
    true = three_segment_method(profile_parameters(runs.duration_s, runs.energy_j)).costs(batch)
    three_segments = [cost for of_tree in true for cost in of_tree]
    slopes = np.array([cost.idle_prior_w for cost in three_segments])
    dense = hull_profiles(batch.paths, limits)
    home = np.concatenate([np.full(rows.stop - rows.start, batch.idle_prior_w[rows.start]) for rows in batch.rows])
    sources = {
        "three_segments": replace(dense, profiles=[cost.profile for cost in three_segments]),
        "dense": dense,
        "constant_idle": replace(dense, idle_start_w=home, idle_end_w=home),
        "slope_idle": replace(dense, idle_start_w=slopes, idle_end_w=slopes),
    }
    mean = three_segment_method(np.broadcast_to(training_mean, (len(batch.d_min_s), 3)))
    return {name: OnSource(Variant(name), source) for name, source in sources.items()} | {"mean": mean}


def ablation_rows(plans: PlanEnergies) -> list[Row]:
    """Gaps of every case: one row per part, case and cycle time."""
    rows = gap_rows(plans, {})
    return [
        {"part": part, "case": case} | {name: value for name, value in row.items() if name != "method"}
        for part, cases in ABLATIONS.items()
        for case, method in cases.items()
        for row in rows
        if row["method"] == method
    ]


def main_methods(plans: PlanEnergies) -> PlanEnergies:
    """Plans without those that only ablations need."""
    kept = {method: energies for method, energies in plans.energy_j.items() if method not in METHODS}
    return PlanEnergies(plans.cycle_times_percent, kept)
