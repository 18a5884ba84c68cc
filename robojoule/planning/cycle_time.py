"""The cycle time that a user asks for: seconds, or more than the program takes."""

from __future__ import annotations

import math

from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.inputs import LONGEST_S, number_of, real, shown
from robojoule.planning.schedule import CYCLE_TIME_TOLERANCE_S


def reserve_s(asked: float | str, cycle_time_s: float) -> float:
    """Slack to keep at the end of a cycle. [s]

    Args:
        asked: Seconds (0.1 or "0.1s"), or a share of the cycle time ("1%").
        cycle_time_s: The cycle time. [s]

    Raises:
        InputError: Neither of both, negative, or as long as the cycle.
    """
    text = asked.strip() if isinstance(asked, str) else ""
    try:
        value = number_of(text.removesuffix("%").removesuffix("s").strip()) if text else real(asked)
    except ValueError:
        value = math.nan
    seconds = value * cycle_time_s / 100.0 if text.endswith("%") else value
    if not 0.0 <= seconds < cycle_time_s:
        problem = f"{shown(asked)} is not a valid reserve"
        raise InputError(
            problem, key="reserve", allowed="seconds (0.1s) or a share of the cycle time (1%), less than it"
        )
    return abs(seconds)  # -0 is none


def cycle_time_s(asked: float | str, *, given_s: float, least_s: float, faster_s: float | None = None) -> float:
    """Cycle time in seconds, at least the least one.

    Args:
        asked: Seconds (7.5 or "7.5"), or a share above the program's cycle time ("+10%").
        given_s: Cycle time of the program as given. [s]
        least_s: Least feasible cycle time. [s]
        faster_s: That with moves faster than the program's speed limits allow, for the message. [s]

    Raises:
        InputError: Neither of both, not positive, or longer than a day.
        CycleTimeTooShort: Shorter than the least one by more than rounding.
    """
    text = asked.strip() if isinstance(asked, str) else ""
    relative = text.startswith("+") and text.endswith("%")
    try:
        value = number_of((text[1:-1] if relative else text).replace("+", "?"), math.inf) if text else real(asked)
    except ValueError:  # "+10" alone may mean either
        value = math.nan
    if not 0.0 <= value < math.inf or (value == 0.0 and not relative):
        allowed = "seconds (7.5), or a share above the program's own cycle time (+10%)"
        raise InputError(f"{shown(asked)} is not a valid cycle time", key="cycle_time", allowed=allowed)
    seconds = given_s * (1.0 + value / 100.0) if relative else value
    if seconds > LONGEST_S:
        problem = f"{shown(asked)}, which is {seconds:.6g} s, is too long for a cycle"
        raise InputError(problem, key="cycle_time", allowed=f"at most {LONGEST_S:g} s")
    if seconds < least_s - CYCLE_TIME_TOLERANCE_S:
        raise CycleTimeTooShort(seconds, least_s, faster_s)
    return max(seconds, least_s)
