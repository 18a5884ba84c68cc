"""Radians as the degrees that they were written in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence


def in_exact_degrees(radians: Iterable[Sequence[float]]) -> list[list[float]] | None:
    """Positions in degrees, the shortest numbers that read as the very same radians; None where one has none."""
    degrees = [[_degrees(value) for value in row] for row in radians]
    exact = [[value for value in row if value is not None] for row in degrees]
    return exact if exact == degrees else None


def _degrees(radians: float) -> float | None:
    numbers = (float(f"{math.degrees(radians):.{digits}g}") for digits in range(1, 18))
    return next((number for number in numbers if math.radians(number) == radians), None)
