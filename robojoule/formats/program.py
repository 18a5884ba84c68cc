"""The program: what a robot does in a cycle, with the file that it was read from or is written to."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojoule.documents import check_output, decoded, read_bytes
from robojoule.errors import InputError
from robojoule.formats.registry import FORMATS, format_of
from robojoule.formats.tree_files import TreeFiles
from robojoule.formats.vendor.files import VendorFiles
from robojoule.formats.vendor.source import VendorSource
from robojoule.formats.vendor.text import SourceText, unified_diff
from robojoule.formats.vendor.trace import Beside, NeedsRobot, told
from robojoule.inputs import as_path, shown
from robojoule.programs.operation_tree import PLANNED, MoveOperation, OperationTree
from robojoule.programs.tree_check import check_tree, robot_warnings
from robojoule.robots.pendant_file import ANGLES, Angles
from robojoule.robots.robot import Robot

# Whose robots run programs of a format.
_VENDORS = {"KUKA KRL": "KUKA", "FANUC TP": "FANUC", "ABB RAPID": "ABB", "URScript": "Universal Robots"}
NOT_BESIDE = "what stands in the controller goes with a program in a robot's own language"
TOOL_TIMING = (
    "moves along paths of the tool take the dead time of the learnt timing alone: their speeds, accelerations and jerk "
    "phases are those of the drives"
)
WAIT_STEP_S = 1e-3  # of waits that plans add for people: controllers know no shorter ones


@dataclass(frozen=True)
class Program:
    """What a robot does in one cycle.

    A program in a vendor's language may say what only a robot explains, such as places of the tool; then it has no tree
    until it is there `for_robot`, which `optimize` and the like do themselves.

    Attributes:
        tree: The operations of the cycle.
        path: File that it was read from, if any.
        format: Name of that file's format, if any.
        places: Where robot and configurations stand in a file that has other keys, such as "line 4", by their key.
        text: Text of that file, into which `save` writes the tree's speed limits and waits.
        source: The program in its vendor's language, if that is where it comes from.
    """

    tree: OperationTree
    path: Path | None = None
    format: str | None = None
    places: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)
    text: str | None = field(default=None, repr=False, compare=False)
    source: VendorSource | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.tree is None and self.source is not None:
            object.__delattr__(self, "tree")
        elif not isinstance(self.tree, OperationTree):
            raise InputError(f"{shown(self.tree)} is not an operation tree", key="tree", allowed="an OperationTree")
        if self.path is not None:
            object.__setattr__(self, "path", as_path(self.path, "path"))

    if not TYPE_CHECKING:  # what is not there is explained; type checkers know what may be there

        def __getattr__(self, name: str) -> object:
            if name == "tree" and self.source is not None:
                return self.source.resolution.tree  # raises and says what is missing
            raise AttributeError(f"a program has no '{name}'")

    def __repr__(self) -> str:
        path = str(self.path) if self.path is not None else None
        if "tree" not in vars(self):
            return f"Program(path={path!r}, needs a robot)"
        return f"Program({self.name!r}, moves={len(self.moves)}, robot={self.robot!r}, path={path!r})"

    @property
    def name(self) -> str:
        """Name of the program."""
        return self.tree.name

    @property
    def robot(self) -> str | None:
        """Name of the robot that it is written for; none: any."""
        return self.tree.robot

    @property
    def moves(self) -> tuple[MoveOperation, ...]:
        """Moves in order of execution."""
        return self.tree.moves()

    @property
    def angles(self) -> Angles:
        """Whether its angles are those of the robot's model or as the pendant shows them."""
        return self.tree.angles

    @property
    def speed_step_percent(self) -> float:
        """Step of speed limits that controllers of its format take; whole percents without a file. [%]"""
        return next((one.speed_step_percent for one in FORMATS if one.name == self.format), 1.0)

    def counted_as(self, angles: str) -> Program:
        """The program with the same numbers, taken as angles of the model or of the pendant.

        Raises:
            InputError: Neither of the two is named.
        """
        if not isinstance(angles, str) or angles not in ANGLES:
            raise InputError(f"unknown angles {shown(angles)}", key="angles", allowed=", ".join(ANGLES))
        if self.source is not None:
            return self._resolved(self.source.of(angles=angles))
        return replace(self, tree=self.tree.model_copy(update={"angles": angles}))

    def for_robot(self, robot: Robot) -> Program:
        """The program as a robot executes it: places of the tool as joint angles, speeds as shares of its limits.

        Raises:
            InputError: The robot cannot execute it; names the place in the file.
        """
        if self.source is None or self.source.robot is robot:
            return self
        return self._resolved(self.source.of(robot))

    def _resolved(self, source: VendorSource) -> Program:
        """The same program by another reading of its text, with what a plan changed in the tree of the present one."""
        found, settings = _program(source, self.path, self.format), self._plan()
        if not settings:
            return found
        tree = found.tree.with_settings(settings)
        return replace(found, tree=tree.model_copy(update={"planned_cycle_s": self.tree.planned_cycle_s}))

    def _plan(self) -> dict[str, dict[str, Any]]:
        """Speeds and waits of moves that are not those of the text, per name."""
        if self.source is None or "tree" not in vars(self):
            return {}
        as_read = {move.name: move for move in self.source.resolution.tree.moves()}
        settings = {}
        for move in self.tree.moves():
            was = as_read.get(move.name)
            new = {key: getattr(move, key) for key in PLANNED if was is None or getattr(move, key) != getattr(was, key)}
            if new:
                settings[move.name] = new
        return settings

    @property
    def remembers(self) -> bool:
        """Whether its format can say what the program was before a plan was made."""
        return self.format in (None, TreeFiles.name)

    @property
    def wait_step_s(self) -> float:
        """Waits that plans add are multiples of it. [s]"""
        return WAIT_STEP_S if self.source is None else self.source.wait_step_s

    def placed(self, tree: OperationTree) -> OperationTree:
        """A tree of the program's moves with its added waits where the program's language can say them."""
        return tree if self.source is None else self.source.placed(tree)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a vendor's program says that is kept as it is, assumed, or not known, a sentence each with its line."""
        return () if self.source is None else told(self.source.resolution.notes)

    def warnings_for(self, robot: Robot) -> tuple[str, ...]:
        """What to know before it is used on a robot, a sentence each: its angles, doubts, another vendor's language."""
        vendor = _VENDORS.get(self.format or "", robot.vendor)
        known = robot_warnings(self.tree, robot)
        if robot.controller is not None and any(move.tool_path is not None for move in self.tree.moves()):
            known = (*known, TOOL_TIMING)
        if robot.vendor not in _VENDORS.values() or vendor == robot.vendor:
            return known
        return (
            f"the program is in the language of {vendor} ({self.format}), but {robot.name} is of {robot.vendor}",
            *known,
        )

    def diff(self) -> str:
        """What `save` would change in the files that the program was read from, as a unified diff; empty: nothing.

        Raises:
            InputError: The program was not read from a file.
        """
        if self.source is not None:
            return self.source.diff(self.tree)
        if self.path is None or self.text is None:
            raise InputError("there is no file to compare with", key="diff", allowed="a program that was read")
        with tempfile.TemporaryDirectory() as folder:
            target = Path(folder) / self.path.name
            self.save(target)
            text = decoded(read_bytes(target), target)
        return unified_diff([SourceText(self.path, self.text)], [text])

    def check(self, robot: Robot) -> None:
        """Check that a robot can execute the program; see `check_tree`.

        Raises:
            InputError: First violation, with its place in the file.
        """
        check_tree(self.tree, robot, self.path, self.places)

    def save(self, path: str | Path, remarks: Sequence[str] | None = None) -> None:
        """Write the program in the format that the suffix names.

        In the format that it was read from, comments, units and the order of keys stay as they were.

        Args:
            path: File to write.
            remarks: What comments of a YAML file shall say of the plan, a line each; other formats have none.

        Raises:
            InputError: Unknown suffix, a program that the format cannot hold, or a file that cannot be written.
        """
        target = as_path(path, "path")
        check_output(target)
        found = format_of(target)
        if self.source is not None and found.name == self.format:
            if isinstance(found, VendorFiles):
                found.check_companions(target, [one.path.suffix.lower() for one in self.source.program.sources])
            self.source.save(self.tree, target)
            return
        text = self.text if found.name == self.format else None
        if isinstance(found, TreeFiles):
            found.write(self.tree, target, text, remarks)
        else:
            found.write(self.tree, target, text)


