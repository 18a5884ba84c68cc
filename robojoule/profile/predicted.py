"""Whole energy profiles and idle power of new motions, from the nominal entry and what measured motions taught.

No run of the controller's simulation is needed for a new motion: time laws are the trajectory generator's own,
energies are path integrals (`path_integrals`) with the calibrated unknowns (`calibration`), corrected by a learned
residual (`residual`). Profiles are convex by construction: the lower hull of the predicted energies over duration.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.arrays import Array
from robojoule.calibration.inertial import inertial_directions
from robojoule.calibration.runs import Calibration, MeasuredMotions, calibrate
from robojoule.calibration.unknowns import Prior, Unknowns
from robojoule.errors import InputError
from robojoule.motion.path_integrals import EnergyIntegrals, PathIntegrals
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.enclosure import Enclosure
from robojoule.profile.residual import Residual, fit_residual, residual_features
from robojoule.profile.sampled import sampled_profile
from robojoule.robots.robot import Robot

INERTIAL_DIRECTIONS = 16
INERTIA_SPREAD = 0.15  # largest relative error expected of published link inertia
COVERAGE = 0.9
NORMAL_QUANTILE = 1.6449  # of a normal distribution: +- this many deviations hold 90 %
_FEWEST_HELD_OUT = 5
_HELD_OUT_EVERY = 5  # of the trees every fifth calibrates the intervals
_BLOCK = 256  # motions predicted at once: bounds memory


@dataclass(frozen=True)
class Measurements:
    """Measured motions of one robot with one payload, as a user or a study has them.

    Attributes:
        paths: The motions as the nominal entry plans them.
        speed_limits: Fractions in (0, 1], shape (S,) or (M, S). [-]
        energy_j: Measured energies, shape (M, S); NaN where nothing was measured. [J]
        idle_w: Measured idle power at start and end, shape (M, 2); NaN where nothing was measured. [W]
        tree: Number of the tree of each motion, shape (M,).
    """

    paths: MotionPaths
    speed_limits: Array
    energy_j: Array
    idle_w: Array
    tree: NDArray[np.intp]

    def only(self, rows: NDArray[np.bool_]) -> Measurements:
        """The same with the measurements of other motions left out."""
        keep = rows[:, None]
        return replace(self, energy_j=np.where(keep, self.energy_j, np.nan), idle_w=np.where(keep, self.idle_w, np.nan))

    def thinned(self, runs_per_motion: int) -> Measurements:
        """The same with fewer runs of each motion: spread over the speed limits, shifted from motion to motion."""
        count = self.energy_j.shape[1]
        if runs_per_motion >= count:
            return self
        spread = np.arange(runs_per_motion) * count // runs_per_motion
        chosen = np.sort((spread + np.arange(len(self.energy_j))[:, None]) % count, axis=1)
        limits = np.broadcast_to(self.speed_limits, self.energy_j.shape)
        return replace(
            self,
            speed_limits=np.take_along_axis(limits, chosen, axis=1),
            energy_j=np.take_along_axis(self.energy_j, chosen, axis=1),
        )


@dataclass(frozen=True)
class PredictedProfiles:
    """Predicted profiles of M motions at S speed limits (a `ProfileSource`); convex over duration.

    Attributes:
        speed_limit: Shape (M, S). [-]
        duration_s: The trajectory generator's own durations, shape (M, S). [s]
        energy_j: Predicted energies, shape (M, S). [J]
        lower_j: Lower end of the interval of each energy, shape (M, S). [J]
        upper_j: Its upper end, shape (M, S). [J]
        cautious_j: Energy at full speed plus the upper quantile of the difference to it, shape (M, S). [J]
        idle_start_w: Predicted idle power at the start, shape (M,). [W]
        idle_end_w: Predicted idle power at the end, shape (M,). [W]
    """

    speed_limit: Array
    duration_s: Array
    energy_j: Array
    lower_j: Array
    upper_j: Array
    cautious_j: Array
    idle_start_w: Array
    idle_end_w: Array

    def cautious(self) -> PredictedProfiles:
        """The same with profiles by the upper quantile of energy differences instead of the prediction itself."""
        return replace(self, energy_j=self.cautious_j)

    def enclosure(self, motion: int) -> Enclosure:
        """The convex profile of a motion, which is all that is known of it."""
        runs = sampled_profile(self.duration_s[motion], self.energy_j[motion], self.speed_limit[motion])
        return Enclosure.exact(runs.piecewise().lower_hull)

    def refine_near(self, durations_s: Mapping[int, Array]) -> list[int]:
        """A prediction knows no more than it says; see `ProfileSource.refine_near`."""
        return []


@dataclass(frozen=True)
class ProfilePredictor:
    """Fitted predictor of one robot with any payload; immutable, callable on any number of motions.

    Attributes:
        robot: Name of the catalog entry.
        nominal: The entry's drives, by name; predictions for another entry are refused.
        directions: Inertial directions, shape (10 n, r).
        calibration: What the fit found.
        residual: Learned correction.
        interval: Deviations to either side that hold `COVERAGE` of the measurements. [-]
    """

    robot: str
    nominal: dict[str, Array]
    directions: Array
    calibration: Calibration
    residual: Residual
    interval: float

    def predict(self, paths: MotionPaths, speed_limits: ArrayLike) -> PredictedProfiles:
        """Predict profiles.

        Args:
            paths: Motions of the nominal entry with any payload.
            speed_limits: Fractions in (0, 1], shape (S,) or (M, S). [-]

        Raises:
            InputError: Another robot, or a changed entry.
        """
        if paths.robot.name != self.robot:
            raise InputError(f"the predictor knows {self.robot}, not {paths.robot.name}")
        unknowns = Unknowns(paths.robot.drives, self.directions)
        unknowns.check(self.nominal, self.robot)
        limits = np.asarray(speed_limits, dtype=float)
        limits = np.broadcast_to(limits, (paths.motions, limits.shape[-1])).copy()
        blocks = []
        with one_thread():
            for first in range(0, paths.motions, _BLOCK):
                rows = slice(first, first + _BLOCK)
                part = paths if paths.motions <= _BLOCK else paths.subset(rows)
                blocks.append(self._predict(unknowns, part, limits[rows]))
        names = PredictedProfiles.__dataclass_fields__
        return PredictedProfiles(**{name: np.concatenate([getattr(block, name) for block in blocks]) for name in names})

    def _predict(self, unknowns: Unknowns, paths: MotionPaths, limits: Array) -> PredictedProfiles:
        integrals = PathIntegrals(paths, limits, self.directions)
        expected = unknowns.expected(self.calibration.x, self.calibration.covariance)
        found, jacobian = _evaluated(unknowns, integrals, expected)
        factor = self.residual.factor(_features(unknowns, integrals, found, jacobian))
        energy, jacobian = found.energy_j * factor, jacobian * factor[..., None]
        convex = np.stack([_lower_hull(*row) for row in zip(integrals.duration_s, energy, limits, strict=True)])
        deviation = self._deviation(unknowns, jacobian)
        fastest = integrals.duration_s.argmin(axis=1)[:, None]
        at_full = np.take_along_axis(jacobian, fastest[..., None], axis=1)
        risk = self.interval * self._deviation(unknowns, jacobian - at_full)
        return PredictedProfiles(
            speed_limit=limits,
            duration_s=integrals.duration_s,
            energy_j=convex,
            lower_j=convex - self.interval * deviation,
            upper_j=convex + self.interval * deviation,
            cautious_j=convex + risk,
            idle_start_w=found.idle_w[:, 0],
            idle_end_w=found.idle_w[:, 1],
        )

    def _deviation(self, unknowns: Unknowns, jacobian: Array) -> Array:
        """Standard deviation of energies, or of differences, from derivatives of shape (..., p); shape (...). [J]"""
        state = jacobian[..., unknowns.part("viscous")].sum(axis=-1) * self.calibration.state_spread
        variance = np.einsum("...p,pq,...q->...", jacobian, self.calibration.covariance, jacobian, optimize=True)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0) + state**2))


def fit_profile_predictor(
    robot: Robot, measured: Sequence[Measurements], prior: Prior | None = None, *, residual: bool = True
) -> ProfilePredictor:
    """Fit a predictor to measured motions.

    With enough trees, every fifth one is kept from the fit and calibrates the intervals (split conformal prediction);
    with few, all are used and intervals are those of the posterior.

    Args:
        robot: Nominal entry with any payload.
        measured: Measurements, one for each payload; none: the prior itself.
        prior: Belief before the measurements; that of the entry if not given.
        residual: Whether a correction may be learned.
    """
    with one_thread():
        return _fit(robot, measured, prior, residual=residual)


def one_thread() -> AbstractContextManager[object]:
    """Matrix products on one thread: they are small, and their sums must not depend on the number of threads."""
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[object] = threadpool_limits(1)
    return limits


def _fit(robot: Robot, measured: Sequence[Measurements], prior: Prior | None, *, residual: bool) -> ProfilePredictor:
    directions = inertial_directions(robot, INERTIAL_DIRECTIONS, INERTIA_SPREAD)
    unknowns = Unknowns(robot.drives, directions)
    prior = prior or unknowns.prior()
    sets = [
        MeasuredMotions(PathIntegrals(m.paths, m.speed_limits, directions), _distinct(m), m.idle_w, m.tree)
        for m in measured
    ]
    trees = np.unique(np.concatenate([m.tree for m in measured])) if measured else np.zeros(0, dtype=np.intp)
    held = trees[_HELD_OUT_EVERY - 1 :: _HELD_OUT_EVERY]
    if len(held) < _FEWEST_HELD_OUT:
        held = held[:0]
    if sets:
        fitted = [_without(part, held) for part in sets]
        calibration = calibrate(unknowns, fitted, prior)
    else:
        fitted = []
        calibration = Calibration(prior.mean, prior.covariance, 0.0, 0.15, {})
    predictor = ProfilePredictor(
        robot.name, unknowns.arrays(), directions, calibration, _no_residual(unknowns), NORMAL_QUANTILE
    )
    if residual and sets:
        predictor = replace(predictor, residual=_learned_residual(unknowns, fitted, calibration))
    if len(held):
        predictor = replace(predictor, interval=_conformal(predictor, unknowns, sets, held))
    return predictor


def _evaluated(
    unknowns: Unknowns, integrals: PathIntegrals, x: Array, viscosity: Array | None = None
) -> tuple[EnergyIntegrals, Array]:
    drives = unknowns.drives(x)
    found = integrals.evaluate(drives, unknowns.inertial(x), viscosity, gradient=True)
    return found, unknowns.chain(found.gradients()[0], drives)


def _features(unknowns: Unknowns, integrals: PathIntegrals, found: EnergyIntegrals, jacobian: Array) -> Array:
    scale = np.where(found.energy_j > 0.0, found.energy_j, 1.0)[..., None]
    names = ("base", "coulomb", "viscous", "copper", "load_friction")
    elasticity = {name: jacobian[..., unknowns.part(name)] / scale for name in names}
    speed = integrals.peak_velocity[..., None] * np.abs(integrals.delta_rad)[:, None, :]
    return residual_features(elasticity, speed / integrals.robot.velocity_rad_s)


def _no_residual(unknowns: Unknowns) -> Residual:
    width = 1 + 5 * unknowns.joints
    return Residual(np.zeros(width), np.ones(width), np.zeros(width), 0.0)


def _learned_residual(unknowns: Unknowns, sets: Sequence[MeasuredMotions], calibration: Calibration) -> Residual:
    features, relative, trees = [], [], []
    for part in sets:
        viscosity = np.exp([calibration.states.get(int(tree), 0.0) for tree in part.tree])
        found, jacobian = _evaluated(unknowns, part.integrals, calibration.x, viscosity)
        used = np.isfinite(part.energy_j) & part.integrals.moving[:, None]
        features.append(_features(unknowns, part.integrals, found, jacobian)[used])
        relative.append(part.energy_j[used] / found.energy_j[used] - 1.0)
        trees.append(np.broadcast_to(part.tree[:, None], used.shape)[used])
    return fit_residual(np.concatenate(features), np.concatenate(relative), np.concatenate(trees))


def _conformal(
    predictor: ProfilePredictor, unknowns: Unknowns, sets: Sequence[MeasuredMotions], held: NDArray[np.intp]
) -> float:
    """Deviations that hold `COVERAGE` of the held-out measurements, noise added to what the predictor expects."""
    scores = []
    for part in sets:
        used = np.isfinite(part.energy_j) & part.integrals.moving[:, None] & np.isin(part.tree, held)[:, None]
        found, jacobian = _evaluated(unknowns, part.integrals, predictor.calibration.x)
        factor = predictor.residual.factor(_features(unknowns, part.integrals, found, jacobian))
        energy = found.energy_j * factor
        deviation = predictor._deviation(unknowns, jacobian * factor[..., None])
        expected = np.sqrt(deviation**2 + (predictor.calibration.noise * energy) ** 2)
        scores.append((np.abs(part.energy_j - energy)[used]) / expected[used])
    score = np.sort(np.concatenate(scores))
    rank = min(int(np.ceil(COVERAGE * (len(score) + 1))), len(score)) - 1
    return float(score[rank])


def _distinct(measured: Measurements) -> Array:
    """Energies with repetitions of the same run left out: higher speed limits that change nothing."""
    durations = measured.paths.durations(measured.speed_limits)
    repeated = np.zeros(durations.shape, dtype=bool)
    repeated[:, 1:] = np.abs(np.diff(durations, axis=1)) < 1e-9
    return np.where(repeated, np.nan, measured.energy_j)


def _without(part: MeasuredMotions, trees: NDArray[np.intp]) -> MeasuredMotions:
    keep = ~np.isin(part.tree, trees)[:, None]
    return replace(part, energy_j=np.where(keep, part.energy_j, np.nan), idle_w=np.where(keep, part.idle_w, np.nan))


def _lower_hull(duration_s: Array, energy_j: Array, speed_limit: Array) -> Array:
    """Largest convex function of the duration below the energies of distinct runs, at the same durations."""
    hull = sampled_profile(duration_s, energy_j, speed_limit).piecewise().lower_hull
    return np.interp(duration_s, hull.durations_s, hull.energies_j)
