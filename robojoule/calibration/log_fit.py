"""Robust, bounded Gauss-Newton on the energy model, and what the data can tell.

Each step fixes regime, copper torques and Huber weights at the present parameters, solves the linear least-squares
problem within the physical bounds, and halves the step until the robust cost falls; so regime, efficiency and weights
are iterated together. Which parameters the data determine is read off the singular value decomposition of the weighted,
scaled Jacobian: a direction whose standard deviation exceeds a quarter of the scale is not determined, and the
parameter with the greatest part in it keeps its catalog value.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from robojoule.arrays import Array, Index, Mask
from robojoule.calibration.log_model import Evaluation, evaluate
from robojoule.calibration.parameters import ParameterVector
from robojoule.calibration.signals import Signals

HUBER = 1.345  # 95 % efficiency at normal noise
MAD_TO_SIGMA = 1.4826  # deviation of a normal distribution over its median absolute deviation
POWER_NOISE_EXPONENT = 0.5  # between a meter's constant error (0) and its relative one (1)
MOST_STEPS = 60
STEP_TOLERANCE = 1e-5  # of the scale
COST_TOLERANCE = 1e-7  # of the cost: the regime of a few instants may flicker for ever
UNDETERMINED = 0.25  # standard deviation over scale of a direction: two of them are half the parameters' size
CONFOUNDED = 0.3  # share of a parameter's effect along such a direction that is worth naming


@dataclass(frozen=True)
class Residuals:
    """Whitened residuals: R rows over power windows and, if logged, torque windows.

    Attributes:
        values: (measured - modelled) / standard deviation, shape (R,).
        jacobian: Derivatives of modelled / standard deviation, shape (R, P).
        block: Block of each row, shape (R,).
    """

    values: Array
    jacobian: Array
    block: Index


@dataclass(frozen=True)
class Solution:
    """A fit.

    Attributes:
        x: Parameters, shape (P,).
        standard_error: Their standard errors; NaN for those kept, shape (P,).
        inertia_error: How far wrong inertias may have moved them, shape (P,); see `_inertia_error`.
        free: Which parameters were estimated, shape (P,).
        confounded: For each entry kept, the entries that it cannot be told from (empty: nothing excites it).
    """

    x: Array
    standard_error: Array
    inertia_error: Array
    free: Mask
    confounded: dict[int, tuple[int, ...]]


class Problem:
    """The least-squares problem of one log; the held-out windows take no part.

    Args:
        vector: Parameters.
        signals: Prepared log.
    """

    def __init__(self, vector: ParameterVector, signals: Signals) -> None:
        self.vector, self.signals = vector, signals
        self.rows = np.flatnonzero(~signals.held_out)
        self.measured_w = signals.average(signals.power_w)[self.rows]
        self.block = signals.window_block[self.rows]
        self.size = np.maximum(np.abs(self.measured_w), 1.0) ** POWER_NOISE_EXPONENT
        self.with_torque = signals.torque_nm is not None
        if signals.torque_nm is not None:
            # Standing joints hold by stiction what no model tells; windows with a change of direction mix signs.
            self.torque_nm = signals.average(signals.torque_nm)[self.rows]
            self.direction = signals.average(signals.direction)[self.rows]
            self.velocity = signals.average(signals.velocity_rad_s)[self.rows]
            self.slides = np.abs(self.direction) > 0.999

    def evaluate(self, x: Array) -> Evaluation:
        """The model at some parameters."""
        return evaluate(self.vector, self.signals, x, use_measured_torque=self.with_torque)

    def raw(self, evaluation: Evaluation) -> list[Residuals]:
        """Residuals in their own units: power, then one entry per joint's torque."""
        result = [
            Residuals(
                (self.measured_w - evaluation.window_power_w[self.rows]) / self.size,
                evaluation.jacobian[self.rows] / self.size[:, None],
                self.block,
            )
        ]
        if not self.with_torque:
            return result
        coulomb, viscous = (self.vector.part(name).start for name in ("coulomb_nm", "viscous_nm_s_per_rad"))
        modelled = self.signals.average(evaluation.torque_nm)[self.rows]
        for joint in range(modelled.shape[1]):
            use = self.slides[:, joint]
            jacobian = np.zeros((int(use.sum()), self.vector.size))
            jacobian[:, coulomb + joint] = self.direction[use, joint]
            jacobian[:, viscous + joint] = self.velocity[use, joint]
            result.append(
                Residuals(self.torque_nm[use, joint] - modelled[use, joint], jacobian, self.block[use]),
            )
        return result


