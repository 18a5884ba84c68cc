"""What running a program has in common in all vendors' languages: its events and notes, its steps, its calls."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from robojoule.errors import InputError
from robojoule.formats.vendor.lines import flaw_of, short
from robojoule.formats.vendor.trace import Blend, Event, Note, Unknown, Wait
from robojoule.formats.vendor.values import Value
from robojoule.formats.vendor.zones import ASSUMED_BLEND

MOST_STEPS = 200_000  # of a program; beyond it a loop was not meant
DEEPEST_CALLS = 50  # of routines within each other


class TooManySteps(InputError):
    """A program does not end within `MOST_STEPS`."""


class Leave(Exception):
    """The end of a loop, a routine or the program, found within it.

    Attributes:
        what: Which of them ends, in the words of the language's machine.
    """

    def __init__(self, what: str) -> None:
        self.what = what


class Running:
    """What a machine has found so far.

    Attributes:
        events: In the order in which they happen.
        notes: By their line and text, so that each is there once.
        steps: How many steps it has done.
        calls: Names of the routines that it is in, the outermost first.
    """

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.notes: dict[tuple[int, str], Note] = {}
        self.steps = 0
        self.calls: list[str] = []

    def note(self, line: int, text: str) -> None:
        """Report something about a line, once."""
        self.notes.setdefault((line, text), Note(line, text))

    def unknown(self, line: int, what: str, *, may_stand: bool = False) -> None:
        """The robot may be anywhere from here on."""
        self.events.append(Unknown(line, what, may_stand))

    def count(self, line: int) -> None:
        """Count one more step: a statement, or a pass of a loop, whose body may be empty.

        Raises:
            TooManySteps: There were too many.
        """
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise TooManySteps(f"the program does not end within {MOST_STEPS} steps", key=f"line {line}")

    def may_call(self, line: int, name: str) -> bool:
        """Whether a routine of the file can be run in its place; if not, the robot may be anywhere behind it."""
        if name in self.calls:
            self.unknown(line, f"{name} calls itself")
        elif len(self.calls) >= DEEPEST_CALLS:
            self.unknown(line, f"{name} is called within more than {DEEPEST_CALLS} other calls, it is not followed")
        else:
            return True
        return False

    def skipped(self, line: int, statement: int, code: str, *, moves: bool, waits: bool) -> None:
        """Tell of statements that run or not, nobody knows; what they set is for the language to forget.

        Args:
            line: Line that decides.
            statement: Its first character.
            code: Its code.
            moves: Whether one of the statements may move the robot, or lead elsewhere.
            waits: Whether one of them may wait.
        """
        text = f"{short(code)}{flaw_of(code)}"
        if moves:
            self.unknown(line, f"whether this runs is not known, it may move the robot: {text}", may_stand=True)
        elif waits:
            self.events.append(Wait(statement, line, None, text))
        else:
            self.note(line, f"whether this runs is not known, it is kept: {text}")

    def note_zone(self, line: int, blend: Blend | None) -> None:
        """Tell that the reach of a motion's zone is assumed, if it is `ASSUMED_BLEND`."""
        if blend is ASSUMED_BLEND:
            self.note(line, "the program does not say how far its zone reaches: taken as half of the way")


@contextmanager
def own_names(values: dict[str, Value], names: Iterable[str]) -> Iterator[None]:
    """Let a routine have names for itself: within, they mean nothing yet; behind it, what they meant before.

    Args:
        values: Values of all variables by their names; elements of arrays may be there as "A[2]".
        names: Names of the routine's parameters and of what it declares.
    """
    own = frozenset(names)
    before = _taken(values, own)
    try:
        yield
    finally:
        _taken(values, own)
        values.update(before)


def _taken(values: dict[str, Value], names: frozenset[str]) -> dict[str, Value]:
    return {key: values.pop(key) for key in [one for one in values if one.partition("[")[0] in names]}
