"""KRL programs: a .src with its .dat, read and written together."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from robojoule.errors import InputError
from robojoule.formats.vendor.composing import decimal, plain
from robojoule.formats.vendor.krl.executions import Setting
from robojoule.formats.vendor.krl.folds import Fold, motion_folds, speeds_in, spline_folds
from robojoule.formats.vendor.krl.machine import ADDED, Machine
from robojoule.formats.vendor.krl.syntax import read_lines, routines, spline_blocks
from robojoule.formats.vendor.krl.targets import Frames
from robojoule.formats.vendor.lines import Line, behind
from robojoule.formats.vendor.text import Edit, SourceText, Span, read_source
from robojoule.formats.vendor.trace import Beside, Event, Motion, Trace, Wish


class KrlProgram:
    """A parsed KRL program; see `robojoule.formats.vendor.trace.VendorProgram`."""

    wait_step_s = 1e-6

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
        return Trace(tuple(self._writable(event) for event in machine.events), tuple(machine.notes.values()))

    def _writable(self, event: Event) -> Event:
        """An event; a motion that runs at several speeds cannot be given another one."""
        if not isinstance(event, Motion) or event.statement not in self._changing:
            return event
        return replace(event, speed=replace(event.speed, writable=False))

    @cached_property
    def _folds(self) -> dict[int, Fold]:
        return motion_folds(self.lines[0])

    @cached_property
    def _motions(self) -> dict[int, Line]:
        return {line.code_start: line for line in self.lines[0] if line.kind == "motion"}

    @cached_property
    def _surroundings(self) -> dict[int, tuple[Line, Line]]:
        """Lines before the first and behind the last of which others may stand: those of folds, of blocks of splines.

        They are by the first character of their motions, and by that of a block's head.
        """
        lines = self.lines[0]
        found = {start: (lines[fold.first], lines[fold.last]) for start, fold in self._folds.items()}
        folds = spline_folds(lines)
        for routine in self.routines:
            for block in spline_blocks(routine.body):
                fold, inner = folds.get(block.head.code_start), list(block.lines())
                last = block.foot or (inner[-1] if inner else block.head)
                pair = (block.head, last) if fold is None else (lines[fold.first], lines[fold.last])
                found |= {line.code_start: pair for line in [block.head, *inner] if line.kind in ("spline", "motion")}
        return found

    def speed_edits(self, wishes: Mapping[int, Wish]) -> list[Edit]:
        """See `robojoule.formats.vendor.trace.VendorProgram`.

        A number is changed where it stands, as far as it sets the speed of the first motion that takes it. Where
        motions that share it need other speeds, a line before them sets these. What sets the speed of motions that
        plans do not reach, or that run at several speeds, is left alone: then a line behind a motion sets it back.
        """
        if not wishes:
            return []
        assert self._machine is not None
        settings, executions = self._machine.settings, self._machine.executions
        wanted = {one: wishes[one].percent if one in wishes else setting.percent for one, setting in settings.items()}
        edits: dict[Span, Edit] = {}
        in_force: dict[int, float | None] = {}
        first: dict[Span, int] = {}
        untouched = {one.origin for one in executions if one.set_by in self._protected}
        untouched |= {origin for one in executions for origin in one.others}
        for one in executions:
            if one.origin is None or one.origin in untouched:
                in_force.setdefault(one.set_by, one.percent)
                continue
            taker = first.setdefault(one.origin, one.statement)
            in_force.setdefault(one.set_by, wanted[taker])
            if taker in wishes:
                edits[one.origin] = Edit(one.origin, self._number(one.origin, wishes[taker].percent))
        for statement in self._to_insert(in_force, wanted):
            if (percent := wanted[statement]) is not None:
                edits |= {edit.span: edit for edit in self._insertions(statement, percent)}
        for statement, wish in wishes.items():
            for span in self._told_speeds(statement):
                edits.setdefault(span, Edit(span, self._number(span, wish.percent)))
        edits |= self._data_edits(wishes, settings)
        return list(edits.values())

    def _to_insert(self, in_force: Mapping[int, float | None], wanted: Mapping[int, float | None]) -> list[int]:
        """Motions before which a line must set the speed, by their order in the text."""
        assert self._machine is not None
        found: set[int] = set()
        while True:
            before, now = len(found), dict(in_force)
            for one in self._machine.executions:
                if one.statement in self._changing:
                    continue
                if one.statement not in found and now[one.set_by] != wanted[one.statement]:
                    found.add(one.statement)
                if one.statement in found and not self._is_set_back(one.statement):
                    now[one.set_by] = wanted[one.statement]
            if len(found) == before:
                return sorted(found)

    @cached_property
    def _changing(self) -> frozenset[int]:
        """Motions that run at several speeds."""
        assert self._machine is not None
        speeds: dict[int, set[float | None]] = defaultdict(set)
        for one in self._machine.executions:
            speeds[one.statement].add(one.percent)
        return frozenset(statement for statement, found in speeds.items() if len(found) > 1)

    @cached_property
    def _protected(self) -> frozenset[int]:
        """Settings that must stay: of motions that run at several speeds, or maybe of motions that did not run."""
        assert self._machine is not None
        found = set()
        for one in self._machine.executions:
            own = one.set_by < 0 or (one.origin is not None and self._in_fold(one.origin) and not self._is_partly_set)
            if one.statement in self._changing or (self._has_bystanders and not own):
                found.add(one.set_by)
        return frozenset(found)

    @cached_property
    def _is_partly_set(self) -> bool:
        """Whether some motion has speeds of single axes from before another one, where these must stay."""
        assert self._machine is not None
        return any(one.is_partly_set for one in self._machine.executions)

    def _is_set_back(self, statement: int) -> bool:
        """Whether a line that sets a motion's speed is followed by one that sets it back."""
        assert self._machine is not None
        return any(one.statement == statement and one.set_by in self._protected for one in self._machine.executions)

    @cached_property
    def _has_bystanders(self) -> bool:
        """Whether motions that did not run may take their speed from the same settings as those that did.

        They may stand in this file, or in programs of other files that it calls.
        """
        assert self._machine is not None
        if self._machine.calls_elsewhere or self._is_partly_set:
            return True
        ran = self._machine.settings.keys() | self._machine.splined
        others = [line for start, line in self._motions.items() if start not in ran and start not in self._folds]
        return any("PTP" in line.code.upper()[:4] and "$VEL_AXIS" not in line.code.upper() for line in others)

    def _in_fold(self, origin: Span) -> bool:
        """Whether a number belongs to one motion's fold."""
        line = self.sources[origin.file].line(origin.start) - 1
        return origin.file == 0 and any(fold.first <= line <= fold.last for fold in self._folds.values())

    def _number(self, span: Span, percent: float) -> str:
        """A number with as many decimals as the one that it replaces, if that says it."""
        old = self.sources[span.file].text[span.start : span.end]
        least = plain(percent)
        decimals = len(old.partition(".")[2]) if "E" not in old.upper() else 0
        fixed = f"{percent:.{decimals}f}"
        return fixed if float(fixed) == float(least) else least

    def _insertions(self, statement: int, percent: float) -> list[Edit]:
        """A line before a motion that sets the speed of axes, and one behind it where others need what was before."""
        assert self._machine is not None
        setting, end = self._machine.settings[statement], self.sources[0].line_end
        is_block = setting.line.kind == "spline"
        line, last = self._surroundings[statement] if is_block else (setting.line, setting.line)
        edits = [Edit(Span(line.start, line.start), f"{line.indent}BAS(#VEL_PTP,{plain(percent)}){end}")]
        before = setting.percent
        if self._is_set_back(statement) and before is not None:
            edits.append(behind(last, f"{line.indent}BAS(#VEL_PTP,{plain(before)})", end))
        return edits

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
        for span, all_users in users.items():
            # A plain motion behind a fold finds that fold's data still named, but goes by the speed that was set.
            statements = {one for one in all_users if one in self._folds} or all_users
            wanted = {wishes[one].percent if one in wishes else None for one in statements}
            in_step = all(settings[one].percent == values[span] for one in statements)
            if in_step and len(wanted) == 1 and (percent := wanted.pop()) is not None:
                found[span] = Edit(span, self._number(span, percent))
        return found

    def wait_edit(self, statement: int, seconds: float, *, before: bool) -> Edit:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        line, source = self._motions[statement], self.sources[0]
        first, last = self._surroundings.get(statement, (line, line))
        text = f"{first.indent}WAIT SEC {self.wait_text(seconds)} {ADDED}: wait added by a plan"
        if before:
            return Edit(Span(first.start, first.start), f"{text}{source.line_end}")
        return behind(last, text, source.line_end)

    def wait_text(self, seconds: float) -> str:
        """See `robojoule.formats.vendor.trace.VendorProgram`."""
        return decimal(seconds)

    def finished(self, texts: Sequence[str]) -> tuple[str, ...]:
        """See `robojoule.formats.vendor.trace.VendorProgram`: nothing has to be."""
        return tuple(texts)


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