def _scales(parts: list[Residuals]) -> list[float]:
    """Robust standard deviation of each kind of residual."""
    return [
        max(MAD_TO_SIGMA * float(np.median(np.abs(part.values))), 1e-9) if len(part.values) else 1.0 for part in parts
    ]


def _whiten(parts: list[Residuals], scales: list[float]) -> Residuals:
    return Residuals(
        np.concatenate([part.values / scale for part, scale in zip(parts, scales, strict=True)]),
        np.concatenate([part.jacobian / scale for part, scale in zip(parts, scales, strict=True)]),
        np.concatenate([part.block for part in parts]),
    )


def _weights(values: Array) -> Array:
    """Huber weights."""
    size = np.abs(values)
    return np.where(size <= HUBER, 1.0, HUBER / np.maximum(size, HUBER))


def _cost(values: Array) -> float:
    """Huber cost."""
    size = np.abs(values)
    return float(np.where(size <= HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER)).sum())


def _step(vector: ParameterVector, rows: Residuals, x: Array, free: Mask) -> Array:
    """Minimiser of the weighted, linearised problem within the bounds."""
    root = np.sqrt(_weights(rows.values))
    matrix = rows.jacobian[:, free] * vector.scale[free] * root[:, None]
    target = root * rows.values + matrix @ (x[free] / vector.scale[free])
    # The triangle of a QR decomposition is a small problem with the same minimiser.
    triangle = np.asarray(np.linalg.qr(np.column_stack([matrix, target]), mode="r"))
    bounds = (vector.lower[free] / vector.scale[free], vector.upper[free] / vector.scale[free])
    solution = lsq_linear(triangle[:, :-1], triangle[:, -1], bounds=bounds, method="bvls")
    result = x.copy()
    result[free] = np.clip(solution.x, *bounds) * vector.scale[free]
    return result


def _fit(problem: Problem, x: Array, free: Mask) -> tuple[Array, Evaluation, list[float]]:
    """Iterate to the optimum for given free parameters."""
    evaluation = problem.evaluate(x)
    for _ in range(MOST_STEPS):
        parts = problem.raw(evaluation)
        scales = _scales(parts)
        rows = _whiten(parts, scales)
        target = _step(problem.vector, rows, x, free)
        before, share = _cost(rows.values), 1.0
        while True:
            trial = x + share * (target - x)
            evaluation = problem.evaluate(trial)
            after = _cost(_whiten(problem.raw(evaluation), scales).values)
            if share < 1e-3 or after <= before:
                break
            share /= 2.0
        change = np.abs(trial - x) / problem.vector.scale
        x = trial
        if change.max() < STEP_TOLERANCE or before - after < COST_TOLERANCE * before:
            break
    return x, evaluation, _scales(problem.raw(evaluation))


def _covariance(vector: ParameterVector, rows: Residuals, free: Mask) -> tuple[Array, Array, Array, float]:
    """Covariance of the scaled parameters: directions (rows), their naive deviations, column norms, and an inflation.

    Residuals within a motion hang together (a wrong inertia shows in every window), so the naive covariance is inflated
    by the median ratio of block-wise (sandwich) to naive variances where that exceeds one.
    """
    root = np.sqrt(_weights(rows.values))
    matrix = rows.jacobian[:, free] * vector.scale[free] * root[:, None]
    _, singular, vectors = np.linalg.svd(matrix, full_matrices=False)
    floor = 1e-12 * singular[0]
    deviation = 1.0 / np.maximum(singular, floor)
    good = singular > 1e-6 * singular[0]
    naive = np.sqrt(((vectors[good] / singular[good, None]) ** 2).sum(axis=0))
    scores = (matrix * (root * rows.values)[:, None]) @ (vectors[good].T / singular[good])
    sums = np.zeros((int(rows.block.max()) + 1, scores.shape[1]))
    np.add.at(sums, rows.block, scores)
    clustered = np.sqrt((((sums / singular[good]) @ vectors[good]) ** 2).sum(axis=0))
    ratio = float(np.median(clustered[naive > 0] / naive[naive > 0])) if np.any(naive > 0) else 1.0
    spread = float(np.sqrt(np.mean((root * rows.values) ** 2)))
    return vectors, deviation, np.linalg.norm(matrix, axis=0), max(ratio, spread, 1e-12)


