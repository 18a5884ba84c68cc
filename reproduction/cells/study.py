"""Savings of plans of whole cells by speeds, brakes and all power modes, against two cells that nobody has planned.

Both baselines run every move at full speed and wait where that costs least; one waits with motors on, the other closes
the brakes. Every plan is simulated with all robots together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from typing import Any

from reproduction.parts import HERE, Parts
from reproduction.study.config import PlanCellsParams
from robojoule.formats.robot_cell import PlacedRobot, RobotCell
from robojoule.formats.robot_cell_files import read_robot_cell
from robojoule.planning.robot_cells.plan import RobotCellPlan
from robojoule.planning.robot_cells.solve import plan_robot_cell
from robojoule.robots.robot import Robot
from robojoule.robots.standby import StandbyFile

MOTORS_ON, BRAKES_ON = "full_speed_motors_on", "full_speed_brakes"
# Method: whether speeds are planned, and which standby modes controllers have.
METHODS: dict[str, tuple[bool, tuple[str, ...]]] = {
    MOTORS_ON: (False, ()),
    BRAKES_ON: (False, ("brakes",)),
    "modes_alone": (False, ("brakes", "bus_off")),
    "speeds_alone": (True, ()),
    "speeds_and_brakes": (True, ("brakes",)),
    "speeds_and_all_modes": (True, ("brakes", "bus_off")),
}
Row = dict[str, Any]


def cell_rows(params: PlanCellsParams, say: Callable[[str], None], parts: Parts = HERE) -> list[Row]:
    """Plan every cell at every cycle time by every method.

    Args:
        params: Cells, cycle times, when searches end.
        say: Is told how far it is.
        parts: Where the cells at their cycle times are computed and kept.

    Returns:
        A row for each plan, see docs/nomenclature.md.

    Raises:
        RobojouleError: A cell has no plan.
    """
    tasks = [(params, name, percent) for name in params.cells for percent in params.cycle_times_percent]
    found = parts.map(
        cell_plans,
        tasks,
        lambda _, rows: say(f"{rows[0]['cell']} at {rows[0]['cycle_time_s']:g} s: {len(rows)} plans"),
    )
    return [row for rows in found for row in rows]


def cell_plans(params: PlanCellsParams, name: str, percent: float) -> list[Row]:
    """A row for the plan of each method, of one cell at one cycle time."""
    cell = read_robot_cell(str(resources.files("robojoule").joinpath("examples", name)))
    asked = replace(cell, cycle_time_s=cell.cycle_time_s * percent / 100.0)
    plans = {method: _plan(asked, method, params) for method in METHODS}
    return [_row(asked, method, plan, plans) for method, plan in plans.items()]


def variant(cell: RobotCell, method: str) -> RobotCell:
    """The cell as a method sees it: with its standby modes, and with fixed speeds where these are not planned."""
    planned, modes = METHODS[method]
    return replace(cell, robots=tuple(_robot(one, modes, fixed=not planned) for one in cell.robots))


def _robot(one: PlacedRobot, modes: tuple[str, ...], *, fixed: bool) -> PlacedRobot:
    given = one.robot.file.standby
    kept = {mode: found for mode in modes if given is not None and (found := getattr(given, mode)) is not None}
    file = one.robot.file.model_copy(update={"standby": StandbyFile(**kept) if kept else None})
    tree = one.program.tree
    if fixed:
        tree = tree.with_settings({move.name: {"fixed": True} for move in tree.moves()})
    robot = Robot(file, one.robot.payload, one.robot.source)
    return replace(one, robot=robot, program=replace(one.program, tree=tree))


def _plan(cell: RobotCell, method: str, params: PlanCellsParams) -> RobotCellPlan:
    return plan_robot_cell(
        variant(cell, method), time_limit_s=params.time_limit_s, gap_percent=params.gap_percent, seed=params.seed
    )


def _row(cell: RobotCell, method: str, plan: RobotCellPlan, plans: dict[str, RobotCellPlan]) -> Row:
    return {
        "cell": cell.name,
        "robots": len(cell.robots),
        "cycle_time_s": cell.cycle_time_s,
        "method": method,
        "energy_j": plan.energy_j,
        "bound_j": plan.bound_j,
        "saving_over_motors_on_percent": 100.0 * (1.0 - plan.energy_j / plans[MOTORS_ON].energy_j),
        "saving_over_brakes_percent": 100.0 * (1.0 - plan.energy_j / plans[BRAKES_ON].energy_j),
        "clearance_m": plan.run.clearance_m,
        "peak_power_w": plan.peak_power_w,
        "handovers": len(plan.run.handovers),
    }
