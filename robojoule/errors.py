"""Exceptions of robojoule: a small tree, each with the data of its case."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

LONGEST_MESSAGE = 260  # characters: with the name of a command before it, a message stays under 300
_SHORTEST_PART = 40


class RobojouleError(Exception):
    """Base of everything that robojoule raises on purpose; it travels between processes, whatever its arguments."""

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (type(self), self.args, vars(self))


def _restored(kind: type[RobojouleError], said: tuple[Any, ...], state: dict[str, Any]) -> RobojouleError:
    error = kind.__new__(kind, *said)
    vars(error).update(state)
    return error


class InputError(RobojouleError):
    """The user's input cannot be used; the message is one sentence for people.

    Args:
        problem: What is wrong.
        file: File in which it stands.
        key: Place inside the file (dotted key, column, joint).
        allowed: What would be right.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str | Path | None = None,
        key: str | None = None,
        allowed: str | None = None,
    ) -> None:
        self.problem = problem
        self.file = str(file) if file is not None else None
        self.key = key
        self.allowed = allowed
        said, *places, right = _fitting(problem, self.file, key, allowed)
        where = ", ".join(filter(None, places))
        message = f"{where}: {said}" if where else said
        super().__init__(f"{message}; allowed: {right}" if right else message)


class InputErrors(InputError):
    """Several things in the user's input cannot be used; the message is the first one's and counts the others.

    Args:
        errors: Each of them, at least two.
    """

    def __init__(self, errors: Sequence[InputError]) -> None:
        first = errors[0]
        self.errors = tuple(errors)
        problem = f"{first.problem} (and {len(errors) - 1} more)"
        super().__init__(problem, file=first.file, key=first.key, allowed=first.allowed)


def refuse(errors: Sequence[InputError]) -> None:
    """Raise what was found, if anything was: one error as it is, several as `InputErrors`."""
    if errors:
        raise errors[0] if len(errors) == 1 else InputErrors(errors)


def each_of(error: InputError) -> tuple[InputError, ...]:
    """The single findings of an error."""
    return error.errors if isinstance(error, InputErrors) else (error,)


def _fitting(*parts: str | None) -> list[str]:
    """Problem, file and other parts of a message on one line, control characters escaped, cut until they fit.

    The name of the file is cut first, then the longest part.
    """
    texts = ["".join(c if c.isprintable() else ascii(c)[1:-1] for c in part or "") for part in parts]
    while (excess := sum(map(len, texts)) - LONGEST_MESSAGE) > 0:
        place = 1 if len(texts[1]) > _SHORTEST_PART else max(range(len(texts)), key=lambda i: len(texts[i]))
        kept = max(len(texts[place]) - excess, _SHORTEST_PART) - 3
        texts[place] = f"{texts[place][: kept // 2]}...{texts[place][-(kept - kept // 2) :]}"
    return texts


class MissingPackage(InputError):
    """What was asked for needs a package that is not installed.

    Args:
        purpose: What needs it.
        package: Name of the package.
        extra: Extra of robojoule that brings it; None: the package comes with robojoule where there are wheels of it.
    """

    def __init__(self, purpose: str, package: str, extra: str | None = None) -> None:
        self.package = package
        mend = f": pip install 'robojoule[{extra}]'" if extra else " or cannot be loaded here"
        super().__init__(f"{purpose} needs {package}, which is not installed{mend}")


def require_package(package: str, extra: str, purpose: str) -> None:
    """Raise `MissingPackage` where an optional package is not installed; nothing is imported."""
    if find_spec(package) is None:
        raise MissingPackage(purpose, package, extra)


class CycleTimeTooShort(InputError):
    """The requested cycle time is shorter than the fastest cycle.

    Args:
        requested_s: Cycle time asked for. [s]
        minimum_s: Least feasible cycle time. [s]
        faster_s: That with moves faster than the program's speed limits allow, where these bound it. [s]
        forced: What forces it, such as "by robot R1".
    """

    def __init__(
        self, requested_s: float, minimum_s: float, faster_s: float | None = None, *, forced: str = ""
    ) -> None:
        self.requested_s = requested_s
        self.minimum_s = minimum_s
        self.faster_s = faster_s
        self.forced = forced
        bounded = faster_s is not None and faster_s < minimum_s - 1e-6
        within = " within the program's speed limits" if bounded else ""
        reason = f", which is forced {forced}" if forced else ""
        super().__init__(
            f"the cycle time {requested_s:.6g} s is shorter than the fastest cycle{within}{reason}",
            allowed=f"at least {minimum_s:.6f} s"
            + (f", or {faster_s:.6f} s if moves may be faster" if bounded else ""),
        )


class PlanningError(RobojouleError):
    """The solver did not return a proven plan; carries the case."""
