"""What robojoule does, one function each: they take programs, robots and logs and give typed results.

Units are SI; every result has `to_dict()`, plain data that is ready for JSON. Bad input raises
`robojoule.errors.InputError` with one sentence.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from robojoule.arrays import as_array
from robojoule.errors import InputError
from robojoule.inputs import shown
from robojoule.planning.batch import TreeBatch
from robojoule.planning.cycle_run import CycleRun, simulate_trees
from robojoule.planning.cycle_time import cycle_time_s
from robojoule.planning.pareto import TradeOff, trade_offs
from robojoule.planning.plan import Plan, plan_warnings, verify, waiting_until
from robojoule.planning.source_plans import plan_on_source
from robojoule.planning.writeback import write_plans
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.energy_profile import LEAST_TRAVEL_RAD, EnergyProfile, simulated_profile
from robojoule.programs.program import Program
from robojoule.robots.robot import Robot

if TYPE_CHECKING:
    from robojoule.calibration.identification import Identification
    from robojoule.calibration.log import MeasuredLog
    from robojoule.planning.cells.plan import CellPlan
    from robojoule.programs.cell import Cell

RELATIVE_GAP = 8e-5  # proven gap of a plan at which no more runs are simulated


class _Result(Protocol):
    def to_dict(self) -> dict[str, Any]: ...


Asked = ParamSpec("Asked")
Found = TypeVar("Found", bound=_Result)
Given = TypeVar("Given", bound=_Result, covariant=True)


def _finite(call: Callable[Asked, Found]) -> Callable[Asked, Found]:
    """Refuse figures of robots and programs, each within its bounds, that together give results beyond all bounds."""

    @wraps(call)
    def checked(*args: Asked.args, **named: Asked.kwargs) -> Found:
        with np.errstate(all="ignore"):
            result = call(*args, **named)
        try:
            json.dumps(result.to_dict(), allow_nan=False)
        except ValueError:
            raise InputError("the result is not finite: a figure of the robot is beyond all bounds") from None
        return result

    return checked


class _Optimize(Protocol[Asked, Given]):
    @overload
    def __call__(self, cell: Cell, /, **settings: Any) -> CellPlan: ...
    @overload
    def __call__(self, *args: Asked.args, **named: Asked.kwargs) -> Given: ...


def _also_cells(call: Callable[Asked, Given]) -> _Optimize[Asked, Given]:
    """Let a cell be planned by the same name; see `robojoule.planning.cells.solve.solve_cell` for its settings."""

    @wraps(call)
    def either(*args: Any, **named: Any) -> Any:
        cells = sys.modules.get("robojoule.programs.cell")  # without it nobody can have made a cell
        if cells is not None and args and isinstance(args[0], cells.Cell):
            from robojoule.planning.cells.solve import solve_cell  # late: brings HiGHS

            return solve_cell(*args, **named)
        return call(*args, **named)

    return either


@_also_cells
@_finite
def optimize(program: Program, robot: Robot, *, cycle_time: float | str) -> Plan:
    """The plan with the least energy for a cycle time: speed limits and waits of the program.

    A `Cell` may be given instead of program and robot: `optimize(cell, time_limit_s=60)`, with the settings of
    `robojoule.planning.cells.solve.solve_cell`, gives its `CellPlan`.

    Speed limits of the program as given are not kept; its waits and process steps are, and may only become longer.

    Args:
        program: What the robot does in a cycle.
        robot: Robot with its payload.
        cycle_time: Seconds (7.5), or a share above the cycle time of the program as given, its waits and speed limits
            included ("+10%").

    Raises:
        InputError: The program does not fit the robot, or the cycle time is not valid.
        CycleTimeTooShort: The cycle time is shorter than the fastest cycle; names the least feasible one.
        PlanningError: The solver failed.
    """
    batch = _moving(program, robot)  # the motions and their optimisation graph
    at_full_speed = program.tree.with_plan({move.name: 100.0 for move in program.moves})
    given, fastest = simulate_trees(batch, [[program.tree, at_full_speed]])[0]
    least_s = float(batch.least_cycles_s[0])
    wanted_s = cycle_time_s(cycle_time, given_s=given.cycle_time_s, least_s=least_s)

    profiles = AdaptiveProfiles(batch.paths, batch.slowest_speed_limit)
    schedule = plan_on_source(profiles, batch, np.array([[wanted_s]]), relative_gap=RELATIVE_GAP).plans[0][0]
    written = write_plans(batch, [[schedule]])[0][0]
    run = verify(batch, written, schedule)

    idle_w = float(batch.idle_post_w[-1])
    return Plan(
        program=Program(written),
        robot=robot.name,
        payload_kg=float(robot.payload.mass_kg),
        run=run,
        least_cycle_time_s=least_s,
        energy_given_j=waiting_until(given, run.cycle_time_s, idle_w),
        energy_unoptimized_j=waiting_until(fastest, run.cycle_time_s, idle_w),
        bound_j=min(schedule.bound_j, run.energy_j),  # a plan that exists is above the bound but for rounding
        warnings=plan_warnings(written, run, given),
    )


@_finite
def simulate(program: Program, robot: Robot) -> CycleRun:
    """One cycle of a program as it stands: cycle time, energy and largest power and torque, move by move.

    Args:
        program: What the robot does in a cycle.
        robot: Robot with its payload.

    Raises:
        InputError: The program does not fit the robot.
    """
    return simulate_trees(_batch(program, robot), [[program.tree]])[0][0]


@_finite
def pareto(program: Program, robot: Robot) -> TradeOff:
    """Least energy of a program over its cycle time, for all cycle times at once.

    Args:
        program: What the robot does in a cycle.
        robot: Robot with its payload.

    Raises:
        InputError: The program does not fit the robot.
    """
    return trade_offs(_moving(program, robot))[0]


@_finite
def energy_profile(
    robot: Robot, start: ArrayLike, end: ArrayLike, *, points: int = 19, degrees: bool = False
) -> EnergyProfile:
    """Energy of one motion over its duration, from runs at equidistant speed limits from 10 to 100 %.

    Args:
        robot: Robot with its payload.
        start: Start configuration, shape (n,). [rad]
        end: End configuration, shape (n,). [rad]
        points: Number of speed limits, 2 to 1000.
        degrees: Whether the configurations are in degrees instead.

    Raises:
        InputError: A configuration does not fit the robot, or there is no motion.
    """
    robot = _checked_robot(robot)
    first, last = (
        robot.check_configuration(np.radians(as_array(q, where, "joint positions")) if degrees else q, where)
        for q, where in ((start, "start"), (end, "end"))
    )
    return simulated_profile(robot, first, last, points)


@_finite
def identify(
    log: str | Path | MeasuredLog,
    robot: Robot,
    *,
    torque_constants: Sequence[float] | None = None,
    smoothing_s: float | None = None,
    window_s: float | None = None,
) -> Identification:
    """Drive parameters of a robot from a measured log of its motions and mains power.

    Args:
        log: CSV or Parquet file, or a log that was read.
        robot: The robot that was measured, with its payload; its link inertias and gear ratios are taken as given.
        torque_constants: Motor torque over motor current, one per joint, for a file with motor currents. [Nm/A]
        smoothing_s: Length over which positions are differentiated; chosen by their noise if not given. [s]
        window_s: Length over which power is averaged; 0.1 s if not given. [s]

    Raises:
        InputError: The log cannot be read, is too short or contradicts itself.
    """
    from robojoule.calibration import identification  # late: brings scipy
    from robojoule.calibration.log import MeasuredLog, check_torque_constants, read_log
    from robojoule.calibration.signals import WINDOW_S

    robot = _checked_robot(robot)
    if torque_constants is not None:
        check_torque_constants(torque_constants, robot)
    if not isinstance(log, MeasuredLog):
        log = read_log(log, robot, torque_constants)
    window = WINDOW_S if window_s is None else window_s
    return identification.identify(log, robot, smoothing_s=smoothing_s, window_s=window)


def _batch(program: Program, robot: Robot) -> TreeBatch:
    """The motions and the optimisation graph of a program, checked against its robot."""
    if not isinstance(program, Program):
        raise InputError(f"{shown(program)} is not a program", key="program", allowed="what load_program returns")
    program.check(_checked_robot(robot))
    return TreeBatch(robot, [program.tree])


def _moving(program: Program, robot: Robot) -> TreeBatch:
    """The same of a program that has something to plan."""
    batch = _batch(program, robot)
    if np.ptp(program.tree.configurations_rad(), axis=0).max() <= LEAST_TRAVEL_RAD:
        raise InputError("there is no motion: all positions of the program are the same", file=program.path)
    return batch


def _checked_robot(robot: Robot) -> Robot:
    if not isinstance(robot, Robot):
        raise InputError(f"{shown(robot)} is not a robot", key="robot", allowed="what load_robot returns")
    return robot
