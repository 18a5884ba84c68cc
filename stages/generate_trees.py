"""Random operation trees for training, test and the plan experiments (thesis 4.1 and 6.1)."""

from __future__ import annotations

import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import ArrayLike

from reproduction.config import Params
from reproduction.trees.generate import generate_configurations, joint_travel_rad
from robojoule.documents import atomic_path
from robojoule.errors import InputError
from robojoule.formats.tree_files import save_tree
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots.collision import CollisionModel
from stages._cli import run
from stages.layout import Layout

COMPLEXITIES = ("simple", "medium", "complex")
_PROGRESS_LINES = 20


def generate_trees(params: Params, layout: Layout) -> None:
    """Write data/trees.parquet and the experiment trees as operation-tree files."""
    settings = params.generate_trees
    robot = params.robot.robot()
    collisions = CollisionModel(robot)
    trees_seed, experiment_seed, split_seed = np.random.SeedSequence(settings.seed).spawn(3)
    groups = {
        "learning": (trees_seed, np.linspace(*settings.budget_rad, settings.trees)),
        "experiment": (experiment_seed, np.linspace(*settings.budget_rad, settings.experiment_trees)),
    }
    total = settings.trees + settings.experiment_trees
    done, draws = 0, 0
    configurations: dict[str, list[np.ndarray]] = {"learning": [], "experiment": []}
    try:
        for group, (seed, budgets) in groups.items():
            for found, tree_draws in generate_configurations(
                robot,
                collisions,
                seed=seed,
                budgets_rad=budgets,
                points=settings.points,
                use_whole_budget=settings.use_whole_budget,
            ):
                configurations[group].append(found)
                done, draws = done + 1, draws + tree_draws
                if done * _PROGRESS_LINES // total != (done - 1) * _PROGRESS_LINES // total:
                    accepted = 100 * done * settings.points / draws
                    print(f"generate_trees: {done} of {total} trees, {accepted:.0f} % of the drawn points are free")
                    sys.stdout.flush()
    except InputError as error:
        key = f"generate_trees.{error.key}" if error.key else None
        raise InputError(error.problem, key=key, allowed=error.allowed) from None

    splits = split_by_tree(np.random.default_rng(split_seed), settings.trees, settings.test_fraction)
    rows: list[pa.Table] = []
    numbers = {"train": 0, "test": 0, "experiment": 0}
    for group, (_, budgets) in groups.items():
        found_here = configurations[group]
        complexities = complexity_terciles([joint_travel_rad(found) for found in found_here])
        for index, found in enumerate(found_here):
            split = splits[index] if group == "learning" else "experiment"
            numbers[split] += 1
            tree_id = f"{split}-{numbers[split]:0{2 if split == 'experiment' else 3}d}"
            rows.append(_rows(tree_id, split, complexities[index], float(budgets[index]), found))
    layout.trees_dir.mkdir(parents=True, exist_ok=True)
    for stale in layout.trees_dir.glob("experiment-*.yaml"):
        stale.unlink()
    for number, found in enumerate(configurations["experiment"], start=1):
        tree_id = f"experiment-{number:02d}"
        save_tree(tree_from_configurations(tree_id, found, robot.name), layout.trees_dir / f"{tree_id}.yaml")
    with atomic_path(layout.trees) as temporary:
        pq.write_table(pa.concat_tables(rows).combine_chunks(), temporary)


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


def _rows(tree_id: str, split: str, complexity: str, budget_rad: float, configurations_rad: np.ndarray) -> pa.Table:
    count, joints = configurations_rad.shape
    columns: dict[str, pa.Array] = {
        "tree_id": pa.array([tree_id] * count),
        "split": pa.array([split] * count),
        "complexity": pa.array([complexity] * count),
        "budget_rad": pa.array(np.full(count, budget_rad)),
        "point": pa.array(np.arange(count, dtype=np.int32)),
    }
    for joint in range(joints):
        columns[f"q{joint + 1}_rad"] = pa.array(configurations_rad[:, joint])
    return pa.table(columns)


def main() -> None:
    """Run the stage from the command line."""
    run(generate_trees)


if __name__ == "__main__":
    main()
