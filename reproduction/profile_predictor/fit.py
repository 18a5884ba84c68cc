"""Fit a profile predictor to simulated runs of many trees: calibrated physics, a residual, intervals that hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from reproduction.profile_predictor.residual_fit import fit_residual
from robojoule.arrays import Array, Index
from robojoule.calibration.parameters import ParameterVector, Prior
from robojoule.calibration.run_fit import Calibration, calibrate
from robojoule.calibration.run_model import ObservedRuns, body_directions, evaluate_runs, run_parameters
from robojoule.motion.path_integrals import PathIntegrals
from robojoule.profile.predicted import ProfilePredictor, calibrated_predictor
from robojoule.profile.residual import Residual, residual_features
from robojoule.robots.robot import Robot

COVERAGE = 0.9
_FEWEST_HELD_OUT = 5
_HELD_OUT_EVERY = 5  # of the trees every fifth calibrates the intervals


def fit_profile_predictor(
    robot: Robot, runs: Sequence[ObservedRuns], prior: Prior | None = None, *, residual: bool = True
) -> ProfilePredictor:
    """Fit a predictor to runs.

    With enough trees, every fifth one is kept from the fit and calibrates the intervals (split conformal prediction);
    with few, all are used and intervals are those of the posterior. One thread: sums of the small matrix products must
    not depend on the number of threads.

    Args:
        robot: Nominal entry with any payload.
        runs: Simulated runs, one set for each payload; none: the prior itself.
        prior: Belief before the runs; that of the entry if not given.
        residual: Whether a correction may be learned.
    """
    if not runs:
        return calibrated_predictor(robot, prior=prior)
    with threadpool_limits(1):
        directions = body_directions(robot)
        vector = run_parameters(robot.drives, directions)
        known = [part.distinct() for part in runs]
        integrals = [part.integrals(directions) for part in known]
        trees = np.unique(np.concatenate([part.tree for part in known]))
        held = trees[_HELD_OUT_EVERY - 1 :: _HELD_OUT_EVERY]
        if len(held) < _FEWEST_HELD_OUT:
            held = held[:0]
        fitted = [part.only(~np.isin(part.tree, held)) for part in known]
        calibration = calibrate(vector, fitted, integrals, prior)
        count = sum(int(np.isfinite(part.energy_j).sum()) for part in known)
        note = (
            f"trained on {count} simulated runs of {len(trees)} operation trees of {robot.name}: "
            "a machine may be further from its entry than the interval is wide"
        )
        predictor = ProfilePredictor.of(robot, directions, calibration, note)
        if residual:
            predictor = replace(predictor, residual=_learned_residual(vector, fitted, integrals, calibration))
        if len(held):
            predictor = replace(predictor, interval=_conformal(predictor, vector, known, integrals, held))
        return predictor


def _learned_residual(
    vector: ParameterVector, runs: Sequence[ObservedRuns], integrals: Sequence[PathIntegrals], calibration: Calibration
) -> Residual:
    features, relative, trees = [], [], []
    for part, path in zip(runs, integrals, strict=True):
        viscosity = np.exp([calibration.states.get(int(tree), 0.0) for tree in part.tree])
        found = evaluate_runs(vector, path, calibration.x, viscosity)
        used = np.isfinite(part.energy_j) & path.moving[:, None]
        features.append(residual_features(vector, path, found)[used])
        relative.append(part.energy_j[used] / found.energy_j[used] - 1.0)
        trees.append(np.broadcast_to(part.tree[:, None], used.shape)[used])
    return fit_residual(np.concatenate(features), np.concatenate(relative), np.concatenate(trees))


def _conformal(
    predictor: ProfilePredictor,
    vector: ParameterVector,
    runs: Sequence[ObservedRuns],
    integrals: Sequence[PathIntegrals],
    held: Index,
) -> float:
    """Deviations that hold `COVERAGE` of the held-out energies, noise added to what the predictor expects."""
    scores: list[Array] = []
    for part, path in zip(runs, integrals, strict=True):
        used = np.isfinite(part.energy_j) & path.moving[:, None] & np.isin(part.tree, held)[:, None]
        _, energy, jacobian = predictor.corrected(vector, path, predictor.calibration.x)
        deviation = predictor.deviation_j(vector, jacobian)
        expected = np.sqrt(deviation**2 + (predictor.calibration.noise * energy) ** 2)
        scores.append((np.abs(part.energy_j - energy)[used]) / expected[used])
    score = np.sort(np.concatenate(scores))
    rank = min(int(np.ceil(COVERAGE * (len(score) + 1))), len(score)) - 1
    return float(score[rank])
