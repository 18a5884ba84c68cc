"""Exceptions of robojoule: a small tree, each with the data of its case."""

from __future__ import annotations

from pathlib import Path


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
        where = ", ".join(part for part in (self.file, key) if part)
        message = f"{where}: {problem}" if where else problem
        super().__init__(f"{message}; allowed: {allowed}" if allowed else message)


class CycleTimeTooShort(InputError):
    """The requested cycle time is shorter than the fastest cycle.

    Args:
        requested_s: Cycle time asked for. [s]
        minimum_s: Least feasible cycle time. [s]
    """

    def __init__(self, requested_s: float, minimum_s: float) -> None:
        self.requested_s = requested_s
        self.minimum_s = minimum_s
        super().__init__(
            f"the cycle time {requested_s:.6g} s is shorter than the fastest cycle",
            allowed=f"at least {minimum_s:.6f} s",
        )


class PlanningError(RobojouleError):
    """The solver did not return a proven plan; carries the case."""


class MissingPackage(RobojouleError):
    """Something needs a package that is not installed.

    Args:
        package: Its name, as installers know it.
        what: What needs it.
    """

    def __init__(self, package: str, what: str) -> None:
        self.package = package
        super().__init__(f"{what} needs the package '{package}', which is not installed or cannot be loaded here")
