"""A vendor's program as an operation tree, with what leads back to its text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from robojoule.formats.vendor.speed_limits import Execution
from robojoule.formats.vendor.trace import Note, Wait
from robojoule.programs.operation_tree import MoveOperation, OperationTree, UnknownOperation


@dataclass(frozen=True)
class Resolution:
    """A program as an operation tree.

    Attributes:
        tree: The tree; its `angles` say how its numbers count.
        places: Lines of start and targets by their keys, for messages.
        notes: What is kept, assumed or not known, in the order of lines.
        executions: Motions by the names of their moves in the tree.
        added: Waits of an earlier plan by the name of their move, and whether they stand before it.
        repeated: How often the statement runs, by the names of moves whose statement runs more than once: no wait can
            be added to one of them alone.
        passed: Names of moves before which the robot does not stop, as the motion that leads there has a zone.
    """

    tree: OperationTree
    places: Mapping[str, str]
    notes: tuple[Note, ...]
    executions: Mapping[str, Execution]
    added: Mapping[tuple[str, bool], tuple[Wait, ...]] = field(default_factory=dict)
    repeated: Mapping[str, int] = field(default_factory=dict)
    passed: frozenset[str] = frozenset()

    @cached_property
    def heads(self) -> frozenset[str]:
        """Names of the first moves of sections: a wait before one of them stands there, not behind the move before."""
        found, is_first = set(), True
        for operation in self.tree.operations:
            if isinstance(operation, MoveOperation):
                found |= {operation.name} if is_first else set()
                is_first = False
            else:
                is_first = is_first or isinstance(operation, UnknownOperation)
        return frozenset(found)
