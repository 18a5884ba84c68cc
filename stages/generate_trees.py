"""Random operation trees for training, test and the plan experiments (thesis 4.1 and 6.1)."""

from __future__ import annotations

import pyarrow.parquet as pq

from reproduction.config import Params, load_params
from reproduction.layout import Layout
from reproduction.trees.sets import EXPERIMENT, draw_trees, trees_table
from robojoule.documents import all_or_none, atomic_path
from robojoule.formats.tree_files import save_tree
from robojoule.programs.operation_tree import tree_from_configurations
from stages.cli import run, say


def generate_trees(params: Params, layout: Layout) -> None:
    """Write data/trees.parquet and the experiment trees as operation-tree files."""
    robot = params.robot.robot()
    trees = draw_trees(robot, params.generate_trees, say("generate_trees"))
    chosen = {layout.trees_dir / f"{tree.tree_id}.yaml": tree for tree in trees if tree.split == EXPERIMENT}
    with all_or_none():
        for path, tree in chosen.items():
            save_tree(tree_from_configurations(tree.tree_id, tree.configurations_rad, robot.name), path)
    for stale in set(layout.trees_dir.glob(f"{EXPERIMENT}-*.yaml")) - set(chosen):
        stale.unlink()
    with atomic_path(layout.trees) as path:
        pq.write_table(trees_table(trees), path)


if __name__ == "__main__":
    run(generate_trees, load_params)
