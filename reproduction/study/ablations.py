"""What each step brings: representation, idle power and predictor exchanged one at a time, all else at its best.

representation   of the true profile, with true idle power by configuration
idle_power       with the true profile in as many pieces as it takes
predictor        of profile and idle power; mean and random forest predict the thesis's three numbers
"""

from __future__ import annotations

import numpy as np

from reproduction.experiment.gaps import PlanEnergies, gap_rows
from reproduction.study.cases import PlantBatch
from reproduction.study.plans import Costs, path_costs, three_segment_method
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.planning.costs import VertexCosts
from robojoule.profile.parameters import profile_parameters

# Part -> case -> method whose plans it takes; methods of the main comparison, and those of `ablation_costs`.
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


def ablation_costs(batch: PlantBatch, training_mean: Array, speed_limits: int) -> dict[str, Costs]:
    """Costs of `METHODS`.

    Args:
        batch: Trees on their plant.
        training_mean: Mean saving [J], optimal duration [s] and penalty [J] of training motions, shape (3,).
        speed_limits: Speed limits at which true profiles are known.
    """
    limits = batch.speed_limits(speed_limits)
    runs = batch.paths.simulate(limits)
    true = three_segment_method(batch, profile_parameters(runs.duration_s, runs.energy_j))
    dense = path_costs(batch, batch.paths, limits)
    home = [float(batch.idle_prior_w[rows.start]) for rows in batch.rows]
    return {
        "three_segments": _joined(true, dense),
        "dense": dense,
        "constant_idle": [
            [VertexCosts(cost.profile, power, power) for cost in of_tree]
            for of_tree, power in zip(dense, home, strict=True)
        ],
        "slope_idle": _joined(dense, true),
        "mean": three_segment_method(batch, np.broadcast_to(training_mean, (len(batch.d_min_s), 3))),
    }


def _joined(profiles: Costs, idle: Costs) -> Costs:
    """Profiles of one with the idle power of the other."""
    return [
        [
            VertexCosts(profile.profile, power.idle_prior_w, power.idle_post_w)
            for profile, power in zip(*pair, strict=True)
        ]
        for pair in zip(profiles, idle, strict=True)
    ]


def ablation_rows(plans: PlanEnergies) -> list[Row]:
    """Gaps of every case: one row a part, case and relaxation."""
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
    return PlanEnergies(plans.relaxations_percent, kept)
