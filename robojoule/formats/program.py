"""The program: what a robot does in a cycle, with the file that it was read from or is written to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from robojoule.documents import check_output
from robojoule.errors import InputError
from robojoule.formats.registry import format_of
from robojoule.formats.tree_files import TreeFiles
from robojoule.inputs import as_path, shown
from robojoule.programs.operation_tree import MoveOperation, OperationTree
from robojoule.programs.tree_check import check_tree
from robojoule.robots.pendant_file import ANGLES, Angles
from robojoule.robots.robot import Robot


@dataclass(frozen=True)
class Program:
    """What a robot does in one cycle.

    Attributes:
        tree: The operations of the cycle.
        path: File that it was read from, if any.
        format: Name of that file's format, if any.
        places: Where robot and configurations stand in a file that has other keys, such as "line 4", by their key.
        text: Text of that file, into which `save` writes the tree's speed limits and waits.
    """

    tree: OperationTree
    path: Path | None = None
    format: str | None = None
    places: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)
    text: str | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.tree, OperationTree):
            raise InputError(f"{shown(self.tree)} is not an operation tree", key="tree", allowed="an OperationTree")
        if self.path is not None:
            object.__setattr__(self, "path", as_path(self.path, "path"))

    def __repr__(self) -> str:
        path = str(self.path) if self.path is not None else None
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

    def counted_as(self, angles: str) -> Program:
        """The program with the same numbers, taken as angles of the model or of the pendant.

        Raises:
            InputError: Neither of the two is named.
        """
        if not isinstance(angles, str) or angles not in ANGLES:
            raise InputError(f"unknown angles {shown(angles)}", key="angles", allowed=", ".join(ANGLES))
        return replace(self, tree=self.tree.model_copy(update={"angles": angles}))

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
        text = self.text if found.name == self.format else None
        if isinstance(found, TreeFiles):
            found.write(self.tree, target, text, remarks)
        else:
            found.write(self.tree, target, text)


def load_program(path: str | Path) -> Program:
    """Read a program from a file of any known format.

    Args:
        path: Operation tree (YAML, JSON) or joint positions (CSV).

    Raises:
        InputError: Unknown suffix, unreadable file, or a file that does not hold a program.
    """
    file = as_path(path, "path")
    found = format_of(file)
    reading = found.read(file)
    return Program(reading.tree, file, found.name, reading.places, reading.text)
