"""The plan of a cell: what each robot does when, in what pose and power mode."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Step:
    """An activity of a plan.

    Attributes:
        robot: Name of the robot.
        activity: Name of the activity.
        option: Name of the location of a static activity, of the movement of a dynamic one.
        mode: Power mode of a static activity; none for a dynamic one.
        start_s: Start; robots may start their cycle before or after time 0. [s]
        duration_s: Duration. [s]
        energy_j: Energy. [J]
    """

    robot: str
    activity: str
    option: str
    mode: str | None
    start_s: float
    duration_s: float
    energy_j: float


@dataclass(frozen=True, eq=False)
class CellPlan:
    """Plan of a cell.

    Attributes:
        cell: Name of the cell.
        cycle_time_s: Cycle time. [s]
        steps: Activities in order of execution, robot after robot; each robot's cycle ends with its last activity.
        status: "optimal" (within the gap that was asked for), or "feasible" (the search was stopped before).
        bound_j: Proven lower bound of the energy of every plan of the cell. [J]
        runtime_s: How long the search took. [s]
    """

    cell: str
    cycle_time_s: float
    steps: tuple[Step, ...]
    status: str
    bound_j: float
    runtime_s: float = 0.0

    def __repr__(self) -> str:
        return (
            f"CellPlan({self.cell!r}: {self.status}, cycle_time_s={self.cycle_time_s:.6g}, "
            f"energy_j={self.energy_j:.7g}, gap_percent={self.gap_percent:.3g}, steps={len(self.steps)})"
        )

    @property
    def energy_j(self) -> float:
        """Energy of a cycle of all robots. [J]"""
        return sum(step.energy_j for step in self.steps)

    @property
    def gap_percent(self) -> float:
        """By how much the energy lies above the proven bound at most, relative to the energy. [%]"""
        energy = self.energy_j
        return 100.0 * max(energy - self.bound_j, 0.0) / energy if energy > 0.0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain data, ready for JSON."""
        return {
            "cell": self.cell,
            "status": self.status,
            "cycle_time_s": self.cycle_time_s,
            "energy_j": self.energy_j,
            "bound_j": self.bound_j,
            "gap_percent": self.gap_percent,
            "runtime_s": self.runtime_s,
            "steps": [asdict(step) for step in self.steps],
        }
