"""How the commands of this package end: with one sentence, and exit code 2 where the input is at fault."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

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
    except KeyboardInterrupt:
        print(f"{command}: interrupted", file=sys.stderr)
        raise SystemExit(130) from None
