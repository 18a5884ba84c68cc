"""A vendor's program with what was made of it: resolved for a robot, written with the speeds and waits of a tree."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from robojoule.documents import write_files
from robojoule.errors import InputError
from robojoule.formats.vendor.resolution import resolve
from robojoule.formats.vendor.resolved import Resolution
from robojoule.formats.vendor.speed_limits import Execution
from robojoule.formats.vendor.speeds import leading_share
from robojoule.formats.vendor.text import Edit, edited, numbers_in_bounds, unified_diff
from robojoule.formats.vendor.trace import Beside, Event, Motion, Trace, Unknown, VendorProgram, Wait, Wish
from robojoule.inputs import counted
from robojoule.programs.operation_tree import MoveOperation, OperationTree
from robojoule.robots.pendant_file import Angles
from robojoule.robots.robot import Robot

SAME_S = 1e-9  # of waits: rounding
_NO_STATEMENT = -1  # of what stands for something that was not understood
LEAST_WAIT_S = 0.01  # that a plan adds to a program: people read them


def _is_open(event: Event) -> bool:
    """Whether something may take a time that nobody knows: a wait, or a motion of the tool without a speed."""
    if isinstance(event, Unknown):
        return event.may_stand
    if isinstance(event, Motion):
        return event.kind != "joint" and event.speed.duration_s is None and event.speed.tool_m_s is None
    return isinstance(event, Wait) and event.duration_s is None


def _open_lines(trace: Trace) -> tuple[int, ...]:
    """Lines that may take a time that nobody knows, in the order of the text."""
    return tuple(sorted({one.line for one in trace.events if _is_open(one)}))


@dataclass(frozen=True, eq=False)
class VendorSource:
    """A vendor's program and how it is to be understood.

    Attributes:
        program: The parsed program.
        beside: What is given beside its files.
        angles: How it counts joint angles.
        robot: Robot for which it is resolved; None: for any, as far as that goes.
    """

    program: VendorProgram
    beside: Beside = field(default_factory=Beside)
    angles: Angles = "pendant"
    robot: Robot | None = None

    @property
    def _path(self) -> Path:
        return self.program.sources[0].path

    @cached_property
    def trace(self) -> Trace:
        """What the program does."""
        try:
            with numbers_in_bounds(self._path):
                return self._with_waits(self.program.trace(self.beside))
        except InputError as error:
            raise self._placed(error) from None

    def _with_waits(self, trace: Trace) -> Trace:
        """The trace with the waits that are given beside it; what is given a length does not move the robot."""
        given = self.beside.waits_s
        open_lines = _open_lines(trace)
        for line in given:
            if line not in open_lines:
                known = ", ".join(map(str, open_lines)) or "there is none"
                problem = "there is no wait of unknown length on this line"
                raise InputError(problem, key=f"line {line}", allowed=f"lines: {known}")
        events: list[Event] = []
        for one in trace.events:
            if isinstance(one, Wait) and _is_open(one) and one.line in given:
                events.append(replace(one, duration_s=given[one.line]))
            elif isinstance(one, Unknown) and _is_open(one) and one.line in given:
                events.append(Wait(_NO_STATEMENT, one.line, given[one.line], one.what))
            elif isinstance(one, Motion) and _is_open(one) and one.line in given:
                events.append(replace(one, speed=replace(one.speed, duration_s=given[one.line])))
            else:
                events.append(one)
        return replace(trace, events=tuple(events))

    def waits_for(self, other: VendorSource) -> dict[int, float]:
        """The lengths of waits that are given for this program, by the lines of the one that it is a plan of.

        The two have the same waits of unknown length in the same order, but not in the same lines.

        Raises:
            InputError: They have not.
        """
        own, others = (_open_lines(one.program.trace(replace(one.beside, waits_s={}))) for one in (self, other))
        if len(own) != len(others) and self.beside.waits_s:
            verb = "is" if len(others) == 1 else "are"
            problem = f"{counted(len(others), 'line')} {verb} of unknown length, {len(own)} in '{self._path.name}'"
            raise InputError(problem, file=other._path, allowed="the program that the plan was made from")
        lines = dict(zip(own, others, strict=False))
        return {lines[line]: seconds for line, seconds in self.beside.waits_s.items() if line in lines}

    @cached_property
    def resolution(self) -> Resolution:
        """The program as an operation tree.

        Raises:
            NeedsRobot: A robot must be known.
            InputError: Nothing can be planned.
        """
        try:
            with numbers_in_bounds(self._path):
                return resolve(self.trace, self.program.name, self.robot, self.angles)
        except InputError as error:
            raise self._placed(error) from None

    def _placed(self, error: InputError) -> InputError:
        return type(error)(error.problem, file=error.file or self._path, key=error.key, allowed=error.allowed)

    def of(self, robot: Robot | None = None, angles: Angles | None = None) -> VendorSource:
        """The same program for a robot, or with its angles counted otherwise."""
        return replace(self, robot=robot or self.robot, angles=angles or self.angles)

    def texts(self, tree: OperationTree) -> tuple[str, ...]:
        """The program's files with the speeds and waits of a tree of the same moves.

        Raises:
            InputError: The tree differs in more than speeds that can be written and added waits.
        """
        was = {move.name: move for move in self.resolution.tree.moves()}
        new = {move.name: move for move in tree.moves()}
        if was.keys() != new.keys() or self._with_plan_of(new).operations != tree.operations:
            problem = f"the tree differs from the program '{self.program.name}' in more than speeds and added waits"
            raise InputError(problem, allowed="the program's own moves and waits, or another format")
        edits = list(dict.fromkeys([*self.program.speed_edits(self._wishes(was, new)), *self._wait_edits(was, new)]))
        texts = [
            edited(source.text, [edit for edit in edits if edit.span.file == file])
            for file, source in enumerate(self.program.sources)
        ]
        return self.program.finished(texts)

    @property
    def wait_step_s(self) -> float:
        """Waits that plans add are multiples of it. [s]"""
        return max(self.program.wait_step_s, LEAST_WAIT_S)

    def placed(self, tree: OperationTree) -> OperationTree:
        """The tree with its added waits where the program can say them: behind motions that run once.

        Where no motion does, the waits are shared out to all executions of one, as far as they are all in the tree;
        what is left of them is not waited.

        Args:
            tree: A tree of some or all moves of the program.
        """
        moves, repeated = tree.moves(), self.resolution.repeated
        if moves[0].name not in self.resolution.passed and not any(move.name in repeated for move in moves):
            return tree
        before, after = moves[0].added_wait_before_s, [move.added_wait_after_s for move in moves]
        for index, move in enumerate(moves[1:]):
            after[index] += move.added_wait_before_s
        free = [i for i, one in enumerate(moves) if one.is_fine and one.name not in repeated]
        if moves[0].name in repeated or moves[0].name in self.resolution.passed:
            before, after[0] = 0.0, after[0] + before
        if free:
            for index in set(range(len(moves))) - set(free):
                nearest = min(free, key=lambda place: abs(place - index))
                after[index], after[nearest] = 0.0, after[nearest] + after[index]
        else:
            shared = self._shared_places(moves)
            each_s = math.floor(sum(after) / max(len(shared), 1) / self.wait_step_s + SAME_S) * self.wait_step_s
            after = [each_s if index in shared else 0.0 for index in range(len(moves))]
        return tree.with_plan(
            {},
            added_waits_before_s={move.name: before if i == 0 else 0.0 for i, move in enumerate(moves)},
            added_waits_after_s={move.name: seconds for move, seconds in zip(moves, after, strict=True)},
        )

    def _shared_places(self, moves: Sequence[MoveOperation]) -> tuple[int, ...]:
        """All executions of the statement that runs last, of those whose executions all are among some moves."""
        executions = self.resolution.executions
        places: dict[int, list[int]] = {}
        for index, move in enumerate(moves):
            places.setdefault(executions[move.name].motion.statement, []).append(index)
        counts = self.resolution.repeated
        whole = [
            tuple(at)
            for at in places.values()
            if len(at) == counts.get(moves[at[0]].name, 1) and all(moves[index].is_fine for index in at)
        ]
        return max(whole, key=max, default=())

    def save(self, tree: OperationTree, path: Path) -> None:
        """Write the program's files, all of them or none, those that go with it beside the first under its name."""
        texts = self.texts(tree)
        contents: dict[Path, str | bytes] = {}
        for source, text in zip(self.program.sources, texts, strict=True):
            target = path if not contents else path.with_suffix(source.path.suffix)
            contents[target] = source.encoded(text)
        write_files(contents)

    def diff(self, tree: OperationTree) -> str:
        """What `save` changes, as a unified diff."""
        return unified_diff(self.program.sources, self.texts(tree))

    def _with_plan_of(self, moves: Mapping[str, MoveOperation]) -> OperationTree:
        """The program's own tree with speeds and added waits of moves of the same names."""
        return self.resolution.tree.with_plan(
            {name: move.speed_limit_percent for name, move in moves.items()},
            added_waits_before_s={name: move.added_wait_before_s for name, move in moves.items()},
            added_waits_after_s={name: move.added_wait_after_s for name, move in moves.items()},
        )

    def _wishes(self, was: Mapping[str, MoveOperation], new: Mapping[str, MoveOperation]) -> dict[int, Wish]:
        """Speeds of the statements whose speed changes."""
        wishes: dict[int, Wish] = {}
        for name, move in new.items():
            if move.speed_limit_percent != was[name].speed_limit_percent:
                execution = self.resolution.executions[name]
                wish, statement = self._wish(execution, move.speed_limit_percent), execution.motion.statement
                is_open = execution.motion.kind == "joint" and execution.motion.speed.writable
                if not is_open or wishes.setdefault(statement, wish).percent != wish.percent:
                    problem = f"the speed of move '{name}' cannot be written into the program"
                    raise InputError(problem, key=f"line {execution.motion.line}", allowed="its own speed")
        return wishes

    def _wish(self, execution: Execution, percent: float) -> Wish:
        if self.robot is None:
            return Wish(percent)
        share = leading_share(execution.start_rad, execution.target_rad, self.robot)
        return Wish(percent, percent / 100.0 / share if share > 0.0 else None, self._duration_s(execution, percent))

    def _duration_s(self, execution: Execution, percent: float) -> float | None:
        from robojoule.motion.simulation import MotionPaths
        from robojoule.robots.pendant import PendantAngles

        assert self.robot is not None
        ends = np.array([execution.start_rad, execution.target_rad])
        if self.angles == "pendant":
            ends = PendantAngles.of(self.robot).model_rad(ends)
        if not np.ptp(ends, axis=0).any():
            return None
        return float(MotionPaths(self.robot, ends[:1], ends[1:]).durations(np.array([[percent / 100.0]]))[0, 0])

    def _wait_edits(self, was: Mapping[str, MoveOperation], new: Mapping[str, MoveOperation]) -> list[Edit]:
        """Edits of the waits that plans add, which stand behind a motion, or before the first one of a section."""
        edits: list[Edit] = []
        names, heads = list(new), self.resolution.heads
        for index, name in enumerate(names):
            following = names[index + 1] if index + 1 < len(names) else None
            before_s = self._stepped(new[name].added_wait_before_s) if name in heads else 0.0
            after_s = new[name].added_wait_after_s
            if following is not None and following not in heads:
                after_s += new[following].added_wait_before_s
            after_s = self._stepped(after_s)
            for seconds, old_s, is_before in (
                (before_s, was[name].added_wait_before_s, True),
                (after_s, was[name].added_wait_after_s, False),
            ):
                if abs(seconds - old_s) > SAME_S:
                    edits += self._wait_edit(name, seconds, before=is_before)
        return edits

    def _stepped(self, seconds: float) -> float:
        """A wait in the steps that the language has, not longer than it is."""
        step = self.program.wait_step_s
        return math.floor(seconds / step + SAME_S / step) * step

    def _wait_edit(self, name: str, seconds: float, *, before: bool) -> list[Edit]:
        there: tuple[Wait, ...] = self.resolution.added.get((name, before), ())
        kept = there[:1] if seconds > SAME_S else ()
        edits = [Edit(wait.whole, "") for wait in there[len(kept) :] if wait.whole is not None]
        if kept and kept[0].value is not None:
            edits.append(Edit(kept[0].value, self.program.wait_text(seconds)))
        elif seconds > SAME_S:
            statement = self.resolution.executions[name].motion.statement
            edits.append(self.program.wait_edit(statement, seconds, before=before))
        return edits
