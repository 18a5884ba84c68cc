"""How far commands that take long are, on terminals alone: one line, which goes when they end."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from shutil import get_terminal_size
from threading import Event, Thread

from robojoule.progress import Progress, telling

SILENT_S = 2.0  # before anything is shown
_EVERY_S = 0.5


@contextmanager
def sign_of_life(name: str) -> Iterator[None]:
    """Tell on the error output how far a command is and how long it will take, once it takes long.

    Args:
        name: Name of the command.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield
        return
    line = _Line(name)
    thread = Thread(target=line.show, daemon=True)
    thread.start()
    try:
        with telling(line.hear):
            yield
    finally:
        line.ended.set()
        thread.join()


class _Line:
    def __init__(self, name: str) -> None:
        self.name = name
        self.ended = Event()
        self._began = time.monotonic()
        self._work: tuple[Progress, float] | None = None  # the last that was heard, and when
        self._first: tuple[Progress, float] | None = None  # the first of this work, likewise

    def hear(self, progress: Progress) -> None:
        now = time.monotonic()
        if self._work is None or self._work[0].work != progress.work or self._work[0].done > progress.done:
            self._first = progress, now
        self._work = progress, now

    def text(self) -> str:
        now = time.monotonic()
        told = f"{self.name}: {now - self._began:.0f} s"
        if self._work is None or self._first is None or self._work[0].done >= self._work[0].total:
            return told
        (progress, heard), (first, began) = self._work, self._first
        left = progress.left_s(heard - began, first.done)
        told += f", {progress.text}"
        return told if left is None else f"{told}, {_duration(max(left - (now - heard), 0.0))} left"

    def show(self) -> None:
        if self.ended.wait(SILENT_S):
            return
        width = 0
        while True:
            text = self.text()[: max(get_terminal_size().columns - 1, 20)]  # a longer one would not go again
            width = max(width, len(text))
            print(f"\r{text:{width}}", end="", file=sys.stderr, flush=True)
            if self.ended.wait(_EVERY_S):
                break
        print(f"\r{' ' * width}\r", end="", file=sys.stderr, flush=True)


def _duration(seconds: float) -> str:
    """A time that nobody knows exactly."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
