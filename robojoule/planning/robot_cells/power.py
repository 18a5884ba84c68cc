"""A largest power of all robots of a cell: the largest powers of what takes place at the same time must not exceed it.

The sum of the largest powers of motions and of standing is an upper bound of the power at every time. Runs that exceed
the limit even while all other robots stand as cheaply as they can are left out. Where a plan exceeds it, two of the
activities that do so together are kept apart at all speeds at which they would: the plan that is found in the end keeps
within the limit, but a better one may be missed, as another two might have been kept apart. A process step that
exceeds the limit while the motors hold the robot is done in a standby mode: the robot stands long enough for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robojoule.errors import InputError, PlanningError
from robojoule.planning.cells.plan import CellPlan, Step
from robojoule.planning.robot_cells.cell_model import CellWork
from robojoule.planning.robot_cells.shared_space import Pairs
from robojoule.planning.robot_cells.speeds import Runs
from robojoule.programs.cell import Choice

_ROUNDING = 1e-9
_SAME_S = 1e-9


def check_standing(work: CellWork, limit_w: float) -> None:
    """Whether standing allows the limit, process steps included, at the cheapest pose and mode of every robot.

    Raises:
        InputError: It does not; names the least power that it needs, and what for.
    """
    least = [_least_standing_w(work, r) for r in range(len(work.works))]
    if sum(least) > limit_w:
        problem = f"all robots together draw {sum(least):.0f} W even while they stand"
        raise InputError(problem, key="peak_power_w", allowed=f"at least {sum(least):.0f} W")
    needs = []
    for r, robot in enumerate(work.works):
        for i, one in enumerate(robot.standstills):
            own = min(min(robot.powers_w(i, pose).values()) for pose in robot.poses_rad[i]) + one.most_process_w
            needs.append((own + sum(least) - least[r], r, robot.moves[i].name))
    needed, r, name = max(needs)
    if needed > limit_w:
        problem = f"the process steps after move '{name}' exceed the power even while all other robots stand"
        where = f"robot {work.cell.robots[r].name}"
        raise InputError(problem, key=where, allowed=f"peak_power_w of at least {needed:.0f} W")


def least_standing_s(work: CellWork, limit_w: float) -> dict[str, float]:
    """How long robots stand at least where only standby modes keep within the limit, by the names of standstills. [s]

    That is while all other robots stand as cheaply as they can. A mode costs less than the motors, so a plan chooses it
    where a robot stands so long.
    """
    least = [_least_standing_w(work, r) for r in range(len(work.works))]
    found = {}
    for r, robot in enumerate(work.works):
        idle_s = {mode.name: mode.least_idle_s for mode in robot.modes}
        for i, one in enumerate(robot.standstills):
            rest = sum(least) - least[r] + one.most_process_w
            allowed = [
                idle_s[mode]
                for pose in robot.poses_rad[i]
                for mode, power in robot.powers_w(i, pose).items()
                if power + rest <= limit_w
            ]
            if min(allowed, default=0.0) > 0.0:
                found[one.name] = min(allowed)
    return found


def within_power(work: CellWork, runs: Runs, limit_w: float) -> Runs:
    """Runs that the limit allows while all other robots stand as cheaply as they can.

    Raises:
        InputError: All runs of a motion exceed it; names the least power that is feasible.
    """
    least = [_least_standing_w(work, r) for r in range(len(work.works))]
    kept = {}
    for (r, row), variants in runs.variants.items():
        robot = work.works[r]
        activity = robot.activity(robot.motions[row].move)
        rest = sum(least) - least[r]
        kept[r, row] = [one for one in variants if runs.peaks_w[activity, one[0]] + rest <= limit_w]
        if not kept[r, row]:
            needed = min(runs.peaks_w[activity, name] for name, _ in variants) + rest
            problem = f"move '{robot.moves[robot.motions[row].move].name}' exceeds the power at its least speed"
            raise InputError(problem, key=f"robot {robot.name}", allowed=f"peak_power_w of at least {needed:.0f} W")
    return Runs(kept, runs.speed_limits, runs.peaks_w, runs.rows)


def _least_standing_w(work: CellWork, r: int) -> float:
    """Least power of a robot that stands. [W]"""
    robot = work.works[r]
    return min(min(robot.powers_w(i, pose).values()) for i, poses in enumerate(robot.poses_rad) for pose in poses)


def keep_apart(work: CellWork, runs: Runs, plan: CellPlan, limit_w: float) -> Pairs:
    """What must not take place at the same time so that a plan like this keeps within the limit; none if it does.

    Raises:
        PlanningError: A single robot exceeds it.
    """
    found: dict[tuple[Choice, Choice], None] = {}
    standing = _standing_w(work)
    for together in _together(plan):
        drawn = [_peak_w(step, runs, standing) for step in together]
        if sum(drawn) <= limit_w * (1.0 + _ROUNDING):
            continue
        if len(together) < 2:
            problem = f"activity {together[0].activity} draws {drawn[0]:.0f} W by itself in the best plan"
            raise PlanningError(f"no plan was found that keeps within {limit_w:g} W: {problem}")
        order = sorted(range(len(together)), key=lambda i: -drawn[i])
        first, second = order[0], order[1]
        rest = sum(drawn) - drawn[first] - drawn[second]
        for one, one_w in _options(together[first], runs, standing, drawn[first]):
            for two, two_w in _options(together[second], runs, standing, drawn[second]):
                if one_w + two_w + rest > limit_w:
                    found[one, two] = None
    return tuple(found)


def _together(plan: CellPlan) -> Sequence[Sequence[Step]]:
    """What takes place at the same time, one activity of each robot, for every time at which that changes."""
    cycle = plan.cycle_time_s
    found = []
    for step in plan.steps:
        at = step.start_s + _SAME_S
        found.append([one for one in plan.steps if (at - one.start_s) % cycle < one.duration_s])
    return found


def _standing_w(work: CellWork) -> Mapping[tuple[str, str, str], float]:
    """Largest power of standing with its process steps, by activity, pose and mode. [W]"""
    return {
        (one.name, pose, mode): power + one.most_process_w
        for robot in work.works
        for i, one in enumerate(robot.standstills)
        for pose in robot.poses_rad[i]
        for mode, power in robot.powers_w(i, pose).items()
    }


def _peak_w(step: Step, runs: Runs, standing: Mapping[tuple[str, str, str], float]) -> float:
    if step.mode is None:
        return runs.peaks_w[step.activity, step.option]
    return standing[step.activity, step.option, step.mode]


def _options(
    step: Step, runs: Runs, standing: Mapping[tuple[str, str, str], float], drawn_w: float
) -> list[tuple[Choice, float]]:
    """The runs that might take the place of one, with their largest power [W]; of standing that itself."""
    if step.mode is not None:
        return [(Choice(step.activity, step.option), drawn_w)]
    return [
        (Choice(activity, name), peak) for (activity, name), peak in runs.peaks_w.items() if activity == step.activity
    ]
