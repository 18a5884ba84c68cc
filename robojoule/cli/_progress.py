"""A sign of life from commands that take long, on terminals alone."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread

SILENT_S = 2.0  # before anything is shown
_EVERY_S = 0.5


@contextmanager
def sign_of_life(name: str) -> Iterator[None]:
    """Tell on the error output how long a command has been at work, once that is long; the line goes when it ends.

    Args:
        name: Name of the command.
    """
    if sys.stderr is None or not sys.stderr.isatty():
        yield
        return
    ended = Event()
    thread = Thread(target=_tell, args=(name, time.monotonic(), ended), daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _tell(name: str, since: float, ended: Event) -> None:
    if ended.wait(SILENT_S):
        return
    width = 0
    while True:
        text = f"{name}: at work for {time.monotonic() - since:.0f} s"
        width = max(width, len(text))
        print(f"\r{text}", end="", file=sys.stderr, flush=True)
        if ended.wait(_EVERY_S):
            break
    print(f"\r{' ' * width}\r", end="", file=sys.stderr, flush=True)
