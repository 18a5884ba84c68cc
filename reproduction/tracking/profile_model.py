"""The profile predictor as MLflow loads it: from code and plain arrays, without pickle."""

from __future__ import annotations

from typing import Any

import mlflow
import numpy as np
import pandas as pd

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.predictor_file import load_profile_predictor
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload


class ProfileModel(mlflow.pyfunc.PythonModel):  # type: ignore[misc]
    """Predicts duration, energy and its interval of single runs."""

    def load_context(self, context: Any) -> None:
        """Read the predictor that was logged."""
        self.predictor = load_profile_predictor(context.artifacts["predictor"])

    # No type hint on the input: MLflow would take it for a schema, which the logged signature already is.
    def predict(self, context: Any, model_input, params: dict[str, Any] | None = None) -> pd.DataFrame:  # type: ignore
        """Predict runs.

        Args:
            context: Not used.
            model_input: Columns payload_kg, speed_limit_percent, start_q1_rad .., end_q1_rad ..; one row per run.
            params: Not used.

        Returns:
            A row for each of those of the input, with its index.

        Raises:
            InputError: A number is missing or not finite, or the robot cannot carry a payload.
        """
        names = ["duration_s", "energy_j", "lower_j", "upper_j"]
        payloads = _finite(model_input, ["payload_kg"])[:, 0]
        limits = _finite(model_input, ["speed_limit_percent"]) / 100.0
        result = np.empty((len(model_input), len(names)))
        for payload_kg in np.unique(payloads).tolist():  # by place: whoever asks may give two rows the same index
            places = np.flatnonzero(payloads == payload_kg)
            robot = load_robot(self.predictor.robot, Payload(payload_kg))
            start, end = (
                _finite(model_input, [f"{side}_q{joint + 1}_rad" for joint in range(robot.joint_count)])[places]
                for side in ("start", "end")
            )
            predicted = self.predictor.predict(MotionPaths(robot, start, end), limits[places])
            result[places] = np.stack([getattr(predicted, name)[:, 0] for name in names], axis=1)
        return pd.DataFrame(result, index=model_input.index, columns=names)


def _finite(frame: pd.DataFrame, names: list[str]) -> Array:
    """Columns as numbers, shape (rows, columns)."""
    values: Array = frame[names].to_numpy(dtype=float)
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = bad[0].tolist()
        raise InputError(f"row {row + 1} holds {values[row, column]}", key=names[column], allowed="finite numbers")
    return values


mlflow.models.set_model(ProfileModel())
