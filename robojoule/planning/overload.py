"""Torques beyond the peak limits, for those who know that their arm bears them.

An arm may bear more than its file says: the balancer of joint 2 is left out of the catalog, say. With an overload of p
percent, motions are possible whose torques exceed the peak limits by up to p percent. Accelerations stay those of the
limits as they are.
"""

from __future__ import annotations

from dataclasses import replace

from robojoule.errors import InputError
from robojoule.inputs import as_number
from robojoule.planning.cycle_run import CycleRun
from robojoule.robots.robot import Robot

MOST_OVERLOAD_PERCENT = 200.0
ROUNDING_PERCENT = 0.1  # by which a torque may exceed a limit that accelerations use up


def check_overload(value: object) -> float:
    """An overload that may be allowed. [%]

    Raises:
        InputError: It is not a number, or out of range.
    """
    return as_number(value, "allow_overload_percent", least=0.0, most=MOST_OVERLOAD_PERCENT, unit="%")


def bearing(robot: Robot, overload_percent: float) -> Robot:
    """The robot with peak limits raised by an overload; what accelerations may use of them stays the same torque."""
    if overload_percent == 0.0:
        return robot
    factor = 1.0 + overload_percent / 100.0
    use, floor = robot.drives.torque_use / factor, robot.drives.torque_floor / factor
    drives = replace(robot.drives, torque_use=use, torque_floor=floor)
    return robot.variant(drives=drives, peak_effort_nm=factor * robot.peak_effort_nm)


def of_the_limits(run: CycleRun, overload_percent: float) -> CycleRun:
    """A run of a robot with raised limits with its torques as ratios to the limits as they are."""
    return replace(run, peak_torque_ratios=run.peak_torque_ratios * (1.0 + overload_percent / 100.0))


def check_torques(run: CycleRun, overload_percent: float) -> None:
    """Refuse a cycle whose torques exceed the peak limits by more than is allowed.

    Raises:
        InputError: They do; names the worst move.
    """
    ratio_percent = 100.0 * run.peak_torque_ratio
    if ratio_percent <= 100.0 + overload_percent + ROUNDING_PERCENT:
        return
    worst = max(run.moves, key=lambda move: move.peak_torque_ratio)
    raise InputError(
        f"a joint torque of move '{worst.name}' reaches {ratio_percent:.1f} % of its peak limit",
        key="allow_overload_percent",
        allowed=f"up to {100.0 + overload_percent:g} %; a lighter payload or another pose",
    )
