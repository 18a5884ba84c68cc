"""Fit the unknowns of a plant to measured energies: a robust maximum a posteriori estimate.

Energies are measured with a relative error sigma, and each tree has a hidden state t (temperature) that multiplies
viscous friction by exp(t), t ~ N(0, sigma_t^2). Gauss-Newton on

    sum_i rho((E_i - E_i(x, t)) / (sigma E_i(x, t))) + (x - x0)' P^-1 (x - x0) + sum_t t^2 / sigma_t^2

with Huber's rho as weights; the states are eliminated tree by tree (Schur complement), and both sigmas follow from the
residuals (expectation maximisation), held near their first values where there is little data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robojoule.arrays import Array
from robojoule.calibration.unknowns import Prior, Unknowns
from robojoule.motion.path_integrals import PathIntegrals

NOISE = 0.02  # expected relative error of a measured energy
STATE_SPREAD = 0.15  # expected log-normal spread of viscous friction over trees
_PSEUDO_TREES = 4.0
_PSEUDO_RUNS = 20.0
_HUBER = 2.5
_LEAST_NOISE = 1e-5
_ITERATIONS = 8
_CONVERGED = 2e-4
_TO_DEVIATION = 1.4826  # of a normal distribution, over its median absolute deviation


@dataclass(frozen=True)
class MeasuredMotions:
    """Measured energies of motions of one robot with one payload.

    Attributes:
        integrals: Their path integrals at the speed limits of the runs.
        energy_j: Measured energies, shape (M, S); NaN where nothing was measured. [J]
        idle_w: Measured idle power at start and end, shape (M, 2); NaN where nothing was measured. [W]
        tree: Tree of each motion, whole numbers that are the same over payloads only for one and the same tree, (M,).
    """

    integrals: PathIntegrals
    energy_j: Array
    idle_w: Array
    tree: NDArray[np.intp]


@dataclass(frozen=True)
class Calibration:
    """What a fit found.

    Attributes:
        x: Unknowns, shape (p,).
        covariance: Their covariance, shape (p, p).
        noise: Relative error of the measured energies. [-]
        state_spread: Spread of the hidden state over trees. [-]
        states: Hidden state of each tree by its number. [-]
    """

    x: Array
    covariance: Array
    noise: float
    state_spread: float
    states: dict[int, float]


def calibrate(unknowns: Unknowns, measured: Sequence[MeasuredMotions], prior: Prior | None = None) -> Calibration:
    """Fit the unknowns.

    Args:
        unknowns: Unknowns of the robot.
        measured: Measurements, at least one.
        prior: Belief before the measurements; that of the entry if not given.
    """
    prior = prior or unknowns.prior()
    precision = np.linalg.inv(prior.covariance)
    trees = sorted({int(tree) for part in measured for tree in part.tree})
    place = {tree: index for index, tree in enumerate(trees)}
    x, states = prior.mean.copy(), np.zeros(len(trees))
    noise, state_spread = NOISE, STATE_SPREAD
    schur = precision
    for _ in range(_ITERATIONS):
        normal, right = precision.copy(), precision @ (prior.mean - x)
        mixed = np.zeros((len(trees), unknowns.size))
        own, own_right = np.full(len(trees), state_spread**-2), -states / state_spread**2
        relative: list[Array] = []
        for part in measured:
            index = np.array([place[int(tree)] for tree in part.tree])
            drives = unknowns.drives(x)
            found = part.integrals.evaluate(drives, unknowns.inertial(x), np.exp(states[index]), gradient=True)
            of_energy, of_idle = found.gradients()
            blocks = (
                (part.energy_j, found.energy_j, unknowns.chain(of_energy, drives)),
                (part.idle_w, found.idle_w, unknowns.chain(of_idle, drives)),
            )
            for kind, (truth, model, gradient) in enumerate(blocks):
                row, column = np.nonzero(np.isfinite(truth) & part.integrals.moving[:, None])
                scale = model[row, column]
                residual = truth[row, column] / scale - 1.0
                jacobian = gradient[row, column] / scale[:, None]
                state = jacobian[:, unknowns.part("viscous")].sum(axis=1) if kind == 0 else np.zeros(len(row))
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
