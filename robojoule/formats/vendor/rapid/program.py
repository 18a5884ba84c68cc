"""RAPID programs: .mod and .prg files, read and written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.vendor.composing import plain
from robojoule.formats.vendor.rapid.machine import ADDED, Machine
from robojoule.formats.vendor.rapid.syntax import routines, statements
from robojoule.formats.vendor.text import Edit, SourceText, Span, read_source
from robojoule.formats.vendor.trace import Beside, Note, Trace, Wish

_DURATION_STEP_S = 1e-5  # of \T: num holds seven digits


class RapidProgram:
    """A parsed RAPID module; see `robojoule.formats.vendor.trace.VendorProgram`."""

    wait_step_s = 1e-3  # the shortest WaitTime

    def __init__(self, source: SourceText) -> None:
        self.sources = (source,)
        self.statements = statements(source)
        self.routines, self.data = routines(self.statements)
        self.procedures = [one for one in self.routines if not (one.is_function or one.is_trap)]
        if not self.procedures:
            allowed = "a module with PROC main, or with one procedure at least"
            raise InputError("the file has no procedure", file=source.path, allowed=allowed)
        self._by_start = {one.start: one for one in self.statements}
        self._machine: Machine | None = None

    @property
    def name(self) -> str:
        """Name of the program: that of its file."""
        return self.sources[0].path.stem

    def trace(self, beside: Beside) -> Trace:
        """See `robojoule.formats.vendor.trace.VendorProgram`: main runs, without one the first procedure."""
        main = next((one for one in self.procedures if one.name == "MAIN"), self.procedures[0])
        machine = Machine(self.routines, self.data, beside)
        machine.run(main)
        self._machine = machine
        notes = list(machine.notes.values())
        if main.name != "MAIN" and len(self.procedures) > 1:
            notes.append(Note(main.line, f"there is no PROC main: {main.name} is planned, other procedures are kept"))
        return Trace(tuple(machine.events), tuple(notes))

    def speed_edits(self, wishes: Mapping[int, Wish]) -> list[Edit]:
        """See `robojoule.formats.vendor.trace.VendorProgram`: durations are said, speeddata being speeds of tools."""
        assert self._machine is not None
        edits = []
        for statement, wish in wishes.items():
            if wish.duration_s is None:  # nothing turns: no duration is needed, and none is said
                continue
            span = self._machine.places[statement]
            text = plain(math.floor(wish.duration_s / _DURATION_STEP_S) * _DURATION_STEP_S, 5)
            edits.append(Edit(span, text if span.end > span.start else rf"\T:={text}"))
        return edits

    def wait_edit(self, statement: int, seconds: float, *, before: bool) -> Edit:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        one, source = self._by_start[statement], self.sources[0]
        text, end = source.text, source.line_end
        first = text.rfind("\n", 0, one.start) + 1
        indent = text[first : one.start] if not text[first : one.start].strip() else ""
        line = f"WaitTime {self.wait_text(seconds)}; {ADDED}: wait added by a plan"
        if before:
            return Edit(Span(one.start, one.start), f"{line}{end}{indent}")
        rest = text[one.end :].split("\n", 1)[0]
        place = one.end + (len(rest.rstrip("\r")) if not rest.strip() or rest.strip().startswith("!") else 0)
        follows = "" if place > one.end or not rest.strip() else f"{end}{indent}"
        return Edit(Span(place, place), f"{end}{indent}{line}{follows}")

    def wait_text(self, seconds: float) -> str:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        return plain(seconds, 3)

    def finished(self, texts: Sequence[str]) -> tuple[str, ...]:
        """See `robojoule.formats.vendor.trace.VendorProgram`: nothing has to be."""
        return tuple(texts)


def read_rapid(path: Path) -> RapidProgram:
    """Read a module.

    Raises:
        InputError: It cannot be read, or holds no procedure.
    """
    return RapidProgram(read_source(path))
