"""What plans have in common, of one robot or of a cell, so that code may take any of them."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class AnyPlan(Protocol):
    """A plan for a cycle time with its energy and a bound.

    That of one robot is `robojoule.planning.plan.Plan`, that of a cell of activities
    `robojoule.planning.cells.plan.CellPlan`, that of robots with their programs
    `robojoule.planning.robot_cells.plan.RobotCellPlan`.
    """

    @property
    def cycle_time_s(self) -> float:
        """Cycle time. [s]"""

    @property
    def energy_j(self) -> float:
        """Energy of a cycle. [J]"""

    @property
    def bound_j(self) -> float:
        """Lower bound of the energy of every plan. [J]"""

    @property
    def gap_percent(self) -> float:
        """By how much the energy lies above the bound at most, relative to the energy. [%]"""

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain data, ready for JSON."""


def percent(difference_j: float, reference_j: float) -> float:
    """A difference as a share of a reference, which is zero only where nothing draws energy. [%]"""
    return 100.0 * difference_j / reference_j if reference_j > 0.0 else 0.0


def gap_percent(energy_j: float, bound_j: float) -> float:
    """By how much an energy lies above its bound at most, relative to the energy. [%]"""
    return percent(max(energy_j - bound_j, 0.0), energy_j)
