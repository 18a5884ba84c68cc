"""A simulated cell in the form in which plans of cells are drawn."""

from __future__ import annotations

from robojoule.formats.robot_cell import RobotCell, move_before
from robojoule.planning.cells.plan import CellPlan, Step
from robojoule.planning.robot_cells.cell_run import CellRun
from robojoule.planning.robot_cells.work import MOTORS
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.programs.cell import (
    Cell,
    CellRobot,
    DynamicActivity,
    Handover,
    Location,
    Movement,
    PowerMode,
    StaticActivity,
)


def as_drawn(cell: RobotCell, run: CellRun) -> tuple[Cell, CellPlan]:
    """A cell in which everything is as it was simulated, and its plan."""
    robots = []
    for one in cell.robots:
        modes = (MOTORS, *(mode.name for mode in one.robot.standby))
        steps = [step for step in run.steps if step.robot == one.name]
        moving, standing = steps[::2], steps[1::2]
        static = tuple(_static(step, modes) for step in standing)
        dynamic = tuple(
            DynamicActivity(step.activity, standing[i - 1].activity, standing[i].activity, (_movement(step),))
            for i, step in enumerate(moving)
        )
        robots.append(
            CellRobot(one.name, tuple(PowerMode(m, 0.0, m) for m in modes), static, dynamic, standing[-1].activity)
        )
    stands = {(step.robot, step.activity): step for step in run.steps if step.mode is not None}
    handovers = []
    for handover in cell.handovers:
        ends = [_standing(cell, place.robot, place.operation) for place in (handover.first, handover.second)]
        if all(end in stands for end in ends):
            handovers.append(Handover(ends[0][1], ends[1][1], (("there", "there"),)))
    plan = CellPlan(run.cell, run.cycle_time_s, run.steps, "simulated", run.energy_j)
    return Cell(run.cell, run.cycle_time_s, tuple(robots), (), tuple(handovers)), plan


def _static(step: Step, modes: tuple[str, ...]) -> StaticActivity:
    power = step.energy_j / step.duration_s if step.duration_s > 0.0 else 0.0
    place = Location("there", dict.fromkeys(modes, power))
    return StaticActivity(step.activity, 0.0, step.duration_s, (place,))


def _movement(step: Step) -> Movement:
    profile = PiecewiseLinearProfile([step.duration_s], [step.energy_j])  # type: ignore[arg-type]
    return Movement(step.option, "there", "there", profile)


def _standing(cell: RobotCell, robot: str, operation: str) -> tuple[str, str]:
    return robot, f"{robot}: {move_before(cell.robot(robot).program, operation)} (standing)"
