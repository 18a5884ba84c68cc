"""The plan of a cell: what each robot does when, in what pose and power mode."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from robojoule.arrays import Array
from robojoule.planning.any_plan import gap_percent

_SAME_S = 1e-6  # instants that are nearer to each other are one: rounding of the search


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

    def parts(self, cycle_time_s: float) -> list[tuple[float, float]]:
        """Start and length within the cycle, in two parts where it goes over its end. [s]"""
        start = self.start_s % cycle_time_s
        if self.duration_s <= 0.0:
            return []
        over = start + self.duration_s - cycle_time_s
        return [(start, self.duration_s)] if over <= 1e-9 else [(start, self.duration_s - over), (0.0, over)]


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
        return gap_percent(self.energy_j, self.bound_j)

    def powers_w(self) -> tuple[Array, Array]:
        """Power of all robots over a cycle, each activity at its mean power: times [s] and powers from them on [W]."""
        parts = [(start, start + length, one) for one in self.steps for start, length in one.parts(self.cycle_time_s)]
        edges = np.unique([0.0, self.cycle_time_s, *(edge for start, end, _ in parts for edge in (start, end))])
        time = edges[np.append(True, np.diff(edges) > _SAME_S)]
        if time[-1] < self.cycle_time_s:
            time = np.append(time, self.cycle_time_s)
        middle = 0.5 * (time[1:] + time[:-1])
        power = np.zeros(middle.size)
        for start, end, step in parts:
            power[(middle > start) & (middle < end)] += step.energy_j / step.duration_s
        return time, np.append(power, power[-1])

    @property
    def largest_mean_power_w(self) -> float:
        """Largest power of all robots at once, each activity at its mean power; peaks within movements are higher. [W]

        Energy functions tell no peaks, and no torques.
        """
        return float(self.powers_w()[1].max())

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain data, ready for JSON."""
        return {
            "cell": self.cell,
            "status": self.status,
            "cycle_time_s": self.cycle_time_s,
            "energy_j": self.energy_j,
            "largest_mean_power_w": self.largest_mean_power_w,
            "bound_j": self.bound_j,
            "gap_percent": self.gap_percent,
            "runtime_s": self.runtime_s,
            "steps": [asdict(step) for step in self.steps],
        }