def solve(vector: ParameterVector, signals: Signals) -> Solution:
    """Estimate what the log determines; the rest keeps the catalog's values.

    Args:
        vector: Parameters, with the catalog's values as start.
        signals: Prepared log.
    """
    problem = Problem(vector, signals)
    free = np.ones(vector.size, dtype=bool)
    x = np.clip(vector.start, vector.lower, vector.upper)
    confounded: dict[int, tuple[int, ...]] = {}
    evaluation = problem.evaluate(x)
    _drop_unexcited(vector, problem.raw(evaluation), free, confounded)
    while True:
        x, evaluation, scales = _fit(problem, x, free)
        rows = _whiten(problem.raw(evaluation), scales)
        vectors, deviation, norms, inflation = _covariance(vector, rows, free)
        worst = int(np.argmax(deviation))
        if deviation[worst] * inflation <= UNDETERMINED or not free.any():
            break
        columns = np.flatnonzero(free)
        direction = np.abs(vectors[worst])
        drop = int(np.argmax(direction))
        effect = direction * norms
        partners = [i for i in np.argsort(-effect) if i != drop and effect[i] > CONFOUNDED * effect[drop]]
        if inflation > UNDETERMINED * norms[drop]:  # not even determined if all others were known
            partners = []
        confounded[int(columns[drop])] = tuple(columns[partners].tolist())
        free[columns[drop]] = False
        x[columns[drop]] = np.clip(vector.start, vector.lower, vector.upper)[columns[drop]]
    error = np.full(len(x), np.nan)
    error[free] = np.sqrt(((vectors * deviation[:, None]) ** 2).sum(axis=0)) * inflation * vector.scale[free]
    moved = _inertia_error(problem, x, free, scales)
    return Solution(x, error, moved, free, confounded)


def _inertia_error(problem: Problem, x: Array, free: Mask, scales: list[float]) -> Array:
    """Root of the summed squared shifts that one heavier body after the other would cause, shape (P,).

    Standard errors cannot see that the robot file's inertias are wrong; this does, to first order.
    """
    vector, signals = problem.vector, problem.signals
    rows = _whiten(problem.raw(problem.evaluate(x)), scales)
    root = np.sqrt(_weights(rows.values))
    matrix = rows.jacobian[:, free] * vector.scale[free] * root[:, None]
    total = np.zeros(len(x))
    for change in signals.load_change_nm:
        heavier = Problem(vector, replace(signals, load_nm=signals.load_nm + change))
        values = _whiten(heavier.raw(heavier.evaluate(x)), scales).values
        shift = np.linalg.lstsq(matrix, root * (values - rows.values), rcond=None)[0]
        total[free] += (shift * vector.scale[free]) ** 2
    return np.asarray(np.sqrt(total))


def _drop_unexcited(
    vector: ParameterVector, parts: list[Residuals], free: Mask, confounded: dict[int, tuple[int, ...]]
) -> None:
    """Keep parameters without any influence on the measured rows (e.g. friction of a joint that never moves)."""
    influence = np.zeros(vector.size)
    for part, scale in zip(parts, _scales(parts), strict=True):
        influence += ((part.jacobian * vector.scale / scale) ** 2).sum(axis=0)
    for index in np.flatnonzero(influence <= 1e-6 * influence.max()):
        free[index] = False
        confounded[int(index)] = ()
