"""Parameters of the studies (`studies/params.yaml`)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from reproduction.config import Budget, ForestParams, Percent, SpeedLimits
from reproduction.study.plant import PlantParams
from robojoule.documents import Document, load

Count = Annotated[int, Field(ge=1)]
Kilograms = Annotated[float, Field(ge=0)]
Range = tuple[float, float]


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

    robots: list[str] | None = Field(default=None, min_length=2, description="Catalog names; all if not given.")
    payload_share: float = Field(gt=0, le=1, description="Payload over the rated one. [-]")
    training_trees: Count
    test_trees: Count
    measured_motions: list[Annotated[int, Field(ge=0)]] = Field(min_length=1)


class MachineRanges(Document):
    """Ranges that the figures of hidden machines are drawn from, uniformly."""

    ramp_s: Range = Field(description="Velocity over acceleration limit of joints, from the wrist to the base. [s]")
    filter_s: Range = Field(description="Filter time of controllers with joint accelerations. [s]")
    slower: Range = Field(description="Velocity limits of the slower controller over the nominal ones. [-]")
    filter_factor: Range = Field(description="Filter time of another one over the nominal one. [-]")
    scaled_exponent: Range = Field(description="Power of the limit by which another one scales accelerations. [-]")
    odd_step_s: float = Field(gt=0, description="Step to which durations of the odd machine are rounded up. [s]")
    odd_dead_s: float = Field(ge=0, description="What each of its motions takes beyond that. [s]")
    direction: Range = Field(description="Acceleration limits of the other direction, asymmetric machine. [-]")
    filter_growth: Range = Field(description="Its filter time at full speed over that at none. [-]")
    dead_s: Range = Field(description="Its dead time. [s]")
    jitter_s: float = Field(ge=0, description="Standard deviation of durations of the machine that jitters. [s]")
    payload: Range = Field(description="Payload of plants that differ over the nominal one. [-]")
    friction: Range = Field(description="Their Coulomb and viscous friction over the nominal one, joint by joint. [-]")
    load_friction: Range = Field(description="Their friction over transmitted torque. [-]")


class CloseTheLoopParams(Document):
    """Hidden machines, trees, trials."""

    seed: int = Field(ge=0)
    robot: str
    payload_kg: float = Field(ge=0)
    trees: Count
    cycle_times_percent: list[Annotated[float, Field(ge=100, le=1000)]] = Field(min_length=1)
    noise_draws: Count
    stamp_s: float = Field(gt=0, description="Resolution of a trace's stamps. [s]")
    energy_noise: float = Field(ge=0, description="Of a motion's measured energy. [-]")
    stopwatch_s: float = Field(gt=0, description="Resolution of a stopwatch. [s]")
    stopwatch_draws: Count
    reserve_percent: float = Field(ge=0, lt=100)
    machines: MachineRanges


class PlanCellsParams(Document):
    """Cells of robots, planned by several methods."""

    cells: list[str] = Field(min_length=1, description="Files among the examples of the library.")
    cycle_times_percent: list[Annotated[float, Field(ge=100, le=1000)]] = Field(
        min_length=1, description="Of the cycle time of the file. [%]"
    )
    gap_percent: float = Field(gt=0, le=10, description="Proven gap at which a search ends. [%]")
    time_limit_s: float = Field(gt=0, description="When it ends at the latest: none of the committed ones did. [s]")
    seed: int = Field(ge=0)


class StudyParams(Document):
    """All parameters of the studies."""

    plant: PlantParams
    motions: StudyMotionsParams
    compare_predictors: ComparePredictorsParams
    evaluate_motions: EvaluateMotionsParams
    evaluate_robots: EvaluateRobotsParams
    close_the_loop: CloseTheLoopParams
    plan_cells: PlanCellsParams


def load_study_params(path: str | Path = "studies/params.yaml") -> StudyParams:
    """Read and validate the parameters of the studies.

    Raises:
        InputError: Unknown, missing or out-of-range key; unreadable file.
    """
    return load(StudyParams, path)
