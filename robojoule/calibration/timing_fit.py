"""Fit the rules of `robojoule.calibration.timing_rules` to measured durations and choose one by how probable they are.

Each rule is fitted by Gauss-Newton to the maximum of its posterior. What it says of a motion that it was not fitted to
follows from the same linearisation without further fits: with whitened residuals r, derivatives J and the posterior
covariance S, the residuals of motion b left out are (1 - H)^-1 r_b, H = J_b S J_b', and their covariance is
(1 - H)^-1. Where no rule explains the durations to within their noise, the noise counts as that much larger.

Where a rule does, the most probable one is taken: the probability of all durations, the rule's figures integrated out
round the maximum of the posterior. A figure that might have had many values, or has one far from what was expected, so
counts against its rule. That serves only where one of the rules is right, and where runs have several speed limits:
those at one hardly tell velocities from accelerations. Else that rule is taken which makes motions left out most
probable. The entry's own timing takes part where it meets runs at several speed limits to 2 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array, Index, Mask
from robojoule.calibration.timing_rules import Candidate

RELATIVE_ERROR = 0.002  # of durations beside the resolution of their stamps
OF_STAMPS = 0.408  # standard deviation of a difference of two rounded instants over the resolution
_ITERATIONS = 14
_LARGEST_STEP = 1.5  # prior standard deviations
_CONVERGED = 1e-4
OWN_ERROR = 0.02  # of durations, up to which a machine may be as its entry says
_DEVIATIONS = 2.0  # of a sum of squares, beyond which durations are not explained


@dataclass(frozen=True, eq=False)
class Durations:
    """Measured durations of R runs, B data sets.

    Attributes:
        motion: Motion of each run, shape (R,).
        limits: Speed limits, shape (B, R). [-]
        duration_s: Shape (B, R). [s]
        deviation_s: Standard deviation of each, shape (B, R). [s]
    """

    motion: Index
    limits: Array
    duration_s: Array
    deviation_s: Array

    @classmethod
    def of(cls, motion: Index, limits: Array, duration_s: Array, resolution_s: float) -> Durations:
        """Durations whose stamps have a resolution [s]."""
        deviation = np.sqrt((OF_STAMPS * resolution_s) ** 2 + (RELATIVE_ERROR * duration_s) ** 2)
        return cls(motion, limits, duration_s, deviation)

    def joined(self, other: Durations) -> Durations:
        """These runs and others of the same data sets."""
        return Durations(
            np.concatenate([self.motion, other.motion]),
            *(
                np.concatenate([getattr(self, name), getattr(other, name)], axis=1)
                for name in ("limits", "duration_s", "deviation_s")
            ),
        )


@dataclass(frozen=True, eq=False)
class RuleFit:
    """One rule fitted to B data sets.

    Attributes:
        candidate: The rule.
        x: Entries, shape (B, P).
        covariance: Their covariance, shape (B, P, P), the noise enlarged by `excess`.
        excess: By how much residuals exceed their noise, shape (B,); at least 1. [-]
        improbability: Minus the logarithm of the probability of the durations, shape (B,).
        explained: Whether the durations, at several speed limits, are what the rule and its prior say to within their
            noise, shape (B,).
        left_out_improbability: Minus the logarithm of the probability of motions left out, shape (B,).
        freedom: Share of freedom that the fit leaves to the residuals, shape (B,). [-]
        held_out_s: Errors of runs whose motion was left out, measured less modelled, shape (B, R). [s]
    """

    candidate: Candidate
    x: Array
    covariance: Array
    excess: Array
    improbability: Array
    explained: Mask
    left_out_improbability: Array
    freedom: Array
    held_out_s: Array

    def held_out_error(self, durations: Durations) -> Array:
        """Root mean square of the held-out errors relative to the durations, shape (B,). [-]"""
        return np.asarray(np.sqrt(np.mean((self.held_out_s / durations.duration_s) ** 2, axis=1)))


def fit_rule(candidate: Candidate, durations: Durations) -> RuleFit:
    """Fit one rule to B data sets."""
    sets, entries = len(durations.duration_s), len(candidate.mean)
    precision = np.diag(candidate.spread**-2.0)
    x = np.tile(candidate.mean, (sets, 1))
    for _ in range(_ITERATIONS):
        residual, jacobian = _whitened(candidate, durations, x)
        normal = np.swapaxes(jacobian, 1, 2) @ jacobian + precision
        right = np.einsum("brp,br->bp", jacobian, residual) + (candidate.mean - x) * candidate.spread**-2.0
        step = np.linalg.solve(normal, right[..., None])[..., 0]
        size = np.max(np.abs(step) / candidate.spread, axis=1, keepdims=True)
        x = candidate.clipped(x + step / np.maximum(size / _LARGEST_STEP, 1.0))
        if size.max() < _CONVERGED:
            break
    residual, jacobian = _whitened(candidate, durations, x)
    normal = np.swapaxes(jacobian, 1, 2) @ jacobian + precision
    covariance = np.linalg.inv(normal)
    half = jacobian @ covariance
    square, log_det = np.zeros(sets), np.zeros(sets)
    left_out = np.empty_like(residual)
    for motion in np.unique(durations.motion):
        runs = np.flatnonzero(durations.motion == motion)
        within = np.eye(len(runs)) - half[:, runs] @ np.swapaxes(jacobian[:, runs], 1, 2)
        left_out[:, runs] = np.linalg.solve(within, residual[:, runs, None])[..., 0]
        square += np.einsum("br,br->b", residual[:, runs], left_out[:, runs])
        log_det += np.linalg.slogdet(within)[1]
    count = residual.shape[1]
    excess = np.maximum(np.sqrt(square / count), 1.0)
    left_out_improbability = count * np.log(excess) + square / (2.0 * excess**2) - log_det / 2.0
    prior_square = (((x - candidate.mean) / candidate.spread) ** 2).sum(axis=1)
    miss = (residual**2).sum(axis=1) + prior_square
    volume = np.linalg.slogdet(normal)[1] / 2.0 + np.log(candidate.spread).sum()
    left_out *= durations.deviation_s
    several_speeds = np.ptp(durations.limits, axis=1) > 0.0
    ruled_out = np.zeros(sets)
    if candidate.is_own:
        relative = np.sqrt(np.mean((left_out / durations.duration_s) ** 2, axis=1))
        ruled_out[~several_speeds | (relative > OWN_ERROR)] = np.inf
    return RuleFit(
        candidate,
        x.reshape(sets, entries),
        covariance * excess[:, None, None] ** 2,
        excess,
        miss / 2.0 + volume + ruled_out,
        (miss <= count + _DEVIATIONS * np.sqrt(2.0 * count)) & several_speeds & (ruled_out == 0.0),
        left_out_improbability + ruled_out,
        1.0 - np.einsum("brp,brp->b", half, jacobian) / count,
        left_out,
    )


def _whitened(candidate: Candidate, durations: Durations, x: Array) -> tuple[Array, Array]:
    modelled, jacobian = candidate.evaluate(x, durations.motion, durations.limits)
    scale = durations.deviation_s
    return (durations.duration_s - modelled) / scale, jacobian / scale[..., None]


def rule_scores(fits: Sequence[RuleFit]) -> Array:
    """Minus the logarithms of probabilities by which some fits are weighed, shape (rules, B)."""
    explained = np.stack([fit.explained for fit in fits]).any(axis=0)
    scores, left_out = (
        np.stack([getattr(fit, name) for fit in fits]) for name in ("improbability", "left_out_improbability")
    )
    return np.asarray(np.where(explained, scores, left_out))


def best_rules(fits: Sequence[RuleFit]) -> Index:
    """Which of some fits explains each data set best, shape (B,); the earlier one of equals."""
    return np.asarray(np.argmin(rule_scores(fits), axis=0))
