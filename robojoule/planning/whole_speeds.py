"""Plans in the speed limits that a controller takes: whole percents, or whole steps of another size.

A plan on continuous speed limits says where to look. Rounding each limit up would keep the cycle time, but waste what
all of them gain in sum. Instead, one of the possible speed limits of each motion is chosen so that the sum of durations
keeps within the cycle time and the energy is least (see `robojoule.planning.choice`), whatever the shape of the
profiles: those that the profiles above and below leave open are simulated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import PlanningError
from robojoule.inputs import as_number
from robojoule.planning.batch import TreeBatch
from robojoule.planning.choice import Choice, least_cost_choice, within_gap
from robojoule.planning.graph import process_energy_j
from robojoule.planning.schedule import Schedule
from robojoule.profile.adaptive import AdaptiveProfiles
from robojoule.profile.piecewise import PiecewiseLinearProfile
from robojoule.profile.source import ProfileSource

SPEED_STEP_PERCENT = 1.0  # what controllers take: whole percents
CHOICE_GAP = 2e-6  # of a plan's energy, by which a better one may be missed
WAITS_PER_S = 1e9  # steps of waits as they are written
_STEP_BOUNDS_PERCENT = (0.01, 50.0)
_SAME_SHARE = 1e-9  # of a step: rounding of percents


@dataclass(frozen=True, eq=False)
class WholeSpeeds:
    """A schedule whose motions run at speed limits that the controller takes.

    Attributes:
        schedule: The schedule; `bound_j` bounds the energy of all such schedules.
        speed_limits: Speed limit of each motion, shape (V,), fractions in (0, 1].
    """

    schedule: Schedule
    speed_limits: Array


def check_speed_step(value: object) -> float:
    """A step of speed limits that can be planned with. [%]

    Raises:
        InputError: It is not a number, or out of range.
    """
    least, most = _STEP_BOUNDS_PERCENT
    return as_number(value, "speed_step", least=least, most=most, unit="%")


def speed_choices(batch: TreeBatch, step_percent: float) -> list[Array]:
    """Speed limits from which each motion's may be chosen: whole steps in its range, and the highest, as it is given.

    Of those that give the fastest run the highest one stands for all.

    Args:
        batch: Trees.
        step_percent: Step of speed limits. [%]

    Returns:
        Fractions in (0, 1], rising, M arrays.
    """
    found = []
    for low, top, high in zip(batch.speed_range[0], batch.saturating_speed_limits, batch.speed_range[1], strict=True):
        first = int(np.ceil(100.0 * low / step_percent - _SAME_SHARE))
        last = int(np.floor(100.0 * min(top, high) / step_percent + _SAME_SHARE))
        # Nearest decimals, so that 29 % is written as 29.
        limits = np.array([round(step * step_percent, 9) / 100.0 for step in range(first, last + 1)])
        found.append(np.append(limits[limits < min(top, high) - _SAME_SHARE], high))
    return [limits if moves else limits[-1:] for limits, moves in zip(found, batch.paths.moving, strict=True)]


def whole_speed_plan(
    source: ProfileSource, batch: TreeBatch, plan: Schedule, *, step_percent: float = SPEED_STEP_PERCENT
) -> WholeSpeeds:
    """The schedule with the least energy in whole speed limits, for the cycle time of a plan.

    Args:
        source: Profiles that the plan was made on; simulated ones are simulated where they leave a choice open.
        batch: The one tree that was planned.
        plan: Plan with continuous speed limits.
        step_percent: Step of speed limits. [%]

    Raises:
        PlanningError: No choice keeps the cycle time.
    """
    graph = batch.graphs[0]
    limits = speed_choices(batch, step_percent)
    durations = _ragged(batch.paths.durations(_table(limits)), limits)
    required = np.array([[v.least_prior_wait_s, v.least_post_wait_s] for v in graph.vertices])
    idle = np.stack([source.idle_start_w, source.idle_end_w], axis=1)
    place = np.unravel_index(int(idle.argmin()), idle.shape)
    idle_w, budget = float(idle[place]), plan.cycle_time_s - float(required.sum())
    steady_j = float((required * idle).sum()) + process_energy_j(batch.trees[0]) + idle_w * budget

    known = [source.enclosure(motion) for motion in range(batch.paths.motions)]
    costs = [_value(one.above, d) - idle_w * d for one, d in zip(known, durations, strict=True)]
    tolerance_j = CHOICE_GAP * abs(plan.energy_j)
    choice = _chosen(least_cost_choice(durations, costs, budget, tolerance_j=tolerance_j))
    if isinstance(source, AdaptiveProfiles):
        lowest = [_value(one.below, d) - idle_w * d for one, d in zip(known, durations, strict=True)]
        at = [one[[k]] for one, k in zip(limits, choice.options, strict=True)]
        taken = sum(float(d[k]) for d, k in zip(durations, choice.options, strict=True))
        reached_j = float(batch.paths.simulate(_table(at)).energy_j.sum()) - idle_w * taken
        left = within_gap(durations, lowest, budget, cost_j=reached_j + tolerance_j)
        left = [np.union1d(open_, [k]) for open_, k in zip(left, choice.options, strict=True)]
        limits, durations = ([one[k] for one, k in zip(of, left, strict=True)] for of in (limits, durations))
        energies = _ragged(batch.paths.simulate(_table(limits)).energy_j, limits)
        costs = [e - idle_w * d for e, d in zip(energies, durations, strict=True)]
        choice = _chosen(least_cost_choice(durations, costs, budget, tolerance_j=tolerance_j))
    chosen_s = np.array([d[k] for d, k in zip(durations, choice.options, strict=True)])
    waits = required.copy()
    # Rounded down, as it is to be read by people.
    waits[place] += np.floor(max(budget - float(chosen_s.sum()), 0.0) * WAITS_PER_S) / WAITS_PER_S
    ends = np.cumsum(waits.sum(axis=1) + chosen_s)
    schedule = replace(
        plan,
        cycle_time_s=float(ends[-1]),
        durations_s=chosen_s,
        prior_waits_s=waits[:, 0],
        post_waits_s=waits[:, 1],
        collision_waits_s=np.zeros(len(chosen_s)),
        starts_s=ends - waits[:, 1] - chosen_s,
        energy_j=choice.cost_j + steady_j,
        bound_j=choice.bound_j + steady_j,
    )
    return WholeSpeeds(schedule, np.array([one[k] for one, k in zip(limits, choice.options, strict=True)]))


def _chosen(choice: Choice | None) -> Choice:
    if choice is None:
        raise PlanningError("no speed limits of this step keep the cycle time")
    return choice


def _table(limits: list[Array]) -> Array:
    """Rows of different lengths as one table, each filled up with its last value."""
    width = max(row.size for row in limits)
    return np.array([np.append(row, np.full(width - row.size, row[-1])) for row in limits])


def _ragged(table: Array, limits: list[Array]) -> list[Array]:
    """The rows of a table of `_table` in their own lengths."""
    return [row[: limit.size] for row, limit in zip(table, limits, strict=True)]


def _value(profile: PiecewiseLinearProfile, durations_s: Array) -> Array:
    """Energies of a profile, which leaves out runs nearer to others than rounding. [J]"""
    return profile.value(np.clip(durations_s, profile.d_min_s, profile.d_max_s))
