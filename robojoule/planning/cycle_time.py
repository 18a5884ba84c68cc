"""The cycle time that a user asks for: seconds, or more than the program takes."""

from __future__ import annotations

import math

from robojoule.errors import CycleTimeTooShort, InputError
from robojoule.planning.schedule import CYCLE_TIME_TOLERANCE_S


def cycle_time_s(asked: float | str, *, given_s: float, least_s: float) -> float:
    """Cycle time in seconds, at least the least one.

    Args:
        asked: Seconds (7.5 or "7.5"), or a share above the program's cycle time ("+10%").
        given_s: Cycle time of the program as given. [s]
        least_s: Least feasible cycle time. [s]

    Raises:
        InputError: Neither of both, or not positive.
        CycleTimeTooShort: Shorter than the least one by more than rounding.
    """
    text = str(asked).strip()
    relative = text.startswith("+") and text.endswith("%")
    try:
        value = float(text[1:-1] if relative else text.replace("+", "?"))  # "+10" alone may mean either
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0.0 or (value == 0.0 and not relative):
        allowed = "seconds (7.5), or a share above the program's own cycle time (+10%)"
        raise InputError(f"'{asked}' is not a valid cycle time", key="cycle_time", allowed=allowed)
    seconds = given_s * (1.0 + value / 100.0) if relative else value
    if seconds < least_s - CYCLE_TIME_TOLERANCE_S:
        raise CycleTimeTooShort(seconds, least_s)
    return max(seconds, least_s)
