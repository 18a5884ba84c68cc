"""URScript programs, read and written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from robojoule.formats.vendor.composing import decimal
from robojoule.formats.vendor.lines import behind
from robojoule.formats.vendor.text import Edit, SourceText, Span, read_source
from robojoule.formats.vendor.trace import Beside, Trace, Wish
from robojoule.formats.vendor.ur.machine import ADDED, Machine
from robojoule.formats.vendor.ur.motions import MOTIONS, Call
from robojoule.formats.vendor.ur.syntax import blocks, read_lines


class UrProgram:
    """A parsed URScript program; see `robojoule.formats.vendor.trace.VendorProgram`."""

    wait_step_s = 1e-6

    def __init__(self, source: SourceText) -> None:
        self.sources = (source,)
        self.lines = read_lines(source)
        self.top = blocks(self.lines)
        self._calls: Mapping[int, Call] = {}

    @property
    def name(self) -> str:
        """Name of the program: that of its file."""
        return self.sources[0].path.stem

    def trace(self, beside: Beside) -> Trace:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        machine = Machine(self.top, beside)
        machine.run()
        self._calls = machine.motions
        return Trace(tuple(machine.events), tuple(machine.notes.values()))

    def speed_edits(self, wishes: Mapping[int, Wish]) -> list[Edit]:
        """See `robojoule.formats.vendor.trace.VendorProgram`: `t` where it counts, else `v`."""
        edits = []
        for statement, wish in wishes.items():
            call = self._calls[statement]
            duration = call.given.get("t")
            if duration is not None and wish.duration_s is not None and self._number(duration) > 0.0:
                edits.append(Edit(duration, decimal(math.floor(wish.duration_s * 1e6) / 1e6)))
            elif wish.leading_rad_s is not None:
                edits.append(self._velocity(call, decimal(math.ceil(wish.leading_rad_s * 1e6 - 1e-3) / 1e6)))
        return edits

    def finished(self, texts: Sequence[str]) -> tuple[str, ...]:
        """See `robojoule.formats.vendor.trace.VendorProgram`: nothing has to be."""
        return tuple(texts)

    def _number(self, span: Span) -> float:
        """The number that stands somewhere; what is computed counts as one above zero."""
        text = self.sources[0].text[span.start : span.end]
        try:
            return float(text)
        except ValueError:
            return math.inf

    def _velocity(self, call: Call, value: str) -> Edit:
        """Another velocity of a motion, added where it has none."""
        if (span := call.given.get("v")) is not None:
            return Edit(span, value)
        names = MOTIONS[call.name][1]
        at = Span(call.inside, call.inside)
        by_place = [name for name in names if name in call.given]
        if not call.is_named and by_place == list(names[: len(by_place)]) and by_place[-1:] == ["a"]:
            return Edit(at, f", {value}")
        return Edit(at, f", v={value}")

    def wait_edit(self, statement: int, seconds: float, *, before: bool) -> Edit:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        line, end = self._calls[statement].line, self.sources[0].line_end
        text = f"{line.indent}sleep({self.wait_text(seconds)}) {ADDED}: wait added by a plan"
        if before:
            return Edit(Span(line.start, line.start), f"{text}{end}")
        return behind(line, text, end)

    def wait_text(self, seconds: float) -> str:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        return decimal(seconds)


def read_ur(path: Path) -> UrProgram:
    """Read a .script file.

    Raises:
        InputError: It cannot be read.
    """
    return UrProgram(read_source(path))
