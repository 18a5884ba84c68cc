"""The sets of trees: for learning, split into training and test by whole trees, and for the plan experiments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice

import numpy as np
import pyarrow as pa
from numpy.typing import ArrayLike

from reproduction.config import GenerateTreesParams
from reproduction.trees.generate import generate_configurations, joint_travel_rad
from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.robots.collision import CollisionModel
from robojoule.robots.robot import Robot

EXPERIMENT = "experiment"
COMPLEXITIES = ("simple", "medium", "complex")
_PROGRESS_LINES = 20


@dataclass(frozen=True, eq=False)
class DrawnTree:
    """A random tree and the set it belongs to.

    Attributes:
        tree_id: Its split and number in it.
        split: train, test or experiment.
        complexity: One of `COMPLEXITIES`.
        budget_rad: Budget B of joint changes. [rad]
        configurations_rad: Start and all targets, shape (points, n). [rad]
    """

    tree_id: str
    split: str
    complexity: str
    budget_rad: float
    configurations_rad: Array


def draw_trees(robot: Robot, settings: GenerateTreesParams, progress: Callable[[str], None]) -> list[DrawnTree]:
    """Draw all trees, first those for learning; in both sets the budgets are spread evenly over their range.

    Args:
        robot: Robot with its payload.
        settings: Numbers of trees, points, budgets and seed.
        progress: Called with a line of text now and then.

    Raises:
        InputError: No collision-free point is found.
    """
    trees_seed, experiment_seed, split_seed = np.random.SeedSequence(settings.seed).spawn(3)
    counts = settings.trees, settings.experiment_trees
    budgets = [np.linspace(*settings.budget_rad, count) for count in counts]
    drawn = _with_progress(
        chain.from_iterable(
            _draw(robot, settings, seed, of_set)
            for seed, of_set in zip((trees_seed, experiment_seed), budgets, strict=True)
        ),
        sum(counts),
        settings.points,
        progress,
    )
    learning, experiment = (list(islice(drawn, count)) for count in counts)
    splits = split_by_tree(np.random.default_rng(split_seed), settings.trees, settings.test_fraction)
    splits += [EXPERIMENT] * settings.experiment_trees
    complexities = [
        kind for found in (learning, experiment) for kind in complexity_terciles(list(map(joint_travel_rad, found)))
    ]
    numbers = {"train": 0, "test": 0, EXPERIMENT: 0}
    trees = []
    rows = zip(splits, complexities, np.concatenate(budgets).tolist(), [*learning, *experiment], strict=True)
    for split, complexity, budget, configurations in rows:
        numbers[split] += 1
        tree_id = f"{split}-{numbers[split]:0{2 if split == EXPERIMENT else 3}d}"
        trees.append(DrawnTree(tree_id, split, complexity, budget, configurations))
    return trees


def _draw(
    robot: Robot, settings: GenerateTreesParams, seed: np.random.SeedSequence, budgets_rad: Array
) -> Iterator[tuple[Array, int]]:
    """Configurations of one set's trees, each with the number of its draws."""
    try:
        yield from generate_configurations(
            robot,
            CollisionModel(robot),
            seed=seed,
            budgets_rad=budgets_rad,
            points=settings.points,
            use_whole_budget=settings.use_whole_budget,
        )
    except InputError as error:
        key = f"generate_trees.{error.key}" if error.key else None
        raise InputError(error.problem, key=key, allowed=error.allowed) from None


def _with_progress(
    drawn: Iterable[tuple[Array, int]], total: int, points: int, progress: Callable[[str], None]
) -> Iterator[Array]:
    draws = 0
    for done, (configurations, more) in enumerate(drawn, start=1):
        draws += more
        if done * _PROGRESS_LINES // total != (done - 1) * _PROGRESS_LINES // total:
            progress(f"{done} of {total} trees, {100 * done * points / draws:.0f} % of the drawn points are free")
        yield configurations


def split_by_tree(rng: np.random.Generator, trees: int, test_fraction: float) -> list[str]:
    """Assign whole trees to "train" or "test" at random; at least one tree each."""
    tests = min(max(1, round(trees * test_fraction)), trees - 1)
    chosen = set(rng.permutation(trees)[:tests].tolist())
    return ["test" if index in chosen else "train" for index in range(trees)]


def complexity_terciles(joint_travels_rad: ArrayLike) -> list[str]:
    """Sort trees into thirds of equal size by their summed joint travel, shape (T,). [rad]"""
    travels = np.asarray(joint_travels_rad, dtype=float)
    ranks = np.empty(len(travels), dtype=int)
    ranks[np.argsort(travels, kind="stable")] = np.arange(len(travels))
    return [COMPLEXITIES[int(rank) * 3 // len(travels)] for rank in ranks]


def trees_table(trees: Sequence[DrawnTree]) -> pa.Table:
    """Table of all trees, one row per point: `data/trees.parquet`."""
    points = [len(tree.configurations_rad) for tree in trees]
    configurations = np.concatenate([tree.configurations_rad for tree in trees])

    def repeated(name: str) -> list[object]:
        return [value for tree, count in zip(trees, points, strict=True) for value in [getattr(tree, name)] * count]

    columns: dict[str, pa.Array] = {
        **{name: pa.array(repeated(name)) for name in ("tree_id", "split", "complexity", "budget_rad")},
        "point": pa.array(np.concatenate([np.arange(count, dtype=np.int32) for count in points])),
    }
    joints = {f"q{joint + 1}_rad": pa.array(values) for joint, values in enumerate(configurations.T.copy())}
    return pa.table(columns | joints)
