"""Fit the unknowns of a machine to energies of its runs: a robust maximum a posteriori estimate.

Energies are observed with a relative error sigma, and each tree has a hidden state t (temperature) that multiplies
viscous friction by exp(t), t ~ N(0, sigma_t^2). Gauss-Newton on

    sum_i rho((E_i - E_i(x, t)) / (sigma E_i(x, t))) + (x - x0)' P^-1 (x - x0) + sum_t t^2 / sigma_t^2

with Huber's rho as weights; the states are eliminated tree by tree (Schur complement), and both sigmas follow from the
residuals (expectation maximisation), held near their first values where there is little data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.parameters import ParameterVector, Prior
from robojoule.calibration.run_model import ObservedRuns, evaluate_runs
from robojoule.motion.path_integrals import PathIntegrals

NOISE = 0.02  # expected relative error of an observed energy
STATE_SPREAD = 0.15  # expected log-normal spread of viscous friction over trees
_PSEUDO_TREES = 4.0
_PSEUDO_RUNS = 20.0
_HUBER = 2.5
_LEAST_NOISE = 1e-5
_ITERATIONS = 8
_CONVERGED = 2e-4
_TO_DEVIATION = 1.4826  # of a normal distribution, over its median absolute deviation


@dataclass(frozen=True)
class Calibration:
    """What a fit found.

    Attributes:
        x: Entries of the parameter vector, shape (P,).
        covariance: Their covariance, shape (P, P).
        noise: Relative error of the observed energies. [-]
        state_spread: Spread of the hidden state over trees. [-]
        states: Hidden state of each tree by its number. [-]
    """

    x: Array
    covariance: Array
    noise: float
    state_spread: float
    states: dict[int, float]


def calibrate(
    vector: ParameterVector,
    runs: Sequence[ObservedRuns],
    integrals: Sequence[PathIntegrals],
    prior: Prior | None = None,
) -> Calibration:
    """Fit the unknowns.

    Args:
        vector: What is unknown, see `robojoule.calibration.run_model.run_parameters`.
        runs: Distinct runs, one set for each payload; none: the prior itself.
        integrals: Their path integrals.
        prior: Belief before the runs; that of the entry if not given.
    """
    prior = prior or vector.prior()
    if not runs:
        return Calibration(prior.mean, prior.covariance, 0.0, STATE_SPREAD, {})
    precision = np.linalg.inv(prior.covariance)
    trees = sorted({int(tree) for part in runs for tree in part.tree})
    place = {tree: index for index, tree in enumerate(trees)}
    x, states = prior.mean.copy(), np.zeros(len(trees))
    noise, state_spread = NOISE, STATE_SPREAD
    schur = precision
    for _ in range(_ITERATIONS):
        normal, right = precision.copy(), precision @ (prior.mean - x)
        mixed = np.zeros((len(trees), vector.size))
        own, own_right = np.full(len(trees), state_spread**-2), -states / state_spread**2
        relative: list[Array] = []
        for part, path in zip(runs, integrals, strict=True):
            index = np.array([place[int(tree)] for tree in part.tree])
            found = evaluate_runs(vector, path, x, np.exp(states[index]))
            blocks = (
                (part.energy_j, found.energy_j, found.energy_jacobian),
                (part.idle_w, found.idle_w, found.idle_jacobian),
            )
            for kind, (truth, model, gradient) in enumerate(blocks):
                row, column = np.nonzero(np.isfinite(truth) & path.moving[:, None])
                scale = model[row, column]
                residual = truth[row, column] / scale - 1.0
                jacobian = gradient[row, column] / scale[:, None]
                state = (
                    jacobian[:, vector.part("viscous_nm_s_per_rad")].sum(axis=1) if kind == 0 else np.zeros(len(row))
                )
                standard = np.abs(residual) / noise
                weight = np.minimum(1.0, _HUBER / np.maximum(standard, 1e-12)) / noise**2
                normal += jacobian.T @ (jacobian * weight[:, None])
                right += jacobian.T @ (weight * residual)
                np.add.at(mixed, index[row], jacobian * (weight * state)[:, None])
                own += np.bincount(index[row], weight * state**2, len(trees))
                own_right += np.bincount(index[row], weight * state * residual, len(trees))
                if kind == 0:
                    relative.append(residual)
        schur = normal - mixed.T @ (mixed / own[:, None])
        step = np.linalg.solve(schur, right - mixed.T @ (own_right / own))
        change = (own_right - mixed @ step) / own
        # A step beyond what the prior calls likely comes from the linearisation, not from data.
        largest = max(1.0, float(np.max(np.abs(step) / np.sqrt(np.diag(prior.covariance)))) / 3.0)
        x, states = x + step / largest, states + change / largest
        after = np.concatenate(relative)
        state_spread = float(
            np.sqrt((_PSEUDO_TREES * STATE_SPREAD**2 + (states**2 + 1.0 / own).sum()) / (_PSEUDO_TREES + len(trees)))
        )
        deviation = _TO_DEVIATION * float(np.median(np.abs(after)))
        # Before the second step residuals tell of the nominal entry's errors, not of noise.
        share = _PSEUDO_RUNS / (_PSEUDO_RUNS + len(after)) if deviation > NOISE / 2 else 0.0
        noise = max(float(np.sqrt(share * NOISE**2 + (1.0 - share) * min(deviation, NOISE * 2) ** 2)), _LEAST_NOISE)
        if float(np.max(np.abs(step) / np.sqrt(np.diag(prior.covariance)))) < _CONVERGED:
            break
    covariance = np.linalg.inv(schur)
    return Calibration(
        x, (covariance + covariance.T) / 2.0, noise, state_spread, dict(zip(trees, states.tolist(), strict=True))
    )
