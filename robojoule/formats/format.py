"""What a file format of programs is, and what it reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from robojoule.programs.operation_tree import OperationTree


@dataclass(frozen=True)
class Reading:
    """What a file of a program holds.

    Attributes:
        tree: The operations of the cycle; its `angles` are those of the pendant where the format is a vendor's own.
        places: Where robot and configurations stand in a file that has other keys, such as "line 4", by their key.
        text: The text of the file, so that a plan can be written into it.
    """

    tree: OperationTree
    places: Mapping[str, str]
    text: str


class Format(Protocol):
    """A kind of file that holds programs."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Suffixes of its files, in lower case, with the dot."""

    @property
    def speed_step_percent(self) -> float:
        """Step of speed limits that controllers which run such files take. [%]"""

    def read(self, path: Path) -> Reading:
        """Read a file.

        Raises:
            InputError: The file cannot be read, or does not hold a program; names the place in the file.
        """

    def write(self, tree: OperationTree, path: Path, text: str | None = None) -> None:
        """Write a file, atomically.

        Args:
            tree: What the program does.
            path: File to write.
            text: Text of a file of this format with the same operations: only speed limits and waits change in it,
                its comments, units and order are kept.

        Raises:
            InputError: The format cannot hold the tree, or the file cannot be written.
        """
