"""KRL programs: a .src with its .dat, read and written together."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.vendor.krl.folds import Fold, motion_folds, speeds_in
from robojoule.formats.vendor.krl.machine import ADDED, Machine, Setting
from robojoule.formats.vendor.krl.syntax import Line, read_lines, routines
from robojoule.formats.vendor.krl.targets import Frames
from robojoule.formats.vendor.text import Edit, SourceText, Span, read_source
from robojoule.formats.vendor.trace import Beside, Trace, Wish


class KrlProgram:
    """A parsed KRL program; see `robojoule.formats.vendor.trace.VendorProgram`."""

    def __init__(self, sources: tuple[SourceText, ...]) -> None:
        self.sources = sources
        self.lines = [read_lines(source, file) for file, source in enumerate(sources)]
        self.routines = routines(self.lines[0])
        self._machine: Machine | None = None

    @property
    def name(self) -> str:
        """Name of the program: that of its file."""
        return self.sources[0].path.stem

    def trace(self, beside: Beside) -> Trace:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        data = self.lines[1] if len(self.lines) > 1 else []
        machine = Machine(self.routines, data, Frames(beside))
        machine.run(self.routines[0])
        self._machine = machine
        return Trace(tuple(machine.events), tuple(machine.notes.values()))

    @cached_property
    def _folds(self) -> dict[int, Fold]:
        return motion_folds(self.lines[0])

    @cached_property
    def _motions(self) -> dict[int, Line]:
        return {line.code_start: line for line in self.lines[0] if line.kind == "motion"}

    def speed_edits(self, wishes: Mapping[int, Wish]) -> list[Edit]:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        if not wishes:
            return []
        assert self._machine is not None
        settings = self._machine.settings
        sharing: dict[Span | None, set[int]] = defaultdict(set)
        for statement, setting in settings.items():
            for origin in setting.origins:
                sharing[origin].add(statement)
        edits: dict[Span, Edit] = {}
        inserted: set[int] = set()
        for statement in sorted(wishes):
            (origin, *more) = settings[statement].origins
            group = sharing[origin]
            wanted = {wishes[one].percent if one in wishes else None for one in group}
            if origin is not None and not more and len(wanted) == 1 and not self._others(origin):
                edits[origin] = Edit(origin, self._number(origin, wishes[statement].percent))
            else:
                inserted |= {one for shared in settings[statement].origins for one in sharing[shared]}
        for statement in sorted(inserted):
            if (origin := self._next_to(statement)) is not None:
                if statement in wishes:
                    edits[origin] = Edit(origin, self._number(origin, wishes[statement].percent))
                continue
            percent = wishes[statement].percent if statement in wishes else settings[statement].percent
            if percent is not None:
                edits |= {edit.span: edit for edit in self._insertions(statement, percent)}
        for statement, wish in wishes.items():
            for span in self._told_speeds(statement):
                edits.setdefault(span, Edit(span, self._number(span, wish.percent)))
        edits |= self._data_edits(wishes, settings)
        return list(edits.values())

    def _next_to(self, statement: int) -> Span | None:
        """The number that sets a statement's speed, if it stands before it with nothing but settings between."""
        assert self._machine is not None
        (origin, *more) = self._machine.settings[statement].origins
        if origin is None or more or origin.file != 0:
            return None
        first, last = self.sources[0].line(origin.start), self._motions[statement].number
        between = self.lines[0][first : last - 1]
        plain = ("", "assignment", "declaration", "call_line", "wait_sec", "wait_for")
        return origin if first <= last and all(line.kind in plain for line in between) else None

    def _others(self, origin: Span) -> bool:
        """Whether motions that did not run might take their speed from a number, too."""
        assert self._machine is not None
        ran = self._machine.settings.keys()
        line = self.sources[origin.file].line(origin.start)
        own = [one for one in self._motions.values() if one.number >= line]
        is_own_line = any(one.number == line for one in own)
        others = [one for one in own if one.code_start not in ran and "PTP" in one.code.upper()[:4]]
        return bool(others) and not is_own_line and not self._is_in_fold(origin)

    def _is_in_fold(self, origin: Span) -> bool:
        """Whether a number belongs to one motion's fold."""
        line = self.sources[origin.file].line(origin.start) - 1
        return origin.file == 0 and any(fold.first <= line <= fold.last for fold in self._folds.values())

    def _number(self, span: Span, percent: float) -> str:
        """A number with as many decimals as the one that it replaces, if that says it."""
        old = self.sources[span.file].text[span.start : span.end]
        plain = f"{percent:.6f}".rstrip("0").rstrip(".")
        decimals = len(old.partition(".")[2]) if "E" not in old.upper() else 0
        fixed = f"{percent:.{decimals}f}"
        return fixed if float(fixed) == float(plain) else plain

    def _insertions(self, statement: int, percent: float) -> list[Edit]:
        """A line before a motion that sets the speed of axes."""
        line = self._motions[statement]
        end = self.sources[0].line_end
        value = f"{percent:.6f}".rstrip("0").rstrip(".")
        return [Edit(Span(line.start, line.start), f"{line.indent}BAS(#VEL_PTP,{value}){end}")]

    def _told_speeds(self, statement: int) -> list[Span]:
        fold = self._folds.get(statement)
        return [] if fold is None else list(speeds_in(self.lines[0][fold.first : fold.last + 1]))

    def _data_edits(self, wishes: Mapping[int, Wish], settings: Mapping[int, Setting]) -> dict[Span, Edit]:
        """Velocities of motion data that were in step with the speeds of their motions, and still can be."""
        users: dict[Span, set[int]] = defaultdict(set)
        values: dict[Span, float] = {}
        for statement, setting in settings.items():
            for number in setting.data:
                if number.origin is not None:
                    users[number.origin].add(statement)
                    values[number.origin] = number.value
        found = {}
        for span, statements in users.items():
            wanted = {wishes[one].percent if one in wishes else None for one in statements}
            in_step = all(settings[one].percent == values[span] for one in statements)
            if in_step and len(wanted) == 1 and (percent := wanted.pop()) is not None:
                found[span] = Edit(span, self._number(span, percent))
        return found

    def wait_edit(self, statement: int, seconds: float, *, before: bool) -> Edit:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        line, fold = self._motions[statement], self._folds.get(statement)
        lines, source = self.lines[0], self.sources[0]
        first, last = (lines[fold.first], lines[fold.last]) if fold is not None else (line, line)
        text = f"{first.indent}WAIT SEC {self.wait_text(seconds)} {ADDED}: wait added by a plan"
        if before:
            return Edit(Span(first.start, first.start), f"{text}{source.line_end}")
        is_cut = last.end == last.start + len(last.text)  # the last line of a file may have no end
        return Edit(Span(last.end, last.end), f"{source.line_end}{text}" if is_cut else f"{text}{source.line_end}")

    def wait_text(self, seconds: float) -> str:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        whole, _, part = f"{seconds:.6f}".rstrip("0").partition(".")
        return f"{whole}.{part or '0'}"


def read_krl(path: Path) -> KrlProgram:
    """Read a .src file and the .dat of the same name beside it, if there is one.

    Raises:
        InputError: One of them cannot be read.
    """
    if path.suffix.lower() == ".dat":
        raise InputError("a .dat holds no program", file=path, allowed="its .src")
    sources = [read_source(path)]
    for suffix in (".dat", ".DAT", ".Dat"):
        if (beside := path.with_suffix(suffix)).is_file():
            sources.append(read_source(beside))
            break
    return KrlProgram(tuple(sources))
