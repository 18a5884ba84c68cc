"""Exceptions of robojoule: a small tree, each with the data of its case."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

LONGEST_MESSAGE = 260  # characters: with the name of a command before it, a message stays under 300
_SHORTEST_PART = 40


class RobojouleError(Exception):
    """Base of everything that robojoule raises on purpose."""


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
        forced: What forces it, such as "by robot R1".
    """

    def __init__(self, requested_s: float, minimum_s: float, forced: str = "") -> None:
        self.requested_s = requested_s
        self.minimum_s = minimum_s
        reason = f", which is forced {forced}" if forced else ""
        super().__init__(
            f"the cycle time {requested_s:.6g} s is shorter than the fastest cycle{reason}",
            allowed=f"at least {minimum_s:.6f} s",
        )


class PlanningError(RobojouleError):
    """The solver did not return a proven plan; carries the case."""
