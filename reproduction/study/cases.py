"""Trees of a study with their plant, and what is observed on them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reproduction.study.config import StudyMotionsParams
from reproduction.study.plant import Plant, PlantPaths
from reproduction.trees.generate import generate_configurations
from robojoule.arrays import Array
from robojoule.calibration.run_model import ObservedRuns
from robojoule.planning.batch import TreeBatch
from robojoule.programs.operation_tree import OperationTree, tree_from_configurations
from robojoule.robots.collision import CollisionModel
from robojoule.robots.robot import Robot


class PlantBatch(TreeBatch):
    """Trees that the nominal controller plans and the plant executes, each tree at its own temperature.

    Args:
        nominal: Catalog entry with its payload.
        trees: Operation trees.
        plant: The plant.
        viscosity: Factor on viscous friction of each tree, shape (T,). [-]
        slowest_speed_limit: Least speed limit of a plan. [-]
    """

    def __init__(
        self,
        nominal: Robot,
        trees: Sequence[OperationTree],
        plant: Plant,
        viscosity: Array,
        slowest_speed_limit: float,
    ) -> None:
        super().__init__(nominal, trees, slowest_speed_limit)
        self.plant = plant
        self.nominal_paths = self.paths
        lengths = [rows.stop - rows.start for rows in self.rows]
        self.tree_of_motion: NDArray[np.intp] = np.repeat(np.arange(len(self.rows)), lengths)
        self.viscosity = viscosity
        self.paths = PlantPaths(plant, self.nominal_paths, self.tree_of_motion, viscosity)

    @cached_property
    def oracle_paths(self) -> PlantPaths:
        """The plant at mean temperature: what one could know at best without a look at the hidden state."""
        return PlantPaths(self.plant, self.nominal_paths)


def generate_trees(
    robot: Robot, seed: np.random.SeedSequence, count: int, params: StudyMotionsParams
) -> list[OperationTree]:
    """Random trees (thesis Algorithm 1) with budgets spread evenly over their range.

    Args:
        robot: Robot.
        seed: Seed of all trees.
        count: Number of trees.
        params: Points and budgets.
    """
    configurations = generate_configurations(
        robot,
        CollisionModel(robot),
        seed=seed,
        budgets_rad=np.random.default_rng(seed).permutation(np.linspace(*params.budget_rad, count)),
        points=params.points,
    )
    return [
        tree_from_configurations(f"study-{number:03d}", found, robot.name)
        for number, (found, _) in enumerate(configurations, start=1)
    ]


def speed_limits(params: StudyMotionsParams) -> Array:
    """Speed limits of observed runs, fractions, shape (S,)."""
    return np.array(params.speed_limits_percent) / 100.0


def observe(
    batch: PlantBatch,
    speed_limits: ArrayLike,
    rng: np.random.Generator,
    first_tree: int = 0,
) -> ObservedRuns:
    """Observed runs and idle powers of all motions, with noise.

    Args:
        batch: Trees on their plant.
        speed_limits: Speed limits of the runs, shape (S,), fractions.
        rng: Source of the noise.
        first_tree: Number of the first tree: trees of one fit need numbers of their own.
    """
    limits = np.broadcast_to(np.asarray(speed_limits, dtype=float), (batch.paths.motions, np.size(speed_limits)))
    noise = batch.plant.params.noise
    runs = batch.paths.simulate(limits)
    energy = runs.energy_j * (1.0 + noise * rng.standard_normal(runs.energy_j.shape))
    idle = np.stack([batch.idle_prior_w, batch.idle_post_w], axis=1)
    idle = idle * (1.0 + noise * rng.standard_normal(idle.shape))
    return ObservedRuns(batch.nominal_paths, limits.copy(), energy, idle, batch.tree_of_motion + first_tree)
