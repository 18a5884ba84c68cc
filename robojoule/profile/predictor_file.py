"""Profile predictors as files: `NAME.json` says what, `NAME.npz` holds the arrays; both have stable bytes."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from robojoule.calibration.runs import Calibration
from robojoule.documents import Document, load, write_document
from robojoule.profile.array_file import Arrays, read_arrays, write_arrays
from robojoule.profile.predicted import ProfilePredictor
from robojoule.profile.residual import Residual

NonNegative = Annotated[float, Field(ge=0)]
_NOMINAL = "nominal_"


class ProfilePredictorFile(Document):
    """`NAME.json` of a profile predictor."""

    format: Literal["robojoule-profile-predictor"] = "robojoule-profile-predictor"
    format_version: Literal[1] = 1
    robot: str = Field(min_length=1, description="Catalog entry that the predictor was fitted to.")
    noise: NonNegative = Field(description="Relative error of the measured energies. [-]")
    state_spread: NonNegative = Field(description="Log-normal spread of viscous friction over trees. [-]")
    interval: NonNegative = Field(description="Deviations to either side that hold 90 % of the measurements. [-]")
    residual_gain: float = Field(description="Share of the squared residual that the correction takes away. [-]")


def export_profile_predictor(predictor: ProfilePredictor, path: str | Path) -> None:
    """Write a predictor as `path` with the suffixes `.json` and `.npz`; the same predictor gives the same bytes."""
    path = Path(path)
    arrays = {f"{_NOMINAL}{name}": value for name, value in sorted(predictor.nominal.items())} | {
        "directions": predictor.directions,
        "unknowns": predictor.calibration.x,
        "covariance": predictor.calibration.covariance,
        "residual_mean": predictor.residual.mean,
        "residual_scale": predictor.residual.scale,
        "residual_weights": predictor.residual.weights,
    }
    write_arrays(path.with_suffix(".npz"), arrays)
    described = ProfilePredictorFile(
        robot=predictor.robot,
        noise=predictor.calibration.noise,
        state_spread=predictor.calibration.state_spread,
        interval=predictor.interval,
        residual_gain=predictor.residual.gain,
    )
    write_document(path.with_suffix(".json"), described.model_dump(mode="json"))


def load_profile_predictor(path: str | Path) -> ProfilePredictor:
    """Read a predictor written by `export_profile_predictor`; no code of the file runs.

    Args:
        path: The file, with suffix `.json`, `.npz` or none.

    Raises:
        InputError: A file is missing, truncated or does not hold a profile predictor.
    """
    path = Path(path)
    described = load(ProfilePredictorFile, path.with_suffix(".json"))
    return read_arrays(path.with_suffix(".npz"), partial(_assemble, described))


def _assemble(described: ProfilePredictorFile, arrays: Arrays) -> ProfilePredictor:
    nominal = {name.removeprefix(_NOMINAL): array for name, array in arrays.items() if name.startswith(_NOMINAL)}
    joints, directions = len(nominal["gear_ratio"]), arrays["directions"]
    if directions.ndim != 2 or len(directions) != 10 * joints:
        raise ValueError(f"the inertial directions have shape {directions.shape}")
    size = 3 + 5 * joints + directions.shape[1]
    features = 1 + 5 * joints
    shapes = {"unknowns": (size,), "covariance": (size, size)}
    shapes |= {f"residual_{name}": (features,) for name in ("mean", "scale", "weights")}
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise ValueError(f"the array '{name}' has shape {arrays[name].shape} instead of {shape}")
    residual = Residual(
        arrays["residual_mean"], arrays["residual_scale"], arrays["residual_weights"], described.residual_gain
    )
    calibration = Calibration(arrays["unknowns"], arrays["covariance"], described.noise, described.state_spread, {})
    return ProfilePredictor(described.robot, nominal, directions, calibration, residual, described.interval)
