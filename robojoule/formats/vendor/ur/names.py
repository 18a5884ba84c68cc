"""Variables of URScript: those of all functions, and those that a function has for itself."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from robojoule.formats.vendor.values import UNKNOWN, Number, Value


class Names:
    """Values by their names.

    A name without `global` or `local` means the variable of all functions, if there is one; else one of the function's
    own. What the program's own lines set is taken to be known in its functions.
    """

    def __init__(self) -> None:
        self._shared: dict[str, Value] = {"pi": Number(math.pi)}
        self._own: dict[str, Value] = {}
        self._depth = 0
        self._changing: set[str] = set()

    def get(self, name: str) -> Value:
        """What a name means here; `UNKNOWN`: nobody knows."""
        if name in self._own:
            return self._own[name]
        return UNKNOWN if name in self._changing else self._shared.get(name, UNKNOWN)

    def set(self, name: str, value: Value, scope: str = "") -> None:
        """Give a name a value; the scope is `global`, `local`, or empty."""
        is_own = name in self._own or (self._depth > 0 and name not in self._shared)
        values = self._own if scope == "local" or (not scope and is_own) else self._shared
        values[name] = value

    def known(self) -> tuple[dict[str, Value], dict[str, Value]]:
        """Values of all functions' variables and of those of the present function."""
        return dict(self._shared), dict(self._own)

    def forget_shared(self, name: str, *, for_good: bool = False) -> None:
        """The value of a variable of all functions is not known any more; for good: a thread may change it any time."""
        if name in self._shared:
            self._shared[name] = UNKNOWN
        self._changing |= {name} if for_good else set()

    @contextmanager
    def within(self, parameters: Mapping[str, Value]) -> Iterator[None]:
        """Run a function that has these parameters, and names of its own."""
        before = self._own
        self._own = dict(parameters)
        self._depth += 1
        try:
            yield
        finally:
            self._own = before
            self._depth -= 1
