"""The parameters of the pipeline (`params.yaml`), validated before any work starts."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from robojoule.documents import Document, load
from robojoule.errors import InputError
from robojoule.robots import list_robots, load_robot, load_robot_file
from robojoule.robots.robot import Payload, Robot

Fraction = Annotated[float, Field(gt=0, lt=1)]
Percent = Annotated[float, Field(gt=0, le=100)]


def _rising(limits_percent: list[float]) -> list[float]:
    if any(b <= a for a, b in pairwise(limits_percent)) or limits_percent[-1] != 100:
        raise ValueError("speed limits must rise strictly and end at 100")
    return limits_percent


def _ordered(budget_rad: tuple[float, float]) -> tuple[float, float]:
    if not 0 < budget_rad[0] <= budget_rad[1]:
        raise ValueError("the budgets must be two positive numbers in rising order")
    return budget_rad


SpeedLimits = Annotated[list[Percent], Field(min_length=5), AfterValidator(_rising)]
Budget = Annotated[tuple[float, float], AfterValidator(_ordered)]


REFERENCE_ROBOT = "kuka_kr16_r2010_2"
"""The thesis's robot: what it says is judged on this one alone."""


class RobotParams(Document):
    """Which robot carries what."""

    name: str = Field(min_length=1, description="Catalog name; a file elsewhere would be no dependency of a stage.")
    payload_kg: float = Field(ge=0, description="Payload mass, up to the rated payload. [kg]")
    payload_com_m: tuple[float, float, float] = Field(description="Centre of mass in the tool frame. [m]")
    payload_inertia_kg_m2: tuple[float, float, float, float, float, float] | None = Field(
        default=None, description="xx, yy, zz, xy, xz, yz about the centre of mass; an aluminium sphere if not given."
    )

    @property
    def is_reference(self) -> bool:
        """Whether it is the thesis's robot."""
        return self.name == REFERENCE_ROBOT

    def carries(self, payload_kg: float) -> bool:
        """Whether the arm is rated for a payload. [kg]"""
        return payload_kg <= load_robot_file(self.name).rated_payload_kg

    def robot(self, payload_kg: float | None = None) -> Robot:
        """The robot with its payload, or with another mass of the same shape in the same place. [kg]"""
        mass_kg, inertia = self.payload_kg if payload_kg is None else payload_kg, None
        if self.payload_inertia_kg_m2 is not None:
            inertia = np.array(self.payload_inertia_kg_m2) * (mass_kg / self.payload_kg if self.payload_kg else 1.0)
        return load_robot(self.name, Payload(mass_kg, self.payload_com_m, inertia))


class GenerateTreesParams(Document):
    """Random operation trees (thesis Algorithm 1)."""

    seed: int = Field(ge=0)
    trees: int = Field(ge=2, description="Trees for training and test.")
    test_fraction: Fraction
    experiment_trees: int = Field(ge=3, description="Trees of the plan experiments, never trained on.")
    points: int = Field(ge=1, le=100, description="Random points per tree.")
    budget_rad: Budget = Field(description="Smallest and largest budget B of joint changes. [rad]")
    use_whole_budget: bool


class SimulateMotionsParams(Document):
    """Runs of every motion in the plant."""

    inverse_dynamics: Literal["pinocchio", "recursion"] = Field(description="What computes joint torques.")
    time_laws: Literal["ruckig", "closed_form"] = Field(description="What computes time laws.")
    speed_limits_percent: SpeedLimits
    sample_rate_hz: float = Field(ge=250, le=8000)
    shard_motions: int = Field(ge=1, description="Motions per shard of the samples.")


class ForestParams(Document):
    """Random forest regressor."""

    n_estimators: int = Field(ge=1)
    min_samples_leaf: int = Field(ge=1)
    max_features: Fraction | Literal[1]


class NeuralNetworkParams(Document):
    """Mean of multi-layer perceptrons that differ in their initial weights."""

    networks: int = Field(ge=1, le=100)
    hidden_layers: list[Annotated[int, Field(ge=1)]] = Field(min_length=1)
    alpha: float = Field(ge=0)
    learning_rate: float = Field(gt=0)
    max_epochs: int = Field(ge=1)


class TrainProfilePredictorParams(Document):
    """Predictor of whole profiles."""

    training_trees: int = Field(ge=1, description="Trees it is fitted to, spread over the training trees.")
    runs_per_motion: int = Field(ge=2, description="Measured runs of each motion that it is fitted to.")


class TrainPredictorsParams(Document):
    """Predictors of the energy profile's parameters (thesis 5.2)."""

    seed: int = Field(ge=0)
    random_forest: ForestParams
    neural_network: NeuralNetworkParams


class ThreeSegmentParams(Document):
    """The thesis's three-segment profile (Eq. 5.2-5.4)."""

    left_fraction: Fraction
    right_fraction: Fraction
    offset_j: float = Field(gt=0)


class EvaluatePlansParams(Document):
    """Plans of the experiment trees and their re-simulation."""

    relaxations_percent: list[Annotated[float, Field(ge=100, le=1000)]] = Field(
        min_length=1, description="Cycle times as shares of the least one. [%]"
    )
    krc_segments: list[Annotated[int, Field(ge=1, le=100)]] = Field(min_length=1)
    krc_slowest_percent: Percent = Field(description="Slowest of the five profiling runs of `krc_polynomial`.")
    three_segment: ThreeSegmentParams
    predicted_speed_limits: int = Field(ge=10, description="Speed limits at which a profile is predicted.")
    dense_speed_limits: int = Field(ge=90, description="Speed limits of the densely simulated profile.")
    payload_sensitivity_kg: list[Annotated[float, Field(ge=0)]] = Field(
        description="Payloads that are compared; those above the robot's rating are left out. [kg]"
    )

    @model_validator(mode="after")
    def _no_repetition(self) -> EvaluatePlansParams:
        for key in ("relaxations_percent", "krc_segments", "payload_sensitivity_kg"):
            values = getattr(self, key)
            if len(set(values)) != len(values):
                raise ValueError(f"evaluate_plans.{key} must not repeat a value")
        return self


class DrawFiguresParams(Document):
    """Style of the figures."""

    width_in: float = Field(gt=0, le=30)
    dpi: int = Field(ge=50, le=600)
    colormap: str


class Params(Document):
    """All parameters of the pipeline."""

    robot: RobotParams
    generate_trees: GenerateTreesParams
    simulate_motions: SimulateMotionsParams
    train_profile_predictor: TrainProfilePredictorParams
    train_predictors: TrainPredictorsParams
    evaluate_plans: EvaluatePlansParams
    draw_figures: DrawFiguresParams

    @model_validator(mode="after")
    def _robot_carries_its_payloads(self) -> Params:
        if self.robot.name not in list_robots():
            raise InputError(
                f"'{self.robot.name}' is not in the catalog (a file of your own belongs into its folder first)",
                key="robot.name",
                allowed=", ".join(list_robots()),
            )
        load_robot_file(self.robot.name).check_payload(self.robot.payload_kg, key="robot.payload_kg")
        return self


def load_params(path: str | Path = "params.yaml") -> Params:
    """Read and validate the parameter file.

    Raises:
        InputError: Unknown, missing or out-of-range key; a robot that is not in the catalog; unreadable file.
    """
    return load(Params, path)
