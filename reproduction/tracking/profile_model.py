"""The profile predictor as MLflow loads it: from code and plain arrays, without pickle."""

from __future__ import annotations

from typing import Any

import mlflow
import numpy as np
import pandas as pd

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
        """
        names = ["duration_s", "energy_j", "lower_j", "upper_j"]
        result = pd.DataFrame(index=model_input.index, columns=names, dtype=float)
        for payload_kg, rows in model_input.groupby("payload_kg"):
            robot = load_robot(self.predictor.robot, Payload(float(payload_kg)))
            start, end = (
                rows[[f"{side}_q{joint + 1}_rad" for joint in range(robot.joint_count)]].to_numpy(dtype=float)
                for side in ("start", "end")
            )
            limits = rows["speed_limit_percent"].to_numpy(dtype=float)[:, None] / 100.0
            predicted = self.predictor.predict(MotionPaths(robot, start, end), limits)
            columns = [getattr(predicted, name)[:, 0] for name in names]
            result.loc[rows.index] = np.stack(columns, axis=1)
        return result


mlflow.models.set_model(ProfileModel())
