"""All robots of a cell simulated together, from their programs as they stand: energy, clearance, hand-overs, power.

It knows the programs alone, neither the plan nor the model that they came from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.program import Program
from robojoule.formats.robot_cell import PartHandover, RobotCell
from robojoule.planning.cells.plan import Step
from robojoule.planning.cycle_run import CycleRun
from robojoule.planning.robot_cells.fidelity import pose_violations, program_violations
from robojoule.planning.robot_cells.shared_space import arms_of
from robojoule.planning.robot_cells.timeline import Timeline
from robojoule.robots.clearance import PlacedArm, least_clearance

TOLERANCE_S = 1e-5  # of cycle times and hand-overs
POWER_RATE_HZ = 1000.0
_BESIDE_S = 1e-6  # of a jump of the power: before and after it
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Meeting:
    """Where two robots are closest.

    Attributes:
        first: One robot.
        second: The other.
        clearance_m: Distance that they keep over the whole cycle; negative where they overlap. [m]
        time_s: When they are so close. [s]
    """

    first: str
    second: str
    clearance_m: float
    time_s: float


@dataclass(frozen=True)
class HandoverRun:
    """How a hand-over goes.

    Attributes:
        first: What comes first, in words.
        second: What comes after it.
        spare_s: By how much the second starts later than it must; negative where it is too early. [s]
    """

    first: str
    second: str
    spare_s: float


@dataclass(frozen=True, eq=False)
class CellRun:
    """Simulation of a cycle of a cell.

    Attributes:
        cell: Name of the cell.
        cycle_time_s: Cycle time. [s]
        robots: Names of the robots.
        starts_s: When each robot's program starts. [s]
        runs: Simulation of each robot's program.
        steps: What each robot does when, standing (with its process steps) and moving.
        energy_j: Energy of a cycle of all robots with their process steps. [J]
        meetings: Of each two robots, where they are closest.
        handovers: How hand-overs go.
        peak_power_w: Largest mains power of all robots together. [W]
        peak_power_sum_w: Largest sum of the largest powers of what takes place at the same time. [W]
        violations: What is not kept, a sentence each.
    """

    cell: str
    cycle_time_s: float
    robots: tuple[str, ...]
    starts_s: tuple[float, ...]
    runs: tuple[CycleRun, ...]
    steps: tuple[Step, ...]
    energy_j: float
    meetings: tuple[Meeting, ...]
    handovers: tuple[HandoverRun, ...]
    peak_power_w: float
    peak_power_sum_w: float
    violations: tuple[str, ...]

    def __repr__(self) -> str:
        return (
            f"CellRun({self.cell!r}: energy_j={self.energy_j:.6g}, clearance_m={self.clearance_m:.4g}, "
            f"peak_power_w={self.peak_power_w:.6g}, violations={len(self.violations)})"
        )

    @property
    def clearance_m(self) -> float:
        """Least distance of two robots; infinity for a single one. [m]"""
        return min((one.clearance_m for one in self.meetings), default=float("inf"))

    @property
    def feasible(self) -> bool:
        """Whether everything is kept."""
        return not self.violations

    def to_dict(self) -> dict[str, Any]:
        """The run as plain data, ready for JSON."""
        return {
            "cell": self.cell,
            "feasible": self.feasible,
            "cycle_time_s": self.cycle_time_s,
            "energy_j": self.energy_j,
            "peak_power_w": self.peak_power_w,
            "peak_power_sum_w": self.peak_power_sum_w,
            "clearance_m": self.clearance_m if self.meetings else None,
            "meetings": [asdict(one) for one in self.meetings],
            "handovers": [asdict(one) for one in self.handovers],
            "violations": list(self.violations),
        }


def simulate_cell(
    cell: RobotCell,
    programs: Sequence[Program],
    starts_s: Sequence[float],
    arms: Sequence[PlacedArm] | None = None,
) -> CellRun:
    """Simulate all robots of a cell together.

    Args:
        cell: The cell.
        programs: A program for each robot, as it stands.
        starts_s: When each program starts in the cell. [s]
        arms: The robots as bodies, if they are known already.

    Raises:
        InputError: A program does not fit its robot.
    """
    if not len(programs) == len(starts_s) == len(cell.robots):
        raise InputError(f"{len(programs)} programs are given for {len(cell.robots)} robots", key="programs")
    cycle = cell.cycle_time_s
    lines = [
        Timeline(one, program, start, cycle)
        for one, program, start in zip(cell.robots, programs, starts_s, strict=True)
    ]
    violations = [
        problem
        for placed, program in zip(cell.robots, programs, strict=True)
        for problem in program_violations(placed, program)
    ]
    violations += pose_violations(cell, programs)
    late = [
        f"the cycle of {line.placed.name} takes {line.run.cycle_time_s:.6f} s, not {cycle:.6f} s"
        for line in lines
        if abs(line.run.cycle_time_s - cycle) > TOLERANCE_S
    ]
    violations += late
    meetings = _meetings(lines, arms_of(cell) if arms is None else arms) if not late else ()
    for one in meetings:
        if one.clearance_m < cell.safety_distance_m - _ROUNDING:
            violations.append(
                f"{one.first} and {one.second} come within {one.clearance_m:.4f} m of each other at "
                f"{one.time_s:.3f} s, the safety distance is {cell.safety_distance_m:g} m"
            )
    done = {line.placed.name: line.times_s for line in lines}
    handovers = tuple(
        _handover(one, lines, cycle)
        for one in cell.handovers
        if all(place.operation in done[place.robot] for place in (one.first, one.second))  # else it is told above
    )
    for two in handovers:
        if two.spare_s < -TOLERANCE_S:
            violations.append(f"{two.second} starts {-two.spare_s:.4f} s too early after {two.first}")
    peak_w, sum_w = _peak_power(lines, cycle)
    if cell.peak_power_w is not None and peak_w > cell.peak_power_w * (1.0 + _ROUNDING):
        violations.append(f"all robots together draw {peak_w:.0f} W, more than {cell.peak_power_w:g} W")
    return CellRun(
        cell.name,
        cycle,
        tuple(one.name for one in cell.robots),
        tuple(float(start) for start in starts_s),
        tuple(line.run for line in lines),
        tuple(step for line in lines for step in _steps(line)),
        sum(sum(map(sum, line.energies_j)) for line in lines),
        meetings,
        handovers,
        peak_w,
        sum_w,
        tuple(violations),
    )


def _meetings(lines: Sequence[Timeline], arms: Sequence[PlacedArm]) -> tuple[Meeting, ...]:
    timed = [line.courses(arm) for line, arm in zip(lines, arms, strict=True)]
    found = []
    for a, b in combinations(range(len(lines)), 2):
        clearance, time = least_clearance(timed[a], timed[b])
        found.append(Meeting(lines[a].placed.name, lines[b].placed.name, clearance, time))
    return tuple(found)


def _handover(one: PartHandover, lines: Sequence[Timeline], cycle_s: float) -> HandoverRun:
    by_name = {line.placed.name: line for line in lines}
    first, second = by_name[one.first.robot], by_name[one.second.robot]
    ended = first.start_s + first.times_s[one.first.operation][1]
    started = second.start_s + second.times_s[one.second.operation][0]
    return HandoverRun(str(one.first), str(one.second), started - ended - one.lag_s + cycle_s * one.cycles)


def _peak_power(lines: Sequence[Timeline], cycle_s: float) -> tuple[float, float]:
    """Largest power of all robots together, and largest sum of their largest powers. [W]"""
    peaks = [line.peaks() for line in lines]
    edges = np.unique(
        np.array([0.0, cycle_s, *(edge for one in peaks for begin, end, _ in one for edge in (begin, end))])
    )
    lasting = np.diff(edges) > TOLERANCE_S  # what only rounding lets overlap does not count
    middle = 0.5 * (edges[:-1] + edges[1:])[lasting]
    largest = np.zeros(middle.size)
    for one in peaks:
        for begin, end, power in one:
            largest[(middle > begin) & (middle < end)] += power
    grid = np.arange(0.0, cycle_s, 1.0 / POWER_RATE_HZ)
    jumps = np.array([time for line in lines for time in line.instants()])
    times = np.unique(np.concatenate([grid, middle, jumps - _BESIDE_S, jumps + _BESIDE_S])).clip(0.0, cycle_s)
    power_w = sum(line.power_w(times) for line in lines)
    return float(np.max(power_w)), float(largest.max())


def _steps(line: Timeline) -> list[Step]:
    """Standing and moving of one robot, from its first move on."""
    steps = []
    name = line.placed.name
    for piece in line.pieces:
        if not piece.moves:
            continue
        i = piece.move
        moved_j, stood_j = line.energies_j[i]
        move = line.run.names[i]
        start = line.start_s + piece.begin_s
        stood_s = float(line.run.post_waits_s[i] + line.run.prior_waits_s[(i + 1) % len(line.run.names)])
        limit = f"{100.0 * float(line.run.speed_limits[i]):.6g} %"
        length = piece.end_s - piece.begin_s
        steps.append(Step(name, f"{name}: {move}", limit, None, start, length, moved_j))
        steps.append(
            Step(name, f"{name}: {move} (standing)", "there", line.standing[i][1], start + length, stood_s, stood_j)
        )
    return steps