def load_program(path: str | Path, robot: Robot | None = None, *, beside: Beside | None = None) -> Program:
    """Read a program from a file of any known format.

    Args:
        path: Operation tree (YAML, JSON), joint positions (CSV), or a program in a robot's own
            language (KUKA .src, FANUC .ls, ABB .mod and .prg, UR .script).
        robot: Robot that executes it, for programs in a robot's own language; without it these are understood when they
            are planned or simulated.
        beside: What stands in the controller, not in the file: tools, bases, payloads, durations of waits.

    Raises:
        InputError: Unknown suffix, unreadable file, a file that does not hold a program, or something given beside one
            that is not in a robot's own language.
    """
    file = as_path(path, "path")
    found = format_of(file)
    if isinstance(found, VendorFiles):
        source = found.source(file, beside)
        return _program(source if robot is None else source.of(robot), file, found.name)
    if beside is not None and beside != Beside():
        raise InputError(NOT_BESIDE, file=file, key="beside", allowed="no such data, or a program of such a kind")
    reading = found.read(file)
    return Program(reading.tree, file, found.name, reading.places, reading.text)


def _program(source: VendorSource, path: Path | None, name: str | None) -> Program:
    """A program in a vendor's language, with its tree where that is known."""
    text = source.program.sources[0].text
    try:
        resolution = source.resolution
    except NeedsRobot:
        return Program(None, path, name, {}, text, source)  # type: ignore[arg-type]
    return Program(resolution.tree, path, name, resolution.places, text, source)
