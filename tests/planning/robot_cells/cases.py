"""The example cell of three robots, its plan, and changes of it, each computed once."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import robojoule
from robojoule.formats.robot_cell import RobotCell
from robojoule.formats.robot_cell_files import read_robot_cell
from robojoule.planning.robot_cells.cell_model import CellWork
from robojoule.planning.robot_cells.plan import RobotCellPlan
from robojoule.planning.robot_cells.solve import Search, plan_robot_cell

LONG_S = 900.0  # searches end by their gap: a busy machine must not cut them
EXAMPLES = Path(robojoule.__file__).parent / "examples"


@cache
def three() -> RobotCell:
    return read_robot_cell(EXAMPLES / "robot_cell.yaml")


@cache
def six() -> RobotCell:
    return read_robot_cell(EXAMPLES / "six_robots.yaml")


@cache
def work_of_three() -> CellWork:
    return CellWork.of(three(), 0.01)


@cache
def plan_of_three() -> RobotCellPlan:
    return plan_robot_cell(three(), time_limit_s=LONG_S)


def with_loader(**changes: object) -> RobotCell:
    """The cell of three robots with another first robot."""
    first, *others = three().robots
    return replace(three(), robots=(replace(first, **changes), *others))


def planned(cell: RobotCell, *, exclusive: bool, time_limit_s: float = LONG_S) -> RobotCellPlan:
    """A plan with or without what robots must keep apart from."""
    return Search(replace(CellWork.of(cell, 0.01), exclusive=exclusive), {}, time_limit_s, 1.0).run()
