"""Nested cross-validation by tree: three-number models, nominal physics, the physics-informed predictor.

Outer folds hold whole trees out and judge predictions on noise-free labels; inner folds, inside the training trees,
choose hyperparameters (for the physics-informed model: whether a residual is learned, and its penalty).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reproduction.parts import HERE, Parts
from reproduction.profile_predictor.fit import fit_profile_predictor
from reproduction.study.cases import PlantBatch, speed_limits
from reproduction.study.config import StudyParams
from reproduction.study.plant import draw_plant
from reproduction.study.regimes import Case, robot_with_payload, streams
from reproduction.study.summary import parameter_rows
from reproduction.study.three_numbers import MODELS, fit_model, motion_features
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.calibration.run_model import ObservedRuns
from robojoule.motion.simulation import MotionRuns
from robojoule.profile.parameters import profile_parameters

PHYSICS = ("nominal_physics", "physics_informed", "robojoule_predicted", "oracle")


@dataclass
class Comparison:
    """Result of the cross-validation.

    Attributes:
        rows: Errors: one row per model and target.
        fold_rows: The same in each outer fold: one row per fold, model and target.
        predictions: One row per motion and model.
        chosen: Hyperparameters that each outer fold chose, by model.
        metrics: What else is told of a model, by model.
    """

    rows: list[Row] = field(default_factory=list)
    fold_rows: list[Row] = field(default_factory=list)
    predictions: list[Row] = field(default_factory=list)
    chosen: dict[str, list[dict[str, object]]] = field(default_factory=dict)
    metrics: dict[str, dict[str, float]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Motions:
    """Motions of all folds.

    Attributes:
        batch: Their trees on the plant.
        observed: Noisy runs.
        fold: Outer fold that holds each motion out, shape (M,).
        features: What models of three numbers read, shape (M, k).
        noisy: The three numbers of noisy runs, shape (M, 3).
        runs: Noise-free runs at the observed speed limits.
    """

    batch: PlantBatch
    observed: ObservedRuns
    fold: NDArray[np.intp]
    features: Array
    noisy: Array
    runs: MotionRuns


@dataclass(frozen=True, eq=False)
class Fold:
    """What an outer fold gave.

    Attributes:
        values: The three numbers that each model predicts for the motions held out, shape (m, 3).
        chosen: Hyperparameters by model.
        inside: Whether intervals of `robojoule_predicted` hold the truth, for the moving ones of them, shape (m', S).
        gain: What its residual gained.
    """

    values: dict[str, Array]
    chosen: dict[str, dict[str, object]]
    inside: NDArray[np.bool_]
    gain: float


def compare_models(params: StudyParams, progress: Callable[[str], None], parts: Parts = HERE) -> Comparison:
    """Cross-validate every model on the same trees and noise."""
    settings, limits = params.compare_predictors, speed_limits(params.motions)
    motions = drawn_motions(params)
    batch, runs = motions.batch, motions.runs
    truth = profile_parameters(runs.duration_s, runs.energy_j)
    folds = parts.map(
        compare_fold,
        [(params, motions, held) for held in range(settings.outer_folds)],
        lambda held, _: progress(f"outer fold {held + 1} of {settings.outer_folds}"),
    )
    found: dict[str, Array] = {name: np.full_like(truth, np.nan) for name in (*MODELS, *PHYSICS)}
    for held, fold in enumerate(folds):
        for name, values in fold.values.items():
            found[name][motions.fold == held] = values
    found["nominal_physics"] = profile_parameters(runs.duration_s, batch.nominal_paths.simulate(limits).energy_j)
    found["oracle"] = profile_parameters(runs.duration_s, batch.oracle_paths.simulate(limits).energy_j)
    result = Comparison(chosen={name: [fold.chosen[name] for fold in folds] for name in MODELS})
    for name, values in found.items():
        result.rows.extend(parameter_rows(values, truth, {"model": name}))
        for held in range(settings.outer_folds):
            test = motions.fold == held
            result.fold_rows.extend(parameter_rows(values[test], truth[test], {"fold": held + 1, "model": name}))
        result.predictions.extend(
            {"model": name, "motion": motion, "tree": int(batch.tree_of_motion[motion])}
            | {f"energy_saving_j{end}": row[0] for end, row in both}
            | {f"optimal_duration_s{end}": row[1] for end, row in both}
            | {f"energy_penalty_j{end}": row[2] for end, row in both}
            for motion in range(len(truth))
            for both in [(("", values[motion].tolist()), ("_simulated", truth[motion].tolist()))]
        )
    result.metrics["robojoule_predicted"] = {
        "coverage_percent": round(100.0 * float(np.concatenate([fold.inside for fold in folds]).mean()), 2),
        "residual_gain_mean": round(float(np.mean([fold.gain for fold in folds])), 4),
    }
    return result


def drawn_motions(params: StudyParams) -> Motions:
    """Trees of the comparison, what is known of their motions, and the folds."""
    settings, motions = params.compare_predictors, params.motions
    robot = robot_with_payload(settings.robot, settings.payload_kg, motions)
    plant = draw_plant(robot, streams(motions.seed)["plant"], params.plant)
    case = Case(robot, plant, motions, streams(motions.seed, 5))
    batch = case.batch("training", settings.trees)
    observed = case.observed(batch)
    runs = batch.paths.simulate(speed_limits(motions))
    order = np.random.default_rng(case.seeds["choice"]).permutation(settings.trees)
    fold_of_tree = np.empty(settings.trees, dtype=np.intp)
    fold_of_tree[order] = np.arange(settings.trees) % settings.outer_folds
    features = motion_features(batch.nominal_paths, batch.slowest_speed_limit)
    noisy = profile_parameters(runs.duration_s, observed.energy_j)
    return Motions(batch, observed, fold_of_tree[batch.tree_of_motion], features, noisy, runs)


def compare_fold(params: StudyParams, motions: Motions, held: int) -> Fold:
    """Train every model on all folds but one, and predict that one."""
    settings, batch, runs = params.compare_predictors, motions.batch, motions.runs
    training, test = motions.fold != held, motions.fold == held
    values: dict[str, Array] = {}
    chosen = {}
    for name in MODELS:
        model = fit_model(
            name,
            motions.features[training],
            motions.noisy[training],
            batch.tree_of_motion[training],
            inner_folds=settings.inner_folds,
            seed=held,
            shallow_samples=settings.shallow_samples,
        )
        values[name] = model.predict(motions.features[test])
        chosen[name] = model.chosen
    used = motions.observed.only(training).thinned(params.motions.runs_per_motion)
    for name in ("physics_informed", "robojoule_predicted"):
        predictor = fit_profile_predictor(batch.robot, [used], residual=name != "physics_informed")
        predicted = predictor.predict(batch.nominal_paths, speed_limits(params.motions))
        values[name] = profile_parameters(runs.duration_s[test], predicted.energy_j[test])
    inside = (runs.energy_j >= predicted.lower_j) & (runs.energy_j <= predicted.upper_j)
    return Fold(values, chosen, inside[test & batch.paths.moving], predictor.residual.gain)
