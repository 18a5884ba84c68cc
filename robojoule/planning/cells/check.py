"""Independent check of plans: feasibility and energy of a plan from the cell alone.

Nothing here is shared with the models: no numbering, no solver, no search. It knows the cell
(`robojoule.programs.cell`) and the steps of a plan, whoever made them.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from robojoule.errors import PlanningError
from robojoule.planning.cells.plan import CellPlan, Step
from robojoule.programs.cell import Cell, CellRobot

TOLERANCE_S = 1e-5
TOLERANCE_SHARE = 1e-6  # of energies that a plan states


@dataclass(frozen=True)
class Check:
    """What the check found.

    Attributes:
        violations: What the plan violates, a sentence each; none if it is feasible.
        energy_j: Energy of the steps, computed anew; NaN where a step is unknown. [J]
    """

    violations: tuple[str, ...]
    energy_j: float

    @property
    def feasible(self) -> bool:
        """Whether the plan keeps everything."""
        return not self.violations


def check_plan(cell: Cell, plan: CellPlan) -> Check:
    """Check a plan of a cell.

    Args:
        cell: The cell.
        plan: A plan, of whatever origin.

    Returns:
        Violations and energy.
    """
    found: list[str] = []
    if not abs(plan.cycle_time_s - cell.cycle_time_s) <= TOLERANCE_S:
        found.append(f"the cycle time is {plan.cycle_time_s:.6g} s, that of the cell {cell.cycle_time_s:.6g} s")
    known = [step for step in plan.steps if _is_known(cell, step, found)]
    energies = [_energy_j(cell, step) for step in known]
    for step, energy in zip(known, energies, strict=True):
        _check_step(cell, step, energy, found)
    for name, count in Counter(step.activity for step in known).items():
        if count > 1:
            found.append(f"activity {name} is done {count} times")
    for robot in cell.robots:
        _check_tour(cell, robot, [step for step in known if cell.robot_of[step.activity] == robot.name], found)
    steps = {step.activity: step for step in known}
    _check_lags(cell, steps, found)
    _check_handovers(cell, steps, found)
    _check_collisions(cell, steps, found)
    energy = sum(energies) if len(known) == len(plan.steps) else math.nan
    if not plan.bound_j <= energy + TOLERANCE_SHARE * (energy + len(known)) and not math.isnan(energy):
        found.append(f"the plan takes {energy:.7g} J, less than the bound of {plan.bound_j:.7g} J that it states")
    return Check(tuple(found), energy)


def checked(cell: Cell, plan: CellPlan) -> CellPlan:
    """The plan, if it passes the check.

    Raises:
        PlanningError: It does not; this would be a mistake of the search, never of the user.
    """
    check = check_plan(cell, plan)
    if not check.feasible:
        raise PlanningError(f"the plan of cell '{cell.name}' does not pass the check: {check.violations[0]}")
    return plan


def _is_known(cell: Cell, step: Step, found: list[str]) -> bool:
    """Whether robot, activity, option and mode exist."""
    times = (step.start_s, step.duration_s, step.energy_j)
    if not all(math.isfinite(value) for value in times):
        found.append(f"activity {step.activity}: start, duration and energy must be finite")
        return False
    if cell.robot_of.get(step.activity) != step.robot:
        found.append(f"robot {step.robot} has no activity {step.activity}")
        return False
    if step.activity in cell.static:
        options = {one.name for one in cell.static[step.activity].locations}
        modes = {mode.name for robot in cell.robots if robot.name == step.robot for mode in robot.modes}
        known_mode = step.mode in modes
    else:
        options = {one.name for one in cell.dynamic[step.activity].movements}
        known_mode = step.mode is None
    if step.option not in options:
        found.append(f"activity {step.activity} has no option {step.option}")
        return False
    if not known_mode:
        found.append(f"activity {step.activity} has no power mode {step.mode}")
        return False
    return True


def _energy_j(cell: Cell, step: Step) -> float:
    if step.activity in cell.static:
        location = next(one for one in cell.static[step.activity].locations if one.name == step.option)
        return location.powers_w[str(step.mode)] * step.duration_s
    profile = next(one for one in cell.dynamic[step.activity].movements if one.name == step.option).profile
    return float(profile.value(min(max(step.duration_s, profile.d_min_s), profile.d_max_s)))


def _check_step(cell: Cell, step: Step, energy_j: float, found: list[str]) -> None:
    """Window of the duration, minimal idle time and stated energy."""
    if step.activity in cell.static:
        activity = cell.static[step.activity]
        robot = next(one for one in cell.robots if one.name == step.robot)
        idle = next(mode.least_idle_s for mode in robot.modes if mode.name == step.mode)
        low, high = max(activity.least_s, idle), activity.longest_s
    else:
        profile = next(one for one in cell.dynamic[step.activity].movements if one.name == step.option).profile
        low, high = profile.d_min_s, profile.d_max_s
    if not low - TOLERANCE_S <= step.duration_s <= high + TOLERANCE_S:
        found.append(f"activity {step.activity} takes {step.duration_s:.6g} s, not {low:.6g} to {high:.6g} s")
    if abs(step.energy_j - energy_j) > TOLERANCE_SHARE * max(abs(energy_j), 1.0):
        found.append(f"activity {step.activity} takes {energy_j:.7g} J, not {step.energy_j:.7g} J")


def _check_tour(cell: Cell, robot: CellRobot, steps: list[Step], found: list[str]) -> None:
    """One closed tour through all static activities, without gaps, as long as the cycle."""
    done = {step.activity for step in steps}
    missing = [one.name for one in robot.static if one.name not in done]
    if missing:
        found.append(f"robot {robot.name} leaves out activity {missing[0]}")
        return
    # Activities that take no time share their start with the next one: what moves comes after what stands before it.
    order = _in_order(cell, robot, steps)
    if order is None:
        found.append(f"the activities of robot {robot.name} form no closed tour that ends with {robot.last}")
        return
    for step, following in zip(order, [*order[1:], order[0]], strict=True):
        end = step.start_s + step.duration_s - (cell.cycle_time_s if step.activity == robot.last else 0.0)
        if abs(following.start_s - end) > TOLERANCE_S:
            problem = f"activity {following.activity} starts at {following.start_s:.6f} s"
            found.append(f"{problem}, but {step.activity} before it ends at {end:.6f} s")
        standing, moving = (step, following) if step.activity in cell.static else (following, step)
        movement = next(one for one in cell.dynamic[moving.activity].movements if one.name == moving.option)
        needed = movement.start if standing is step else movement.end
        if standing.option != needed:
            problem = f"movement {moving.option} of activity {moving.activity} needs location {needed}"
            found.append(f"{problem} of activity {standing.activity}, not {standing.option}")
    total = math.fsum(step.duration_s for step in order)
    if abs(total - cell.cycle_time_s) > TOLERANCE_S:
        found.append(f"the activities of robot {robot.name} take {total:.6f} s, not {cell.cycle_time_s:.6f} s")


def _in_order(cell: Cell, robot: CellRobot, steps: list[Step]) -> list[Step] | None:
    """The steps from the one after the last activity to that itself, by what joins what; none if they do not join."""
    leaving: dict[str, list[Step]] = defaultdict(list)
    standing = {step.activity: step for step in steps if step.activity in cell.static}
    for step in steps:
        if step.activity in cell.dynamic:
            leaving[cell.dynamic[step.activity].start].append(step)
    order: list[Step] = []
    place = robot.last
    for _ in robot.static:
        if len(leaving[place]) != 1:
            return None
        moving = leaving[place][0]
        place = cell.dynamic[moving.activity].end
        if place not in standing:
            return None
        order += [moving, standing.pop(place)]
    return order if len(order) == len(steps) and place == robot.last else None


def _check_lags(cell: Cell, steps: dict[str, Step], found: list[str]) -> None:
    for lag in cell.lags:
        if lag.first in steps and lag.second in steps:
            between = steps[lag.second].start_s - steps[lag.first].start_s
            least = lag.length_s - cell.cycle_time_s * lag.cycles
            if between < least - TOLERANCE_S:
                problem = f"activity {lag.second} starts {between:.6f} s after activity {lag.first}"
                found.append(f"{problem}, the time lag demands {least:.6f} s")


def _check_handovers(cell: Cell, steps: dict[str, Step], found: list[str]) -> None:
    for one in cell.handovers:
        if one.first in steps and one.second in steps:
            chosen = steps[one.first].option, steps[one.second].option
            if chosen not in one.pairs:
                places = f"location {chosen[0]} of activity {one.first} and location {chosen[1]} of {one.second}"
                found.append(f"{places} do not fit together")


def _check_collisions(cell: Cell, steps: dict[str, Step], found: list[str]) -> None:
    for first, second in cell.collisions:
        a, b = steps.get(first.activity), steps.get(second.activity)
        if a is None or b is None or a.option != first.option or b.option != second.option:
            continue
        if not _apart(a, b, cell.cycle_time_s):
            found.append(f"activities {a.activity} and {b.activity} collide")


def _apart(a: Step, b: Step, cycle_time_s: float) -> bool:
    """Whether two intervals, repeated every cycle, never overlap: touching is allowed."""
    cycles = math.floor((b.start_s - a.start_s) / cycle_time_s)
    shifts: Sequence[float] = [(b.start_s - a.start_s) - n * cycle_time_s for n in (cycles - 1, cycles, cycles + 1)]
    return any(
        shift >= a.duration_s - TOLERANCE_S and shift + b.duration_s <= cycle_time_s + TOLERANCE_S for shift in shifts
    )
