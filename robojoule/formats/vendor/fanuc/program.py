"""Teach pendant programs: .ls files, read and written."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.vendor.fanuc.flow import ADDED
from robojoule.formats.vendor.fanuc.machine import Machine
from robojoule.formats.vendor.fanuc.positions import read_positions
from robojoule.formats.vendor.fanuc.syntax import (
    Block,
    Instruction,
    blocks,
    instructions,
    lines_in,
    number_of_line,
    own_row,
    renumbered,
    sections,
)
from robojoule.formats.vendor.text import Edit, SourceText, Span, read_source
from robojoule.formats.vendor.trace import Beside, Note, Trace, Wish

_COUNT = re.compile(r"(LINE_COUNT\s*=\s*)(\d+)")
_STEP_S = 0.01  # of waits and of durations in seconds
_ROUNDING = 1e-3  # steps that a figure may be short of a whole one by rounding
_LEAST_PERCENT, _MOST_PERCENT = 1, 100


class TeachPendantProgram:
    """A parsed .ls file; see `robojoule.formats.vendor.trace.VendorProgram`."""

    wait_step_s = _STEP_S

    def __init__(self, source: SourceText) -> None:
        self.sources = (source,)
        self.lines = lines_in(source)
        self.sections = sections(self.lines)
        if "MN" not in self.sections:
            allowed = "a teach pendant program as text, with /PROG, /MN, /POS and /END"
            raise InputError("the file has no section /MN", file=source.path, allowed=allowed)
        self.instructions = instructions(self.sections["MN"])
        self.positions, self.bad_positions = read_positions(self.sections.get("POS", []))
        self._motions = {one.code_start: one for one in self.instructions if one.kind == "motion"}
        self._machine: Machine | None = None
        self._programs: dict[str, list[Instruction | Block] | None] = {}

    @property
    def name(self) -> str:
        """Name of the program, as /PROG says it; else that of its file."""
        for line in self.lines:
            words = line.text.split()
            if words[:1] == ["/PROG"] and len(words) > 1:
                return words[1]
        return self.sources[0].path.stem

    def trace(self, beside: Beside) -> Trace:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        machine = Machine(self.positions, beside, moves_arm=self._moves_arm(), find=self._beside)
        machine.run(blocks(self.instructions))
        self._machine = machine
        notes = [Note(line, "the position is not understood and kept") for line in self.bad_positions]
        notes += machine.notes.values()
        return Trace(tuple(machine.events), tuple(notes))

    def _beside(self, name: str) -> list[Instruction | Block] | None:
        """The instructions of another program in the same folder, which is read once."""
        if name not in self._programs:
            self._programs[name] = self._read_beside(name)
        return self._programs[name]

    def _read_beside(self, name: str) -> list[Instruction | Block] | None:
        for stem in (name, name.lower(), name.upper()):
            for suffix in (".ls", ".LS"):
                path = self.sources[0].path.with_name(f"{stem}{suffix}")
                try:
                    found = sections(lines_in(read_source(path))) if path.is_file() else {}
                except InputError:
                    continue
                if "MN" in found:
                    return blocks(instructions(found["MN"]))
        return None

    def _moves_arm(self) -> bool:
        """Whether the program moves group 1."""
        for line in self.sections.get("ATTR", []):
            key, _, value = line.text.partition("=")
            if key.strip() == "DEFAULT_GROUP":
                return value.strip()[:1] == "1"
        return True

    def speed_edits(self, wishes: Mapping[int, Wish]) -> list[Edit]:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        assert self._machine is not None
        edits = []
        for statement, wish in wishes.items():
            amount = self._machine.amounts[statement]
            if amount.unit == "%":
                whole = math.ceil(wish.percent - 1e-6)
                text = str(min(max(whole, _LEAST_PERCENT), _MOST_PERCENT))
            elif wish.duration_s is None:
                continue
            elif amount.unit == "msec":
                text = str(max(math.floor(wish.duration_s * 1e3 + _ROUNDING), 1))
            else:
                text = _hundredths(max(wish.duration_s, _STEP_S))
            if float(text) != float(self.sources[0].text[amount.span.start : amount.span.end]):
                edits.append(Edit(amount.span, text))
        return edits

    def wait_edit(self, statement: int, seconds: float, *, before: bool) -> Edit:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        one, end = self._motions[statement], self.sources[0].line_end
        first = one.line.text if self._is_counted else renumbered(one.line.text, None)
        prefix = first[: first.index(":") + 1]
        text = f"{prefix}  {ADDED} ;{end}{prefix}  WAIT   {self.wait_text(seconds)}(sec) ;{end}"
        place = one.start if before else one.end
        return Edit(Span(place, place), text)

    def wait_text(self, seconds: float) -> str:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        return _hundredths(seconds)

    def finished(self, texts: Sequence[str]) -> tuple[str, ...]:
        """See `robojoule.formats.vendor.trace.VendorProgram`: numbers of lines, and how many there are."""
        (text,) = texts
        if text == self.sources[0].text:
            return (text,)
        lines = lines_in(SourceText(self.sources[0].path, text))
        new = sections(lines)["MN"]
        more = len(new) - len(self.sections["MN"])
        if more == 0:
            return (text,)
        changed = {}
        if self._is_counted:
            changed = {line.start: renumbered(line.text, at) for at, line in enumerate(own_row(new), start=1)}
        pieces = [changed.get(line.start, line.text) + text[line.start + len(line.text) : line.end] for line in lines]
        return (_COUNT.sub(lambda found: f"{found[1]}{int(found[2]) + more}", "".join(pieces), count=1),)

    @cached_property
    def _is_counted(self) -> bool:
        """Whether instructions are numbered from 1 on, one by one."""
        numbers = [number_of_line(line.text) for line in own_row(self.sections["MN"])]
        return numbers == list(range(1, len(numbers) + 1))


def _hundredths(seconds: float) -> str:
    """A duration as the controller keeps it, not longer than it is."""
    return f"{math.floor(seconds / _STEP_S + _ROUNDING) * _STEP_S:.2f}"


def read_teach_pendant(path: Path) -> TeachPendantProgram:
    """Read a .ls file.

    Raises:
        InputError: It cannot be read, or is not a teach pendant program.
    """
    return TeachPendantProgram(read_source(path))
