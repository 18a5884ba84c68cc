"""The predictor that measured motions give, judged on motions that it has not seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from robojoule.arrays import Array, Index, Mask
from robojoule.calibration.run_model import ObservedRuns
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.predicted import ProfilePredictor, calibrated_predictor
from robojoule.robots.robot import Payload, Robot

FEWEST_MOTIONS = 15
_HELD_OUT_EVERY = 5


@dataclass(frozen=True)
class MeasuredPredictor:
    """What measured motions teach.

    Attributes:
        predictor: Fitted to all motions.
        motions: How many.
        error_percent: Median relative error of the energy on held-out motions, by a fit to the others. [%]
        entry_error_percent: The same by the catalog's entry alone. [%]
    """

    predictor: ProfilePredictor
    motions: int
    error_percent: float
    entry_error_percent: float

    @property
    def is_accepted(self) -> bool:
        """Whether it knows the machine better than the catalog does."""
        return self.error_percent < self.entry_error_percent


def predictor_of(robot: Robot, rows: pa.Table) -> MeasuredPredictor:
    """Fit a predictor to measured motions.

    Args:
        robot: The catalog's entry, with any payload.
        rows: Table of `measured_motions`.

    Raises:
        InputError: Too few motions.
    """
    if len(rows) < FEWEST_MOTIONS:
        raise InputError(f"{len(rows)} measured motions are too few", allowed=f"{FEWEST_MOTIONS} or more")
    held = np.arange(len(rows)) % _HELD_OUT_EVERY == _HELD_OUT_EVERY - 1
    known = calibrated_predictor(robot, _observed(robot, rows, ~held))
    entry = calibrated_predictor(robot)
    errors = [_error_percent(one, robot, rows, held) for one in (known, entry)]
    return MeasuredPredictor(
        calibrated_predictor(robot, _observed(robot, rows, np.ones_like(held))), len(rows), *errors
    )


def _parts(robot: Robot, rows: pa.Table, chosen: Mask) -> list[tuple[MotionPaths, Array, Array, Index]]:
    """Paths, speed limits (M, 1) [-], energies (M, 1) [J] and places of the chosen motions, for each payload."""
    payload = rows["payload_kg"].to_numpy()
    found = []
    for mass_kg in np.unique(payload[chosen]).tolist():
        places = np.flatnonzero(chosen & (payload == mass_kg))
        part = rows.take(places)
        start, end = (
            np.column_stack([part[f"{side}_q{joint + 1}_rad"] for joint in range(robot.joint_count)])
            for side in ("start", "end")
        )
        loaded = Robot(robot.file, _of_mass(robot.payload, mass_kg))
        limits = part["speed_limit_percent"].to_numpy()[:, None] / 100.0
        found.append((MotionPaths(loaded, start, end), limits, part["energy_j"].to_numpy()[:, None], places))
    return found


def _of_mass(payload: Payload, mass_kg: float) -> Payload:
    """A payload of the same shape in the same place."""
    inertia = payload.inertia_kg_m2
    if inertia is not None and payload.mass_kg > 0.0:
        inertia = np.asarray(inertia) * (mass_kg / payload.mass_kg)
    return Payload(mass_kg, payload.com_m, inertia)


def _observed(robot: Robot, rows: pa.Table, chosen: Mask) -> list[ObservedRuns]:
    return [
        ObservedRuns(paths, limits, energy, np.full((len(places), 2), np.nan), places)
        for paths, limits, energy, places in _parts(robot, rows, chosen)
    ]


def _error_percent(predictor: ProfilePredictor, robot: Robot, rows: pa.Table, chosen: Mask) -> float:
    errors = [
        np.abs(predictor.predict(paths, limits).energy_j / energy - 1.0).ravel()
        for paths, limits, energy, _ in _parts(robot, rows, chosen)
    ]
    return round(100.0 * float(np.median(np.concatenate(errors))), 4)
