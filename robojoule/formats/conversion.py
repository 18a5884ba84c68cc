"""Programs from one format to another, as far as the other one can say them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from robojoule.documents import check_output
from robojoule.errors import InputError
from robojoule.formats.format import Format
from robojoule.formats.joint_motions import as_joint_motions
from robojoule.formats.position_files import PositionFiles
from robojoule.formats.program import Program
from robojoule.formats.registry import companions_of, format_of
from robojoule.formats.vendor.files import VendorFiles
from robojoule.inputs import as_path
from robojoule.programs.operation_tree import (
    CompoundOperation,
    MoveOperation,
    Operation,
    OperationTree,
    PayloadOperation,
    UnknownOperation,
)
from robojoule.robots.robot import Robot

_NAME = re.compile(r"'[^']*'")
_MOST_NAMED = 6  # of what a sentence holds for, beside the first


@dataclass(frozen=True)
class Conversion:
    """A program that was written in another format.

    Attributes:
        path: The file.
        format: Name of its format.
        files: All files that were written, that one first.
        moves: How many moves it has.
        lost: What the format cannot say, a sentence each.
    """

    path: Path
    format: str
    files: tuple[Path, ...]
    moves: int
    lost: tuple[str, ...]


def converted(program: Program, path: str | Path, robot: Robot | None = None) -> Conversion:
    """Write a program in the format that a suffix names.

    Args:
        program: The program.
        path: File to write.
        robot: Robot that executes it, where one of the formats needs its figures.

    Raises:
        InputError: Unknown suffix, a program that the format cannot hold at all, or a file that cannot be written.
    """
    target = as_path(path, "path")
    check_output(target)
    known = program if robot is None else program.for_robot(robot)
    found, tree = format_of(target), known.tree
    if known.source is not None and found.name == known.format:
        known.save(target)
        return Conversion(target, found.name, (target, *companions_of(target)), len(tree.moves()), ())
    lost = _written(found, known, tree, target, robot)
    lost = (*(f"{note} (of the program that was read)" for note in known.notes), *_said_once(lost))
    return Conversion(target, found.name, (target, *companions_of(target)), len(tree.moves()), lost)


def _said_once(sentences: Sequence[str]) -> list[str]:
    """Sentences of which those that differ in a name alone are one, with the other names behind it."""
    names: dict[str, list[str]] = {}
    first: dict[str, str] = {}
    for sentence in sentences:
        kind = _NAME.sub("''", sentence)
        first.setdefault(kind, sentence)
        names.setdefault(kind, []).append(" ".join(_NAME.findall(sentence)))
    found = []
    for kind, sentence in first.items():
        _, *others = names[kind]
        more = f", and {len(others) - _MOST_NAMED} more" if len(others) > _MOST_NAMED else ""
        found.append(sentence + (f" (and so of {', '.join(others[:_MOST_NAMED])}{more})" if others else ""))
    return found


def _written(
    found: Format, program: Program, tree: OperationTree, target: Path, robot: Robot | None
) -> tuple[str, ...]:
    if isinstance(found, VendorFiles):
        return found.create(tree, target, robot)
    lost: list[str] = []
    if isinstance(found, PositionFiles):
        tree, unsaid = as_joint_motions(tree, robot)
        tree, lost = _moves_alone(tree)
        lost = [*unsaid, *lost]
    replace(program, tree=tree, source=None).save(target)
    return tuple(lost)


def _moves_alone(tree: OperationTree) -> tuple[OperationTree, list[str]]:
    """A tree as a row of fine moves with their waits, and what that does not say."""
    lost: list[str] = []
    moves: list[MoveOperation] = []
    pending_s = 0.0

    def take(operations: tuple[Operation, ...]) -> None:
        nonlocal pending_s
        for operation in operations:
            if isinstance(operation, CompoundOperation):
                lost.append(f"group '{operation.name}' is not kept together")
                take(operation.operations)
            elif isinstance(operation, UnknownOperation):
                lost.append(f"'{operation.name}', of which nobody knows how long it takes, is left out")
            elif isinstance(operation, MoveOperation):
                if not operation.is_fine:
                    lost.append(f"the zone of move '{operation.name}' is left out: it stops at its target")
                if operation.speed_group is not None:
                    lost.append(f"the speed group of move '{operation.name}' is left out")
                wait_s, pending_s = operation.wait_before_s + pending_s, 0.0
                changes = {"zone": "fine", "speed_group": None, "wait_before_s": wait_s}
                moves.append(operation.model_copy(update=changes))
            elif isinstance(operation, PayloadOperation):
                lost.append(f"the payload of '{operation.name}' is left out")
            elif moves:
                lost.append(f"{operation.type} '{operation.name}' is a wait of the move before it")
                wait_s = moves[-1].wait_after_s + operation.duration_s
                moves[-1] = moves[-1].model_copy(update={"wait_after_s": wait_s})
            else:
                lost.append(f"{operation.type} '{operation.name}' is a wait of the first move")
                pending_s += operation.duration_s

    take(tree.operations)
    unknown = [one for one in tree.atomic() if isinstance(one, UnknownOperation) and one.target_rad is not None]
    if unknown:
        problem = f"nobody knows how the robot moves in '{unknown[0].name}', which rows of positions cannot say"
        raise InputError(problem, allowed="another format")
    return tree.model_copy(update={"operations": tuple(moves)}), lost
