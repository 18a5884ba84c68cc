"""Nested cross-validation by tree: three-number models, nominal physics, the physics-informed predictor.

Outer folds hold whole trees out and judge predictions on noise-free labels; inner folds, inside the training trees,
choose hyperparameters (for the physics-informed model: whether a residual is learned, and its penalty).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reproduction.profile_predictor.fit import fit_profile_predictor
from reproduction.study.cases import PlantBatch
from reproduction.study.config import StudyParams
from reproduction.study.plant import draw_plant
from reproduction.study.regimes import Case, robot_with_payload, speed_limits, streams
from reproduction.study.summary import parameter_rows
from reproduction.study.three_numbers import MODELS, fit_model, motion_features
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.calibration.run_model import ObservedRuns
from robojoule.profile.parameters import profile_parameters

PHYSICS = ("nominal_physics", "physics_informed", "robojoule_predicted", "oracle")


@dataclass
class Comparison:
    """Result of the cross-validation.

    Attributes:
        rows: Errors: one row per model and target.
        predictions: One row per motion and model.
        chosen: Hyperparameters that each outer fold chose, by model.
        metrics: What else is told of a model, by model.
    """

    rows: list[Row] = field(default_factory=list)
    predictions: list[Row] = field(default_factory=list)
    chosen: dict[str, list[dict[str, object]]] = field(default_factory=dict)
    metrics: dict[str, dict[str, float]] = field(default_factory=dict)


def compare_models(params: StudyParams, progress: Callable[[str], None]) -> Comparison:
    """Cross-validate every model on the same trees and noise."""
    settings, motions = params.compare_predictors, params.motions
    limits = speed_limits(motions)
    robot = robot_with_payload(settings.robot, settings.payload_kg, motions)
    plant = draw_plant(robot, streams(motions.seed)["plant"], params.plant)
    case = Case(robot, plant, motions, streams(motions.seed, 5))
    batch = case.batch("training", settings.trees)
    observed = case.observed(batch)
    runs = batch.paths.simulate(limits)
    truth = profile_parameters(runs.duration_s, runs.energy_j)
    order = np.random.default_rng(case.seeds["choice"]).permutation(settings.trees)
    fold_of_tree = np.empty(settings.trees, dtype=np.intp)
    fold_of_tree[order] = np.arange(settings.trees) % settings.outer_folds
    fold = fold_of_tree[batch.tree_of_motion]
    found: dict[str, Array] = {name: np.full_like(truth, np.nan) for name in (*MODELS, *PHYSICS)}
    result = Comparison(chosen={name: [] for name in MODELS})
    features = motion_features(batch.nominal_paths, batch.slowest_speed_limit)
    noisy = profile_parameters(runs.duration_s, observed.energy_j)
    inside: list[NDArray[np.bool_]] = []
    gains: list[float] = []
    for held in range(settings.outer_folds):
        training, test = fold != held, fold == held
        for name in MODELS:
            model = fit_model(
                name,
                features[training],
                noisy[training],
                batch.tree_of_motion[training],
                inner_folds=settings.inner_folds,
                seed=held,
                shallow_samples=settings.shallow_samples,
            )
            found[name][test] = model.predict(features[test])
            result.chosen[name].append(model.chosen)
        used = observed.only(training).thinned(motions.runs_per_motion)
        for name in ("physics_informed", "robojoule_predicted"):
            energy, hits, gain = _physics(batch, used, limits, runs.energy_j, residual=name != "physics_informed")
            found[name][test] = profile_parameters(runs.duration_s[test], energy[test])
            if name == "robojoule_predicted":
                inside.append(hits[test & batch.paths.moving])
                gains.append(gain)
        progress(f"outer fold {held + 1} of {settings.outer_folds}")
    found["nominal_physics"] = profile_parameters(runs.duration_s, batch.nominal_paths.simulate(limits).energy_j)
    found["oracle"] = profile_parameters(runs.duration_s, batch.oracle_paths.simulate(limits).energy_j)
    for name, values in found.items():
        result.rows.extend(parameter_rows(values, truth, {"model": name}))
        result.predictions.extend(
            {"model": name, "motion": motion, "tree": int(batch.tree_of_motion[motion])}
            | {f"energy_saving_j{end}": row[0] for end, row in both}
            | {f"optimal_duration_s{end}": row[1] for end, row in both}
            | {f"energy_penalty_j{end}": row[2] for end, row in both}
            for motion in range(len(truth))
            for both in [(("", values[motion].tolist()), ("_simulated", truth[motion].tolist()))]
        )
    result.metrics["robojoule_predicted"] = {
        "coverage_percent": round(100.0 * float(np.concatenate(inside).mean()), 2),
        "residual_gain_mean": round(float(np.mean(gains)), 4),
    }
    return result


def _physics(
    batch: PlantBatch, used: ObservedRuns, limits: Array, truth_j: Array, *, residual: bool
) -> tuple[Array, NDArray[np.bool_], float]:
    """Predicted energies (M, S), whether intervals hold the truth (M, S), and what the residual gained."""
    predictor = fit_profile_predictor(batch.robot, [used], residual=residual)
    predicted = predictor.predict(batch.nominal_paths, limits)
    inside = (truth_j >= predicted.lower_j) & (truth_j <= predicted.upper_j)
    return predicted.energy_j, inside, predictor.residual.gain
