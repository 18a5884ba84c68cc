"""Profile predictors as folders of two files, see `robojoule.profile.array_file`."""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from robojoule.calibration.run_fit import Calibration
from robojoule.calibration.run_model import run_parameters
from robojoule.documents import Document, load, write_document
from robojoule.inputs import as_path
from robojoule.profile.array_file import ARRAYS, DESCRIPTION, Arrays, read_arrays, write_arrays
from robojoule.profile.predicted import ProfilePredictor
from robojoule.profile.residual import Residual, no_residual
from robojoule.robots.drives import DriveParameters

NonNegative = Annotated[float, Field(ge=0)]
_NOMINAL = "nominal_"


class ProfilePredictorFile(Document):
    """`predictor.json` of a profile predictor."""

    format: Literal["robojoule-profile-predictor"] = "robojoule-profile-predictor"
    format_version: Literal[2] = 2
    robot: str = Field(min_length=1, description="Catalog entry that the predictor was fitted to.")
    note: str = Field(min_length=1, description="What the predictor rests on.")
    noise: NonNegative = Field(description="Relative error of the observed energies. [-]")
    state_spread: NonNegative = Field(description="Log-normal spread of viscous friction over trees. [-]")
    interval: NonNegative = Field(description="Deviations to either side that hold 90 % of the observed energies. [-]")
    residual_gain: float = Field(description="Share of the squared residual that the correction takes away. [-]")


def save_profile_predictor(predictor: ProfilePredictor, folder: str | Path) -> None:
    """Write a predictor; the same predictor gives the same bytes."""
    folder = Path(folder)
    arrays = {f"{_NOMINAL}{name}": np.asarray(value, dtype=float) for name, value in vars(predictor.nominal).items()}
    arrays |= {
        "directions": predictor.directions,
        "unknowns": predictor.calibration.x,
        "covariance": predictor.calibration.covariance,
        "residual_mean": predictor.residual.mean,
        "residual_scale": predictor.residual.scale,
        "residual_weights": predictor.residual.weights,
    }
    described = ProfilePredictorFile(
        robot=predictor.robot,
        note=predictor.note,
        noise=predictor.calibration.noise,
        state_spread=predictor.calibration.state_spread,
        interval=predictor.interval,
        residual_gain=predictor.residual.gain,
    )
    write_arrays(folder / ARRAYS, arrays)
    write_document(folder / DESCRIPTION, described.model_dump(mode="json"))


def load_profile_predictor(folder: str | Path) -> ProfilePredictor:
    """Read a predictor written by `save_profile_predictor`; no code of the files runs.

    Raises:
        InputError: A file is missing, truncated or does not hold a profile predictor.
    """
    folder = as_path(folder, "model")
    described = load(ProfilePredictorFile, folder / DESCRIPTION)
    return read_arrays(folder / ARRAYS, partial(_assemble, described))


def _assemble(described: ProfilePredictorFile, arrays: Arrays) -> ProfilePredictor:
    figures = {field.name: arrays[f"{_NOMINAL}{field.name}"] for field in fields(DriveParameters)}
    joints, directions = np.shape(figures["gear_ratio"]), arrays["directions"]
    if len(joints) != 1 or any(figure.shape not in ((), joints) for figure in figures.values()):
        raise ValueError("the figures of the drives do not fit together")
    if directions.ndim != 2 or len(directions) != 10 * joints[0]:
        raise ValueError(f"the inertial directions have shape {directions.shape}")
    values: dict[str, Any] = {name: figure if figure.ndim else float(figure) for name, figure in figures.items()}
    nominal = DriveParameters(**values)
    size, features = run_parameters(nominal, directions).size, no_residual(joints[0]).mean.shape
    shapes = {"unknowns": (size,), "covariance": (size, size)}
    shapes |= {f"residual_{name}": features for name in ("mean", "scale", "weights")}
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise ValueError(f"the array '{name}' has shape {arrays[name].shape} instead of {shape}")
    residual = Residual(
        arrays["residual_mean"], arrays["residual_scale"], arrays["residual_weights"], described.residual_gain
    )
    calibration = Calibration(arrays["unknowns"], arrays["covariance"], described.noise, described.state_spread, {})
    return ProfilePredictor(
        described.robot, nominal, directions, calibration, residual, described.interval, described.note
    )
