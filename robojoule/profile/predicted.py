"""Whole energy profiles and idle power of new motions, from the nominal entry and what known runs taught.

No run of the controller's simulation is needed for a new motion: time laws are the trajectory generator's own,
energies are path integrals with the calibrated figures (`robojoule.calibration.run_model`), corrected by a learned
residual (`residual`). Profiles are convex by construction: the lower hull of the predicted energies over duration.
Predicting needs numpy alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import Array
from robojoule.calibration.parameters import ParameterVector, Prior
from robojoule.calibration.run_fit import Calibration, calibrate
from robojoule.calibration.run_model import (
    ObservedRuns,
    RunEvaluation,
    body_directions,
    evaluate_runs,
    expected_entries,
    run_parameters,
)
from robojoule.errors import InputError
from robojoule.motion.path_integrals import PathIntegrals
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.enclosure import Enclosure
from robojoule.profile.residual import Residual, no_residual, residual_features
from robojoule.profile.sampled import sampled_profile
from robojoule.robots.drives import DriveParameters
from robojoule.robots.robot import Robot

NORMAL_QUANTILE = 1.6449  # of a normal distribution: +- this many deviations hold 90 %
_BLOCK = 256  # motions predicted at once: bounds memory


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class ProfilePredictor:
    """Fitted predictor of one robot with any payload; immutable, callable on any number of motions.

    Attributes:
        robot: Name of the catalog entry.
        nominal: The entry's drives; predictions for another entry are refused.
        directions: Inertial directions, shape (10 n, r).
        calibration: What the fit found.
        residual: Learned correction.
        interval: Deviations to either side that hold 90 % of the observed energies. [-]
        note: One sentence on what it rests on.
    """

    robot: str
    nominal: DriveParameters
    directions: Array
    calibration: Calibration
    residual: Residual
    interval: float
    note: str

    @classmethod
    def of(cls, robot: Robot, directions: Array, calibration: Calibration, note: str) -> ProfilePredictor:
        """The predictor of a calibration alone: no residual, and the interval of a normal distribution."""
        nominal = run_parameters(robot.drives, directions).nominal
        return cls(robot.name, nominal, directions, calibration, no_residual(robot.joint_count), NORMAL_QUANTILE, note)

    def check_entry(self, robot: Robot) -> None:
        """Refuse robots that the predictor was not fitted to.

        Raises:
            InputError: Another robot, or a changed entry.
        """
        if robot.name != self.robot:
            raise InputError(f"the predictor knows {self.robot}, not {robot.name}")
        nominal = run_parameters(robot.drives, self.directions).nominal
        for field in fields(DriveParameters):
            here, fitted = (np.asarray(getattr(drives, field.name)) for drives in (nominal, self.nominal))
            if here.shape != fitted.shape or not np.allclose(here, fitted, rtol=1e-9, atol=0.0):
                raise InputError(
                    f"the predictor was fitted to another entry of {self.robot}: its {field.name} differ; fit it again",
                    key=field.name,
                )

    def predict(self, paths: MotionPaths, speed_limits: ArrayLike) -> PredictedProfiles:
        """Predict profiles.

        Args:
            paths: Motions of the nominal entry with any payload.
            speed_limits: Fractions in (0, 1], shape (S,) or (M, S). [-]

        Raises:
            InputError: Another robot, or a changed entry.
        """
        self.check_entry(paths.robot)
        limits = np.asarray(speed_limits, dtype=float)
        limits = np.broadcast_to(limits, (paths.motions, limits.shape[-1])).copy()
        blocks = []
        for first in range(0, paths.motions, _BLOCK):
            rows = slice(first, first + _BLOCK)
            part = paths if paths.motions <= _BLOCK else paths.subset(rows)
            blocks.append(self._predict(part, limits[rows]))
        names = PredictedProfiles.__dataclass_fields__
        return PredictedProfiles(**{name: np.concatenate([getattr(block, name) for block in blocks]) for name in names})

    def _predict(self, paths: MotionPaths, limits: Array) -> PredictedProfiles:
        integrals = PathIntegrals(paths, limits, self.directions)
        vector = run_parameters(self.nominal, self.directions)
        expected = expected_entries(vector, self.calibration.x, self.calibration.covariance)
        found, energy, jacobian = self.corrected(vector, integrals, expected)
        convex = np.stack([_lower_hull(*row) for row in zip(integrals.duration_s, energy, limits, strict=True)])
        deviation = self.deviation_j(vector, jacobian)
        fastest = integrals.duration_s.argmin(axis=1)[:, None]
        at_full = np.take_along_axis(jacobian, fastest[..., None], axis=1)
        risk = self.interval * self.deviation_j(vector, jacobian - at_full)
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

    def corrected(
        self, vector: ParameterVector, integrals: PathIntegrals, x: Array
    ) -> tuple[RunEvaluation, Array, Array]:
        """The model at some parameters; energies (M, S) and their derivatives (M, S, P) with the residual applied."""
        found = evaluate_runs(vector, integrals, x)
        factor = self.residual.factor(residual_features(vector, integrals, found))
        return found, found.energy_j * factor, found.energy_jacobian * factor[..., None]

    def deviation_j(self, vector: ParameterVector, jacobian: Array) -> Array:
        """Standard deviation of energies, or of differences, from derivatives of shape (..., P); shape (...). [J]"""
        state = jacobian[..., vector.part("viscous_nm_s_per_rad")].sum(axis=-1) * self.calibration.state_spread
        variance = np.einsum("...p,pq,...q->...", jacobian, self.calibration.covariance, jacobian, optimize=True)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0) + state**2))


def calibrated_predictor(
    robot: Robot, runs: Sequence[ObservedRuns] = (), prior: Prior | None = None
) -> ProfilePredictor:
    """Predictor from the physics of a robot's entry, calibrated on runs of the machine if there are any.

    Args:
        robot: Nominal entry with any payload.
        runs: Observed runs, one set for each payload; none: nominal physics, with the interval expected of an entry.
        prior: Belief before the runs; that of the entry if not given.
    """
    directions = body_directions(robot)
    vector = run_parameters(robot.drives, directions)
    distinct = [part.distinct() for part in runs]
    calibration = calibrate(vector, distinct, [part.integrals(directions) for part in distinct], prior)
    count = sum(int(np.isfinite(part.energy_j).sum()) for part in distinct)
    note = (
        f"calibrated on {count} runs of {robot.name}"
        if count
        else f"no run of {robot.name} is known: nominal physics of its entry, with the wide interval expected of one"
    )
    return ProfilePredictor.of(robot, directions, calibration, note)


def _lower_hull(duration_s: Array, energy_j: Array, speed_limit: Array) -> Array:
    """Largest convex function of the duration below the energies of distinct runs, at the same durations."""
    hull = sampled_profile(duration_s, energy_j, speed_limit).piecewise().lower_hull
    return np.interp(duration_s, hull.durations_s, hull.energies_j)
