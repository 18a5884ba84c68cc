"""How far long work is: loops inside tell it, and whoever called may listen; nothing is printed here.

A listener is a function of one `Progress`. It hears all work under `telling(listener)` in the same thread, however deep
it is, so that only the doors of the library have an argument for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, TypeVar

from robojoule.errors import InputError
from robojoule.inputs import shown

Item = TypeVar("Item")
_LEAST_SHARE = 0.02  # done before the time left is more than a guess


@dataclass(frozen=True)
class Progress:
    """How far a piece of work is.

    Attributes:
        work: What is being done, such as "profiles of motions".
        done: How much of it is done, of `total`; parts that are half done count as half.
        total: How much there is to do.
    """

    work: str
    done: float
    total: float

    @property
    def text(self) -> str:
        """What is being done and how far it is, for people."""
        return f"{self.work}: {int(self.done)} of {int(self.total)}"

    def left_s(self, elapsed_s: float, done_before: float = 0.0) -> float | None:
        """Time that is left of this work, None while nobody can tell. [s]

        Args:
            elapsed_s: Time since it was first told. [s]
            done_before: How much was done then.
        """
        done = self.done - done_before
        return elapsed_s * (self.total - self.done) / done if done >= _LEAST_SHARE * self.total > 0.0 else None


Listener = Callable[[Progress], None]
_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)
_within: ContextVar[str] = ContextVar("within", default="")


def heard_by(listener: Callable[[Any], None] | None) -> Callable[[Any], None] | None:
    """The listener that is given, or else the one of the work around.

    Raises:
        InputError: It cannot be called.
    """
    if listener is not None and not callable(listener):
        raise InputError(f"{shown(listener)} cannot be called", key="progress", allowed="a function")
    return _listener.get() if listener is None else listener


@contextmanager
def telling(listener: Listener | None) -> Iterator[None]:
    """Let a listener hear the work inside; without one, the listener of the work around hears it.

    Raises:
        InputError: It cannot be called.
    """
    token = _listener.set(heard_by(listener))
    try:
        yield
    finally:
        _listener.reset(token)


@contextmanager
def within(name: str) -> Iterator[None]:
    """Say of all work inside what it belongs to, such as "section 2 of 5"."""
    token = _within.set(f"{_within.get()}{name}, ")
    try:
        yield
    finally:
        _within.reset(token)


def tell(work: str, done: float, total: float) -> None:
    """Tell how far work is, if anybody listens."""
    if (listener := _listener.get()) is not None:
        listener(Progress(f"{_within.get()}{work}", done, total))


def told(work: str, items: Sequence[Item]) -> Iterator[Item]:
    """Items of a loop, each told when it begins, and the end."""
    for done, item in enumerate(items):
        tell(work, done, len(items))
        yield item
    tell(work, len(items), len(items))
