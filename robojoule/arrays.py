"""Array types that every room uses, and how arrays are made unchangeable."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]


def as_array(values: object, key: str, what: str) -> Array:
    """Numbers in any arrangement as an array of floats; text and booleans do not count.

    Args:
        values: What was given.
        key: How messages name it.
        what: What it should be numbers of, for messages.

    Raises:
        InputError: Something else, or a row is longer than another.
    """
    try:
        given = np.asarray(values)
        kinds = {given.dtype.kind, *("b" for value in np.asarray(values, dtype=object).flat if isinstance(value, bool))}
        if kinds <= set("iuf"):
            return np.asarray(given, dtype=float)
    except (TypeError, ValueError, RecursionError):
        pass
    raise InputError(f"{what} must be numbers", key=key)


def frozen(values: ArrayLike) -> Array:
    """A copy as an array of floats that cannot be written to."""
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


def freeze(instance: DataclassInstance) -> None:
    """Put copies that cannot be written to in place of the arrays of a frozen dataclass."""
    for field in fields(instance):
        value = getattr(instance, field.name)
        if isinstance(value, np.ndarray):
            copied = value.copy()
            copied.setflags(write=False)
            object.__setattr__(instance, field.name, copied)
