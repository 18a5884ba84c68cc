"""What people hand over, taken or refused in one sentence: numbers, file names, names that must be known."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from difflib import SequenceMatcher
from numbers import Real
from pathlib import Path

from robojoule.errors import InputError

LARGEST = 1e12  # no figure of a robot, a program or a log comes near
LONGEST_S = 86_400.0  # of a cycle, a wait or a step: a day; beyond it a unit or a digit is wrong
_SHOWN = 60  # characters of a value in a message
_ALIKE = 0.6  # from which likeness on a name is offered for another one


def shown(value: object) -> str:
    """A value as messages show it: short, whatever it is."""
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            return f"{float(value):.6g}"
        except OverflowError:
            return "a number without bounds"
    try:
        text = " ".join(repr(value).split())
    except (ValueError, RecursionError):  # it holds an integer of too many digits, or itself
        text = f"something of type {type(value).__name__}"
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def counted(number: int, noun: str) -> str:
    """A number of things: "1 joint", "2 joints"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def real(value: object) -> float:
    """A real number as a float; NaN where it is none, infinity where it is too large. Booleans do not count."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def as_number(value: object, key: str, *, least: float, most: float, unit: str) -> float:
    """A number within bounds.

    Args:
        value: What was given.
        key: How messages name it.
        least: Smallest number that is allowed.
        most: Largest one.
        unit: Their unit, for messages.

    Raises:
        InputError: It is not a number, or not within the bounds.
    """
    number = real(value)
    if not least <= number <= most:
        problem = "is out of range" if math.isfinite(number) else "is not a finite number"
        raise InputError(f"{shown(value)} {problem}", key=key, allowed=f"{least:g} to {most:g} {unit}")
    return number


def as_whole(value: object, key: str, *, least: int, most: int, unit: str = "") -> int:
    """A whole number within bounds; see `as_number`."""
    number = as_number(value, key, least=least, most=most, unit=unit)
    if number != int(number):
        allowed = f"{least} to {most} {unit}".strip()
        raise InputError(f"{shown(value)} is not a whole number", key=key, allowed=allowed)
    return int(number)


def as_flag(value: object, key: str) -> bool:
    """Yes or no; a text such as "no" would count as yes.

    Args:
        value: What was given.
        key: How messages name it.

    Raises:
        InputError: It is neither True nor False.
    """
    if type(value).__name__ in ("bool", "bool_"):  # numpy's too, without loading it here
        return bool(value)
    raise InputError(f"{shown(value)} is neither yes nor no", key=key, allowed="True or False")


def number_of(text: str, most: float = LARGEST) -> float:
    """The number that a text holds: ASCII digits, finite.

    Args:
        text: What was written.
        most: Largest size; what squares of it or sums over it give must stay finite.

    Raises:
        ValueError: It holds something else, or is beyond all bounds; digits of other scripts and Python's groups of
            digits are not meant.
    """
    try:
        value = float(text if text.isascii() and "_" not in text else "")
    except ValueError:
        raise ValueError(f"{shown(text)} is not a number") from None
    if not math.isfinite(value):
        raise ValueError(f"{shown(text)} is not a finite number")
    if abs(value) > most:
        raise ValueError(f"{shown(value)} is beyond all bounds")
    return value


def as_path(value: object, key: str) -> Path:
    """The path that a text or a path names.

    Args:
        value: What was given.
        key: How messages name it.

    Raises:
        InputError: It is neither of both, or no file can have that name.
    """
    name = os.fspath(value) if isinstance(value, (str, os.PathLike)) else None
    if not isinstance(name, str):
        raise InputError(f"{shown(value)} is not the name of a file", key=key, allowed="text or a Path")
    if not name or "\0" in name:
        raise InputError("no file can have this name", file=name, key=key)
    return Path(name)


def unknown_name(what: str, name: str, known: Iterable[str], allowed: str | None = None) -> InputError:
    """The refusal of a name that is not known, with those that look like it.

    Args:
        what: What it should be the name of.
        name: What was given.
        known: Names that there are.
        allowed: What messages say instead of all of them.
    """
    names = list(known)
    alike = sorted((-_likeness(name[:_SHOWN], one), one) for one in names)
    near = [one for likeness, one in alike[:3] if -likeness >= _ALIKE]
    hint = f" (did you mean {' or '.join(near)}?)" if near else ""
    return InputError(f"unknown {what} {shown(name)}{hint}", allowed=allowed or ", ".join(names))


def _likeness(name: str, known: str) -> float:
    """How much a name looks like a known one or like a part of it, 1 being the same. [-]"""
    plain, whole, *parts = ("".join(filter(str.isalnum, text.lower())) for text in (name, known, *known.split("_")))
    if not plain:
        return 0.0
    found = max(SequenceMatcher(None, plain, text).ratio() for text in (whole, *parts))
    return max(found, 0.9) if plain in whole else found
