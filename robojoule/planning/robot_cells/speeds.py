"""Runs at the whole percents that a controller takes, near a plan: what a cell may choose from in its second round."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robojoule.planning.cells.plan import CellPlan
from robojoule.planning.robot_cells.cell_model import CellWork, Variants
from robojoule.planning.robot_cells.work import RobotWork
from robojoule.profile.piecewise import PiecewiseLinearProfile

_BELOW, _ABOVE = 2, 2  # whole percents beside the planned speed limit
_WIDE = 8  # beside it where those do not do
_SLOWER = (0.85, 0.7, 0.5)  # of the planned speed limit: further ones, where the power of the cell is bounded
_SAME_S = 1e-9


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs that a cell may choose from.

    Attributes:
        variants: Energy and duration of each, by robot and motion.
        speed_limits: Speed limit of each, by the names of the activity and of the movement, fractions in (0, 1].
        peaks_w: Their largest power. [W]
        rows: Their motions.
    """

    variants: Variants
    speed_limits: Mapping[tuple[str, str], float]
    peaks_w: Mapping[tuple[str, str], float]
    rows: Mapping[tuple[str, str], int]


def whole_runs(work: CellWork, plan: CellPlan, *, wide: bool = False, slower: bool = False) -> Runs:
    """Runs near a plan on convex profiles, in the poses that it chose.

    Args:
        work: The cell.
        plan: The plan.
        wide: Whether to go further away from the plan.
        slower: Whether to add much slower runs.
    """
    variants: dict[tuple[int, int], list[tuple[str, PiecewiseLinearProfile]]] = {}
    limits: dict[tuple[str, str], float] = {}
    peaks: dict[tuple[str, str], float] = {}
    rows: dict[tuple[str, str], int] = {}
    planned = {(step.activity, step.option): step.duration_s for step in plan.steps if step.mode is None}
    for r, robot in enumerate(work.works):
        names = [(robot.activity(one.move), one.name) for one in robot.motions]
        used = [row for row, name in enumerate(names) if name in planned]
        durations = np.array([planned[names[row]] for row in used])
        for row, tried in zip(used, _tried(robot, used, durations, wide=wide, slower=slower), strict=True):
            one = robot.paths.subset(np.array([row])).simulate(tried)
            seen: list[float] = []
            for k, limit in enumerate(tried.tolist()):
                seconds = float(one.duration_s[0, k])
                if any(abs(seconds - other) < _SAME_S for other in seen):
                    continue
                seen.append(seconds)
                activity, pose = names[row]
                name = f"{pose} at {100.0 * limit:.6g} %"
                profile = PiecewiseLinearProfile(one.duration_s[0, k : k + 1], one.energy_j[0, k : k + 1])
                variants.setdefault((r, row), []).append((name, profile))
                limits[activity, name] = limit
                peaks[activity, name] = float(one.peak_power_w[0, k])
                rows[activity, name] = row
    return Runs(variants, limits, peaks, rows)


def exact_runs(work: CellWork, plan: CellPlan) -> Runs:
    """The runs of a plan on convex profiles themselves, at speed limits that need not be whole percents."""
    limits: dict[tuple[str, str], float] = {}
    rows: dict[tuple[str, str], int] = {}
    planned = {(step.activity, step.option): step.duration_s for step in plan.steps if step.mode is None}
    for robot in work.works:
        names = [(robot.activity(one.move), one.name) for one in robot.motions]
        used = [row for row, name in enumerate(names) if name in planned]
        part = robot.paths.subset(np.array(used))
        low, high = (one[used] for one in robot.speed_range)
        least = part.durations(high[:, None])[:, 0]
        durations = np.maximum([planned[names[row]] for row in used], least)
        exact = np.clip(part.speed_limits_for_durations(durations), low, high)
        limits |= {names[row]: float(limit) for row, limit in zip(used, exact, strict=True)}
        rows |= {names[row]: row for row in used}
    return Runs({}, limits, {}, rows)


def _tried(robot: RobotWork, rows: list[int], durations_s: np.ndarray, *, wide: bool, slower: bool) -> list[np.ndarray]:
    """Speed limits of each motion that are tried, the lowest first."""
    part = robot.paths.subset(np.array(rows))
    low, high = (one[rows] for one in robot.speed_range)
    least = part.durations(high[:, None])[:, 0]
    exact = np.clip(part.speed_limits_for_durations(np.maximum(durations_s, least)), low, high)
    found = []
    for planned, lowest, highest in zip(100.0 * exact, 100.0 * low, 100.0 * high, strict=True):
        middle = round(planned) if abs(planned - round(planned)) < 1e-6 else int(np.floor(planned))
        below, above = (_WIDE, _WIDE) if wide else (_BELOW, _ABOVE)
        percents = {float(p) for p in range(middle - below, middle + above + 1)}
        if slower:
            percents |= {float(np.floor(share * planned)) for share in _SLOWER}
        if wide or middle + above >= highest:
            percents.add(float(highest))
        kept = sorted(p for p in percents if lowest - 1e-9 <= p <= highest + 1e-9) or [float(highest)]
        found.append(np.minimum(np.array(kept) / 100.0, 1.0))
    return found
