"""Energy-optimal speed plans for robotic cells.

The names below are all that most users need; each is loaded when it is first used. Units are SI.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robojoule.api import (
        adjust,
        energy_profile,
        identify,
        identify_friction,
        identify_timing,
        optimize,
        pareto,
        report,
        simulate,
    )
    from robojoule.formats.cells import load_cells
    from robojoule.formats.program import Program, load_program
    from robojoule.planning.cells.plan import CellPlan
    from robojoule.planning.plan import Plan
    from robojoule.programs.cell import Cell
    from robojoule.robots import list_robots, load_robot
    from robojoule.robots.robot import Payload, Robot

__all__ = [
    "Cell",
    "CellPlan",
    "Payload",
    "Plan",
    "Program",
    "Robot",
    "adjust",
    "energy_profile",
    "identify",
    "identify_friction",
    "identify_timing",
    "list_robots",
    "load_cells",
    "load_program",
    "load_robot",
    "optimize",
    "pareto",
    "report",
    "simulate",
]
__version__ = "0.1.0"

_MODULES = {
    "Cell": "robojoule.programs.cell",
    "CellPlan": "robojoule.planning.cells.plan",
    "Payload": "robojoule.robots.robot",
    "Plan": "robojoule.planning.plan",
    "Program": "robojoule.formats.program",
    "Robot": "robojoule.robots.robot",
    "list_robots": "robojoule.robots",
    "load_cells": "robojoule.formats.cells",
    "load_program": "robojoule.formats.program",
    "load_robot": "robojoule.robots",
}  # of the names that are not in robojoule.api

if not TYPE_CHECKING:  # type checkers know the names from above, and any other name as an error

    def __getattr__(name: str) -> object:
        if name not in __all__:
            raise AttributeError(f"module 'robojoule' has no attribute '{name}'")
        value = getattr(import_module(_MODULES.get(name, "robojoule.api")), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
