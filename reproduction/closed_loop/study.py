"""The study on hidden machines: all machines, trees, cycle times and noise draws, and what became of their plans."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reproduction.closed_loop.machines import hidden_machines
from reproduction.closed_loop.trials import TreeOfMachine, Trial
from reproduction.parts import HERE, Parts
from reproduction.study.cases import generate_trees
from reproduction.study.config import CloseTheLoopParams, StudyMotionsParams
from reproduction.tables import Row
from robojoule.arrays import Array
from robojoule.calibration.run_model import body_directions
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.measured import Measurement
from robojoule.robots import load_robot
from robojoule.robots.robot import Payload, Robot

TRACE, STOPWATCH = "trace", "stopwatch"


def closed_loop_cases(
    params: CloseTheLoopParams, motions: StudyMotionsParams, progress: Callable[[str], None], parts: Parts = HERE
) -> list[Row]:
    """Every plan of the study: a row for each machine, tree, cycle time, look, draw and trial.

    Args:
        params: Machines, trials.
        motions: Trees of the studies.
        progress: Takes a line when a tree is done.
        parts: Where the trees are computed and kept.
    """
    robot = load_robot(params.robot, Payload(params.payload_kg, motions.payload_com_m))
    seed = np.random.SeedSequence([params.seed, 0])
    trees = [tree.configurations_rad() for tree in generate_trees(robot, seed, params.trees, motions)]
    tasks = [
        (params, motions.payload_com_m, place, number, tree)
        for place, _ in enumerate(_names(robot, params))
        for number, tree in enumerate(trees)
    ]
    found = parts.map(
        closed_loop_tree, tasks, lambda _, rows: progress(f"{rows[0]['machine']}, tree {rows[0]['tree']}")
    )
    return [row for rows in found for row in rows]


def _names(robot: Robot, params: CloseTheLoopParams) -> list[str]:
    return [machine.name for machine in hidden_machines(robot, params.machines, params.seed)]


def closed_loop_tree(
    params: CloseTheLoopParams, center: tuple[float, float, float], place: int, number: int, points: Array
) -> list[Row]:
    """All plans of one tree on one machine."""
    robot = load_robot(params.robot, Payload(params.payload_kg, center))
    machine = list(hidden_machines(robot, params.machines, params.seed))[place]
    paths = MotionPaths(robot, points[:-1], points[1:])
    key: Row = {"machine": machine.name, "inside": machine.inside, "tree": number + 1}
    tree = TreeOfMachine(
        paths, Measurement(paths, body_directions(robot)), machine.table(robot, points[:-1], points[1:]), key
    )
    reserve = params.reserve_percent / 100.0
    rows: list[Row] = []
    for look, trial in (
        (TRACE, Trial(params.stamp_s, params.energy_noise, params.noise_draws, reserve)),
        (STOPWATCH, Trial(params.stopwatch_s, params.energy_noise, params.stopwatch_draws, reserve)),
    ):
        for time, percent in enumerate(params.cycle_times_percent):
            rng = np.random.default_rng([params.seed, 2, place, number, time, len(look)])
            rows += [{"look": look} | row for row in tree.cases(percent, trial, rng)]
    return rows
