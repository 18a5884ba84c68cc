"""Radians as the degrees that they were written in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence


def in_exact_degrees(radians: Iterable[Sequence[float]]) -> list[list[float]] | None:
    """Positions in degrees, the shortest numbers that read as the very same radians.

    Returns:
        None where one has none, or where radians are shorter to write: they were not made from degrees.
    """
    rows = [list(row) for row in radians]
    degrees = [[_degrees(value) for value in row] for row in rows]
    exact = [[value for value in row if value is not None] for row in degrees]
    return exact if exact == degrees and _length(exact) <= _length(rows) else None


def _length(rows: Iterable[Iterable[float]]) -> int:
    """Number of characters that numbers take."""
    return sum(len(repr(value)) for row in rows for value in row)


def _degrees(radians: float) -> float | None:
    numbers = (float(f"{math.degrees(radians):.{digits}g}") for digits in range(1, 18))
    return next((number for number in numbers if math.radians(number) == radians), None)
