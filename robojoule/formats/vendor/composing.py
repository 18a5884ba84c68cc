"""What every vendor's language must be told of an operation tree to make a new program of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.vendor.speeds import leading_share
from robojoule.programs.operation_tree import (
    CoarseZone,
    CompoundOperation,
    MoveOperation,
    Operation,
    OperationTree,
    PayloadOperation,
    ProcessOperation,
    ShareZone,
    UnknownOperation,
)
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.robot import Robot


@dataclass(frozen=True)
class Step:
    """One line of a new program.

    Attributes:
        kind: A joint motion, a wait, or a remark.
        name: Name of the operation.
        target_rad: Where a motion ends, angles of the pendant. [rad]
        percent: Its speed limit. [%]
        leading_rad_s: The same of the joint that turns farthest; None: no robot is known, or nothing turns. [rad/s]
        radius_m: Within this distance of the target the next motion may begin; 0: it stops there. [m]
        path_share: Or over this share of the motions on both sides; 0 likewise. [-]
        seconds: Length of a wait. [s]
        added: Whether a plan has added the wait.
    """

    kind: Literal["move", "wait", "remark"]
    name: str
    target_rad: tuple[float, ...] = ()
    percent: float = 100.0
    leading_rad_s: float | None = None
    radius_m: float = 0.0
    path_share: float = 0.0
    seconds: float = 0.0
    added: bool = False


@dataclass(frozen=True)
class Composed:
    """A new program.

    Attributes:
        texts: Texts of its files by their suffixes, that of the named file first.
        lost: What the language cannot say, a sentence each.
    """

    texts: Mapping[str, str]
    lost: tuple[str, ...] = ()


Compose = Callable[[OperationTree, "Robot | None", str], Composed]


@dataclass
class Steps:
    """A tree as steps, in the angles that a pendant shows.

    Attributes:
        start_rad: Where the cycle starts. [rad]
        steps: The steps.
        lost: What they do not say, a sentence each.
    """

    start_rad: tuple[float, ...]
    steps: list[Step] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)


def steps_of(tree: OperationTree, robot: Robot | None, *, shares: bool = False) -> Steps:
    """The steps of a tree.

    Args:
        tree: The tree.
        robot: Robot that executes it; None: its numbers are taken as they are.
        shares: Whether the language has zones that are shares of the motions beside them.

    Raises:
        InputError: The tree is in angles of the model, and no robot says what the pendant shows.
    """
    lost: list[str] = []
    shown = _shown(tree, robot, lost)
    found = Steps(shown(tree.start_rad), lost=lost)
    position = found.start_rad
    for operation in _flat(tree.operations, lost):
        if isinstance(operation, MoveOperation):
            target = shown(operation.target_rad)
            found.steps += _moved(operation, position, target, robot)
            position = target
            found.lost += _unsaid(operation)
            if isinstance(operation.zone, ShareZone) and not shares:
                found.lost.append(f"the zone of move '{operation.name}', a share of the path, is left out: it stops")
        elif isinstance(operation, PayloadOperation):
            found.lost.append(f"the payload of '{operation.name}' is left out")
        elif isinstance(operation, UnknownOperation):
            found.steps.append(Step("remark", operation.name))
            text = f"'{operation.name}', of which nobody knows how long it takes, is a remark"
            if operation.target_rad is not None:
                text += ": the robot does not go to where it ends"
            found.lost.append(text)
            position = shown(operation.target_rad) if operation.target_rad is not None else position
        elif not isinstance(operation, CompoundOperation):
            found.steps.append(Step("wait", operation.name, seconds=operation.duration_s))
            if isinstance(operation, ProcessOperation) and operation.power_w:
                found.lost.append(f"process '{operation.name}' is a wait, without its power")
    return found


def _flat(operations: tuple[Operation, ...], lost: list[str]) -> Iterator[Operation]:
    for operation in operations:
        if isinstance(operation, CompoundOperation):
            lost.append(f"group '{operation.name}' is not kept together")
            yield from _flat(operation.operations, lost)
        else:
            yield operation


def _shown(
    tree: OperationTree, robot: Robot | None, lost: list[str]
) -> Callable[[tuple[float, ...]], tuple[float, ...]]:
    """What turns positions of a tree into what the pendant shows."""
    if tree.angles == "pendant":
        return tuple
    if robot is None:
        problem = "the program is in angles of a robot's model, not of its pendant"
        raise InputError(problem, key="robot", allowed="a robot, as --robot")
    if robot.file.pendant is None:
        lost.append(f"angles are those of the model: the file of {robot.name} does not say how its pendant counts")
        return tuple
    mapping = PendantAngles.of(robot)
    if np.array_equal(mapping.matrix, np.eye(robot.joint_count)) and not mapping.zero_rad.any():
        return tuple  # the very same numbers
    return lambda position: tuple(mapping.pendant_rad(position).tolist())


def _moved(
    move: MoveOperation, start: tuple[float, ...], target: tuple[float, ...], robot: Robot | None
) -> Iterator[Step]:
    """A move with its waits."""
    for seconds, added in ((move.wait_before_s, False), (move.added_wait_before_s, True)):
        if seconds:
            yield Step("wait", move.name, seconds=seconds, added=added)
    share = leading_share(start, target, robot) if robot is not None else 0.0
    yield Step(
        "move",
        move.name,
        target,
        move.speed_limit_percent,
        move.speed_limit_percent / 100.0 / share if share > 0.0 else None,
        move.zone.radius_m if isinstance(move.zone, CoarseZone) else 0.0,
        move.zone.path_share if isinstance(move.zone, ShareZone) else 0.0,
    )
    for seconds, added in ((move.wait_after_s, False), (move.added_wait_after_s, True)):
        if seconds:
            yield Step("wait", move.name, seconds=seconds, added=added)


def _unsaid(move: MoveOperation) -> Iterator[str]:
    if move.tool_path is not None:
        yield f"move '{move.name}', along a path of the tool, is a joint motion"
    if move.fixed:
        yield f"that move '{move.name}' is fixed is not said"
    if move.least_speed_percent is not None:
        yield f"the least speed of move '{move.name}' is not said"
    if move.speed_group is not None:
        yield f"the speed group of move '{move.name}' is not said"


def identifiers(names: list[str], longest: int, taken: tuple[str, ...] = ()) -> list[str]:
    """Names as languages take them: letters, digits and underscores, each once in any case."""
    used = {name.upper() for name in taken}
    found = []
    for name in names:
        plain = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in name).strip("_") or "P"
        plain = plain if plain[0].isalpha() else f"P{plain}"
        number, made = 1, plain[:longest]
        while made.upper() in used:
            number += 1
            made = f"{plain[: longest - len(str(number)) - 1]}_{number}"
        used.add(made.upper())
        found.append(made)
    return found


def renamed(stem: str, program: str) -> Iterator[str]:
    """What to know where a program cannot have the name of its file."""
    if program.upper() != stem.upper():
        yield f"the program is called {program}, as its file must be on the controller: '{stem}' cannot be its name"


def degrees_text(positions: list[tuple[float, ...]]) -> list[list[str]]:
    """Angles in degrees, in as few digits as read back as the very same radians."""
    return [[_degrees(value) for value in position] for position in positions]


def _degrees(radians: float) -> str:
    for digits in (3, 6, 9, 12):
        text = f"{round(float(np.degrees(radians)), digits) + 0.0:.{digits}f}".rstrip("0").rstrip(".")
        if float(np.radians(float(text))) == radians:
            return text
    return f"{float(np.degrees(radians)):.12f}".rstrip("0").rstrip(".")


def decimal(value: float) -> str:
    """A number with at most six decimals, and one at least."""
    text = plain(value)
    return text if "." in text else f"{text}.0"


def plain(value: float, digits: int = 6) -> str:
    """A number without what it does not need."""
    return f"{value:.{digits}f}".rstrip("0").rstrip(".") or "0"
