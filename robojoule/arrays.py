"""Array types that every room uses, and how arrays are made unchangeable."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.errors import InputError

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
