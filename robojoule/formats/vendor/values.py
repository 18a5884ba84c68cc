"""Values of vendors' programs as far as constants reach: numbers that know where they stand, and what is not known."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from robojoule.formats.vendor.text import Span


class Unknowable:
    """A value that is known at run time only."""

    def __repr__(self) -> str:
        return "unknown"


UNKNOWN = Unknowable()


@dataclass(frozen=True)
class Number:
    """A number.

    Attributes:
        value: The number.
        origin: Where it stands as a literal; None: it was computed.
        is_whole: Whether the language takes it for an integer.
    """

    value: float
    origin: Span | None = None
    is_whole: bool = False


Value = Any  # Number, bool, str, mapping of fields, or UNKNOWN


def unplaced(value: Value) -> Value:
    """A value as a variable holds it: whoever changes a number where it stands changes all that uses the variable."""
    return Number(value.value, None, value.is_whole) if isinstance(value, Number) else value


def computed(first: Value, second: Value, rule: Callable[[float, float], float]) -> Value:
    """A sum, product ... of two numbers; unknown where one of them is, or where it cannot be computed."""
    if not (isinstance(first, Number) and isinstance(second, Number)):
        return UNKNOWN
    try:
        value = float(rule(first.value, second.value))
    except (ZeroDivisionError, OverflowError, ValueError):
        return UNKNOWN
    if not math.isfinite(value):
        return UNKNOWN
    return Number(value, None, first.is_whole and second.is_whole)


def logic(kind: str, first: Value, second: Value) -> Value:
    """op_and, op_or or op_xor of two values; a side that is not known does not matter where the other one decides."""
    if kind == "op_and" and (first is False or second is False):
        return False
    if kind == "op_or" and (first is True or second is True):
        return True
    if not (isinstance(first, bool) and isinstance(second, bool)):
        return UNKNOWN
    return {"op_and": first and second, "op_or": first or second, "op_xor": first is not second}.get(kind, UNKNOWN)


def number(value: Value) -> float | None:
    """The number that a value is, if it is one and known."""
    return value.value if isinstance(value, Number) else None


def numbers(fields: Mapping[str, Value], *names: str) -> tuple[float | None, ...] | None:
    """Fields of a mapping as numbers, None for those that are missing; None if one of them is not known."""
    found = [fields.get(name) for name in names]
    if any(value is not None and not isinstance(value, Number) for value in found):
        return None
    return tuple(number(value) for value in found)
