"""Parameters of the studies (`studies/params.yaml`)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from reproduction.config import Budget, ForestParams, Percent, SpeedLimits
from reproduction.study.closed_loop_config import CloseTheLoopParams
from reproduction.study.plant import PlantParams
from robojoule.documents import Document, load

Count = Annotated[int, Field(ge=1)]
Kilograms = Annotated[float, Field(ge=0)]


class StudyMotionsParams(Document):
    """Trees, runs and cycle times of every study."""

    seed: int = Field(ge=0)
    payload_com_m: tuple[float, float, float] = Field(description="Centre of mass of payloads in the tool frame. [m]")
    points: int = Field(ge=1, le=20, description="Random points per tree.")
    budget_rad: Budget = Field(description="Smallest and largest budget of joint changes. [rad]")
    speed_limits_percent: SpeedLimits = Field(description="Speed limits of observed runs.")
    runs_per_motion: int = Field(
        ge=2, description="Observed runs of each motion that the physics-informed model reads."
    )
    krc_slowest_percent: Percent = Field(description="Slowest of the five profiling runs of `krc_polynomial`.")
    predicted_speed_limits: int = Field(ge=10, description="Speed limits at which a profile is predicted.")
    fine_speed_limits: int = Field(ge=10, description="Speed limits of the fine grid on which predictions are judged.")
    dense_speed_limits: int = Field(ge=30, description="Speed limits of the true profiles before refinement.")
    relaxations_percent: list[Annotated[float, Field(ge=100, le=1000)]] = Field(
        min_length=1, description="Cycle times as shares of the least one. [%]"
    )


class ComparePredictorsParams(Document):
    """Nested cross-validation by tree of all predictors."""

    robot: str
    payload_kg: Kilograms
    trees: int = Field(ge=10)
    outer_folds: int = Field(ge=2)
    inner_folds: int = Field(ge=2)
    shallow_samples: int = Field(ge=50, lt=800, description="Training samples of the shallow network.")


class EvaluateMotionsParams(Document):
    """Regime (a), same robot, new motions, and regime (b), a payload never trained on."""

    robot: str
    payloads_kg: list[Kilograms] = Field(min_length=2)
    training_trees: Count
    test_trees: Count
    unseen_payloads_kg: list[Kilograms] = Field(min_length=2)
    unseen_training_trees: Count
    unseen_test_trees: Count
    random_forest: ForestParams = Field(description="The thesis's predictor.")


class EvaluateRobotsParams(Document):
    """Regime (c): leave one robot out over the catalog."""

    payload_share: float = Field(gt=0, le=1, description="Payload over the rated one. [-]")
    training_trees: Count
    test_trees: Count
    measured_motions: list[Annotated[int, Field(ge=0)]] = Field(min_length=1)


class StudyParams(Document):
    """All parameters of the studies."""

    plant: PlantParams
    motions: StudyMotionsParams
    compare_predictors: ComparePredictorsParams
    evaluate_motions: EvaluateMotionsParams
    evaluate_robots: EvaluateRobotsParams
    close_the_loop: CloseTheLoopParams


def load_study_params(path: str | Path = "studies/params.yaml") -> StudyParams:
    """Read and validate the parameters of the studies.

    Raises:
        InputError: Unknown, missing or out-of-range key; unreadable file.
    """
    return load(StudyParams, path)
