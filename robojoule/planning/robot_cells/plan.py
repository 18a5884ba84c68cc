"""The plan of a cell of robots: a program for each of them, and what the simulation of all of them says."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from robojoule.formats.program import Program
from robojoule.planning.any_plan import gap_percent, percent
from robojoule.planning.cells.plan import Step
from robojoule.planning.robot_cells.cell_run import CellRun


@dataclass(frozen=True, eq=False)
class RobotCellPlan:
    """Programs of all robots with the least energy for the cycle time of their cell, simulated together.

    Attributes:
        programs: A program for each robot with its targets, speed limits and waits.
        run: Simulation of all of them.
        status: "optimal" (within the gap that was asked for), or "feasible" (the search was stopped before, or the
            programs in whole percents are not as near to the bound).
        bound_j: Lower bound of the energy of every plan of the cell at any speed, if two robots whose ways come too
            close are never both on them; proven where profiles are simulated. [J]
        energy_given_j: Energy of the programs as given, each by itself and waiting at its end for the rest of the
            cycle: robots that do not wait for each other, so what it takes less cannot be had. [J]
        profiles: Where the profiles of the search come from: simulated or predicted.
        runtime_s: How long planning took. [s]
        warnings: What to know before the plan is used, a sentence each.
    """

    programs: tuple[Program, ...]
    run: CellRun
    status: str
    bound_j: float
    energy_given_j: float
    profiles: str = "simulated"
    runtime_s: float = 0.0
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return (
            f"RobotCellPlan({self.run.cell!r}: {self.status}, cycle_time_s={self.cycle_time_s:.6g}, "
            f"energy_j={self.energy_j:.7g}, gap_percent={self.gap_percent:.3g}, "
            f"clearance_m={self.run.clearance_m:.3g}, warnings={len(self.warnings)})"
        )

    @property
    def cell(self) -> str:
        """Name of the cell."""
        return self.run.cell

    @property
    def cycle_time_s(self) -> float:
        """Cycle time. [s]"""
        return self.run.cycle_time_s

    @property
    def energy_j(self) -> float:
        """Simulated energy of a cycle of all robots. [J]"""
        return self.run.energy_j

    @property
    def peak_power_w(self) -> float:
        """Largest mains power of all robots together. [W]"""
        return self.run.peak_power_w

    @property
    def steps(self) -> tuple[Step, ...]:
        """What each robot does when."""
        return self.run.steps

    @property
    def gap_percent(self) -> float:
        """By how much the energy lies above the bound at most, relative to the energy. [%]"""
        return gap_percent(self.energy_j, self.bound_j)

    @property
    def saving_percent(self) -> float:
        """Energy that the plan saves against the programs as given. [%]"""
        return percent(self.energy_given_j - self.energy_j, self.energy_given_j)

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain data, ready for JSON."""
        return {
            "cell": self.cell,
            "status": self.status,
            "cycle_time_s": self.cycle_time_s,
            "energy_j": self.energy_j,
            "bound_j": self.bound_j,
            "gap_percent": self.gap_percent,
            "energy_given_j": self.energy_given_j,
            "saving_percent": self.saving_percent,
            "peak_power_w": self.peak_power_w,
            "peak_power_sum_w": self.run.peak_power_sum_w,
            "clearance_m": self.run.clearance_m if self.run.meetings else None,
            "profiles": self.profiles,
            "runtime_s": self.runtime_s,
            "starts_s": dict(zip(self.run.robots, self.run.starts_s, strict=True)),
            "meetings": [asdict(one) for one in self.run.meetings],
            "handovers": [asdict(one) for one in self.run.handovers],
            "steps": [asdict(step) for step in self.steps],
            "warnings": list(self.warnings),
        }
