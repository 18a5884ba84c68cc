"""Motions by the controller that measured runs of them show, where they show one."""

from __future__ import annotations

from robojoule.calibration.run_table import MeasuredRuns
from robojoule.calibration.timing import identify_timing
from robojoule.planning.batch import TreeBatch


def with_learnt_timing(batch: TreeBatch, runs: MeasuredRuns) -> tuple[TreeBatch, tuple[str, ...]]:
    """The same trees by the timing that runs show, and what to know about it, a sentence each.

    Where no rule explains the runs, or none better than the entry, the entry's own timing stays, as in robot files.

    Args:
        batch: The one tree.
        runs: Measured runs of its moves.

    Raises:
        InputError: Runs of too few motions, or that cannot be of them.
    """
    found = identify_timing(batch.paths, runs)
    if not found.is_good:
        return batch, found.warnings
    robot = batch.robot.variant(controller=found.controller)
    return TreeBatch(robot, batch.trees, batch.slowest_speed_limit), found.warnings
