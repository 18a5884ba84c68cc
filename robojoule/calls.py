"""What calls of the library have in common: results are finite, one name serves programs and cells, or sections."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, TypeVar, overload

import numpy as np

from robojoule.checks import known_program
from robojoule.errors import InputError
from robojoule.planning.section_plans import has_sections, plan_in_sections

if TYPE_CHECKING:
    from robojoule.formats.program import Program
    from robojoule.formats.robot_cell import RobotCell
    from robojoule.planning.cells.plan import CellPlan
    from robojoule.planning.plan import Plan
    from robojoule.planning.robot_cells.plan import RobotCellPlan
    from robojoule.programs.cell import Cell


class _Result(Protocol):
    def to_dict(self) -> dict[str, Any]: ...


Asked = ParamSpec("Asked")
Found = TypeVar("Found", bound=_Result)
Given = TypeVar("Given", bound=_Result, covariant=True)


def finite(call: Callable[Asked, Found]) -> Callable[Asked, Found]:
    """Refuse figures of robots and programs, each within its bounds, that together give results beyond all bounds."""

    @wraps(call)
    def checked(*args: Asked.args, **named: Asked.kwargs) -> Found:
        with np.errstate(all="ignore"):
            result = call(*args, **named)
        try:
            json.dumps(result.to_dict(), allow_nan=False)
        except ValueError:
            raise InputError(
                "the result is not finite: a figure of robot, program or measurements is beyond all bounds"
            ) from None
        return result

    return checked


def in_sections(call: Callable[Asked, Plan]) -> Callable[Asked, Plan]:
    """Plan programs of which nobody knows how long some part takes section by section."""

    @wraps(call)
    def whole(*args: Any, **settings: Any) -> Plan:
        given = dict(zip(("program", "robot"), args, strict=False))
        program, robot = (settings.get(key, given.get(key)) for key in ("program", "robot"))
        if len(args) > len(given) or program is None or robot is None:
            return call(*args, **settings)  # which says what is wrong
        program = known_program(program, robot)
        rest = {key: value for key, value in settings.items() if key not in ("program", "robot")}

        def plan_one(section: Program) -> Plan:
            return call(section, robot, **rest)  # type: ignore[arg-type]

        if not has_sections(program):
            return plan_one(program)
        return plan_in_sections(program, rest.get("cycle_time"), plan_one)

    return whole


class _Optimize(Protocol[Asked, Given]):
    @overload
    def __call__(self, cell: Cell, /, **settings: Any) -> CellPlan: ...
    @overload
    def __call__(self, cell: RobotCell, /, **settings: Any) -> RobotCellPlan: ...
    @overload
    def __call__(self, cell: Cell | RobotCell, /, **settings: Any) -> CellPlan | RobotCellPlan: ...
    @overload
    def __call__(self, *args: Asked.args, **named: Asked.kwargs) -> Given: ...


def also_cells(call: Callable[Asked, Given]) -> _Optimize[Asked, Given]:
    """Let a cell be planned by the same name; its settings are those of `solve_cell`, or of `plan_robot_cell`."""

    @wraps(call)
    def either(*args: Any, **named: Any) -> Any:
        cells = sys.modules.get("robojoule.programs.cell")  # without it nobody can have made a cell
        if cells is not None and args and isinstance(args[0], cells.Cell):
            from robojoule.planning.cells.solve import solve_cell  # late: brings HiGHS

            return solve_cell(*args, **named)
        robot_cells = sys.modules.get("robojoule.formats.robot_cell")
        if robot_cells is not None and args and isinstance(args[0], robot_cells.RobotCell):
            from robojoule.planning.robot_cells.solve import plan_robot_cell  # late: likewise

            return plan_robot_cell(*args, **named)
        return call(*args, **named)

    return either
