"""Why a cell has no plan, said in one sentence: which robot, or which time lags, need a longer cycle."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from time import monotonic

import numpy as np

from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.planning.cells.conflicts import (
    binding_handovers,
    brief,
    contradicting_handovers,
    contradicting_lags,
    enough_s,
)
from robojoule.planning.cells.linear import Limits
from robojoule.planning.cells.model import CellModel
from robojoule.planning.cells.numbering import Lag, Numbering
from robojoule.programs.cell import TimeLag

_SHOWN, _ROOM = 6, 120  # pairs of names in a message, and their characters, at most
NO_PLAN = "the cell has no plan at this cycle time"
UNEXPLAINED = f"{NO_PLAN}; there was no time to find out why"
TOO_SHORT_S = 1e-6  # by which a cycle time may be too short by rounding


def explain(numbers: Numbering, limits: Limits) -> InputError:
    """The reason why there is no plan.

    Args:
        numbers: A cell that a search has found to have none.
        limits: When to end with a plain sentence if the reason was not found, threads and seed of the solver.
    """
    if _over(limits):
        return InputError(UNEXPLAINED)
    cell = numbers.cell
    slowest, least = "", 0.0
    for r, robot in enumerate(cell.robots):
        found = CellModel(numbers, [r], free_cycle_time=True).program.solve(brief(limits))
        if found.status == "infeasible":
            return InputError("there is no closed tour through all static activities", key=f"robot {robot.name}")
        if found.bound > least:
            slowest, least = robot.name, found.bound
        if _over(limits):
            break
    model = CellModel(numbers, free_cycle_time=True)
    found = model.program.solve(brief(limits))
    if found.status == "infeasible":
        loose = CellModel(numbers, free_cycle_time=True, without=("handovers",))
        if loose.program.solve(brief(limits)).status == "infeasible":
            apart = CellModel(numbers, free_cycle_time=True, without=("handovers", "lags"))
            if apart.program.solve(brief(limits)).status == "infeasible":
                return InputError("the longest durations leave the robots no common cycle time")
            return _contradiction(contradicting_lags(cell, limits))
        ends = _joined((one.first, one.second) for one in contradicting_handovers(cell, limits))
        return InputError(f"the locations of the hand-overs between activities {ends} cannot be chosen so that all fit")
    if max(found.bound, least) > cell.cycle_time_s + TOO_SHORT_S:
        if found.bound <= least + TOO_SHORT_S:
            return CycleTimeTooShort(cell.cycle_time_s, least, forced=f"by robot {slowest}")
        return CycleTimeTooShort(cell.cycle_time_s, found.bound, forced=_forced(model, found.bound, limits))
    if (slow := _too_long(numbers, limits)) is not None:
        return slow
    enough = enough_s(cell, max(found.bound, least), limits)
    if enough is not None:
        forced = "by activities that exclude each other, as far as a short search tells"
        return CycleTimeTooShort(cell.cycle_time_s, enough, forced=forced)
    return InputError(UNEXPLAINED if _over(limits) else f"{NO_PLAN}: collisions and time lags leave no room")


def _over(limits: Limits) -> bool:
    return monotonic() > limits.until or (limits.stop is not None and limits.stop())


def _too_long(numbers: Numbering, limits: Limits) -> InputError | None:
    """That the cycle cannot be filled, where it cannot: longest durations, or lags, of which some say "at most"."""
    cell = numbers.cell
    for robots in (*([r] for r in range(numbers.robots)), None):
        model = CellModel(numbers, robots, free_cycle_time=True)
        model.program.cost[model.CT] = -1.0
        most_s = -model.program.solve(brief(limits)).bound
        if not 0.0 < most_s < cell.cycle_time_s - TOO_SHORT_S:
            continue
        by = f" of robot {cell.robots[robots[0]].name}" if robots else ""
        if not robots and (forced := _forced(model, -most_s, limits)):
            by = f", which is forced {forced}"
        problem = f"the cycle time {cell.cycle_time_s:.6g} s is longer than the slowest cycle{by}"
        return InputError(problem, allowed=f"at most {most_s:.6f} s")
    return None


def _contradiction(lags: Sequence[TimeLag]) -> InputError:
    """Lags that form a cycle on which more time passes than there is, whatever the cycle time."""
    said = _joined((one.first, one.second) for one in lags)
    problem = f"the time lags between activities {said} contradict each other at any cycle time"
    return InputError(problem, allowed="a lag with more cycles, or a shorter one")


def _joined(pairs: Iterable[tuple[str, str]]) -> str:
    """Names of some pairs of activities, in few words: as many as a message has room for."""
    names = [f"{first} and {second}" for first, second in pairs]
    length = np.cumsum([len(name) + 2 for name in names]) - 2
    shown = max(min(int(np.searchsorted(length, _ROOM, side="right")), _SHOWN), 1)
    return ", ".join(names[:shown]) + (f" and {len(names) - shown} more" if len(names) > shown else "")


def _forced(model: CellModel, best: float, limits: Limits) -> str:
    """What between robots a shortest or longest cycle is forced by, for a message; empty if it was not found.

    Args:
        model: Of all robots with a free cycle time.
        best: The least value of its objective. [s]
        limits: When to end, threads and seed of the solver.
    """
    if lags := _binding(model, limits):
        return f"by time lags between activities {lags}"
    poses = _joined((one.first, one.second) for one in binding_handovers(model, best, limits))
    return f"by hand-over locations of activities {poses}" if poses else ""


def _binding(model: CellModel, limits: Limits) -> str:
    """Activities of the time lags that hold the cycle time up, for the choices of the least one."""
    program = model.program
    found = program.solve(brief(limits))
    if found.values is None:
        return ""
    whole = np.flatnonzero(program.integer)
    fixed = program.solve(brief(limits), relaxed=True, fixed=(whole, np.round(found.values[whole])))
    if fixed.duals is None:
        return ""
    pairs = zip(model.lag_rows, model.parts.lags, strict=True)
    return _joined(_names(model.numbers, lag) for row, lag in pairs if abs(fixed.duals[row]) > 1e-7)


def _names(numbers: Numbering, lag: Lag) -> tuple[str, str]:
    ends = ((lag.first, lag.first_move), (lag.second, lag.second_move))
    first, second = (numbers.static_names[v] if e < 0 else numbers.dynamic_names[e] for v, e in ends)
    return first, second
