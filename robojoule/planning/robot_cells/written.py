"""Plans of cells written back: a program for each robot, and when it starts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from robojoule.formats.program import Program
from robojoule.planning.batch import percent_of
from robojoule.planning.cells.plan import CellPlan
from robojoule.planning.robot_cells.cell_model import CellWork
from robojoule.planning.robot_cells.speeds import Runs
from robojoule.planning.robot_cells.work import RobotWork
from robojoule.programs.tree_check import with_angles

_DIGITS = 9  # of written waits: robots must not drift apart


def written_programs(work: CellWork, runs: Runs, plan: CellPlan) -> tuple[tuple[Program, ...], tuple[float, ...]]:
    """A program for each robot with its targets, speed limits and waits of a plan.

    Args:
        work: The cell.
        runs: The runs that the plan chose from.
        plan: The plan.

    Returns:
        The programs; when each of them starts, the earliest at 0. [s]
    """
    made = [_written(robot, runs, plan) for robot in work.works]
    earliest = min(start for _, start in made)
    return tuple(program for program, _ in made), tuple(start - earliest for _, start in made)


def _written(robot: RobotWork, runs: Runs, plan: CellPlan) -> tuple[Program, float]:
    steps = {step.activity: step for step in plan.steps if step.robot == robot.name}
    settings: dict[str, dict[str, Any]] = {move.name: {} for move in robot.moves}
    raw = robot.placed.program.tree.configurations_rad()
    targets = []
    for i, move in enumerate(robot.moves):
        step = steps[robot.activity(i)]
        key = (step.activity, step.option)
        pose = robot.motions[runs.rows[key]].end
        found = robot.placed.alternatives.get(move.name)
        chosen = found is not None and pose in found.poses_rad
        targets.append(found.poses_rad[pose] if found is not None and chosen else tuple(raw[i + 1].tolist()))
        settings[move.name]["speed_limit_percent"] = percent_of(runs.speed_limits[key], move.speed_limit_percent)
        standing = robot.standstills[i]
        added = max(steps[standing.name].duration_s - standing.least_s, 0.0)
        following = robot.moves[(i + 1) % len(robot.moves)]
        settings[following.name]["added_wait_before_s"] = round(added, _DIGITS)
    tree = robot.placed.program.tree.without_plan().with_settings(settings)
    tree = tree.planned_for(plan.cycle_time_s)
    program = replace(robot.placed.program, tree=with_angles(tree, tree.angles, np.array([raw[0], *targets])))
    first = robot.moves[0]
    before = sum(robot.before_s.values()) + first.wait_before_s + settings[first.name]["added_wait_before_s"]
    return program, steps[robot.activity(0)].start_s - before
