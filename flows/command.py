"""How the commands of this package end: with one sentence, and exit code 2 where the input is at fault."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType

from robojoule.errors import InputError, RobojouleError


@contextmanager
def told(command: str) -> Iterator[None]:
    """End the process on an error that is meant for people; other errors are faults and keep their traceback.

    Args:
        command: Its name, which comes before the sentence.
    """
    try:
        yield
    except RobojouleError as error:
        print(f"{command}: {error}", file=sys.stderr)
        raise SystemExit(2 if isinstance(error, InputError) else 1) from None
    except BaseException as error:
        if not _is_interrupt(error):
            raise
        print(f"{command}: interrupted", file=sys.stderr)
        raise SystemExit(130) from None


def tell_interrupts(words: Sequence[str]) -> None:
    """Let Ctrl-C end a command of this package with its sentence also while it loads, which takes seconds.

    Args:
        words: Those by which Python was started.
    """
    if len(words) < 3 or words[1] != "-m" or not words[2].startswith("flows."):
        return
    usual = sys.excepthook

    def told_once(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if _is_interrupt(error):
            print(f"{words[2]}: interrupted", file=sys.stderr)
        else:
            usual(kind, error, trace)

    sys.excepthook = told_once


def _is_interrupt(error: BaseException) -> bool:
    """Whether Ctrl-C is behind an error: pydantic makes a ValueError of what its serializers are interrupted by."""
    return isinstance(error, KeyboardInterrupt) or (isinstance(error, ValueError) and "KeyboardInterrupt" in str(error))
