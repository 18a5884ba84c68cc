"""The operation tree (thesis 2.1.1): what a robot does in one cycle, in order.

Inner nodes group; leaves act, or say what the robot carries from there on (`robojoule.programs.operations`). Trees are
immutable: a plan is written back with `OperationTree.with_plan`, which returns a new tree.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from robojoule.arrays import Array
from robojoule.documents import Document
from robojoule.errors import InputError
from robojoule.inputs import LONGEST_S
from robojoule.programs.degree_keys import accepts_degrees, from_degrees
from robojoule.programs.operations import (
    LEAST_SPEED_PERCENT,
    MOST_POWER_W,
    PLANNED,
    AtomicOperation,
    CoarseZone,
    CompoundOperation,
    Configuration,
    MoveOperation,
    Name,
    Number,
    Operation,
    PayloadOperation,
    ProcessOperation,
    ShareZone,
    ToolPath,
    UnknownOperation,
    WaitOperation,
)
from robojoule.robots.pendant_file import Angles
from robojoule.robots.robot import Payload

__all__ = [
    "LEAST_SPEED_PERCENT",
    "MOST_POWER_W",
    "PLANNED",
    "AtomicOperation",
    "CoarseZone",
    "CompoundOperation",
    "MoveOperation",
    "Operation",
    "OperationTree",
    "PayloadOperation",
    "ProcessOperation",
    "ShareZone",
    "ToolPath",
    "UnknownOperation",
    "WaitOperation",
    "tree_from_configurations",
]

FORMAT: Literal["robojoule-operation-tree"] = "robojoule-operation-tree"
FORMAT_VERSION: Literal[1] = 1
CYCLE_DIGITS = 6  # of the cycle time that a tree was planned for [s]


def _inconsistent(key: str, problem: str) -> PydanticCustomError:
    # Braces would be taken for a template by pydantic: the text travels as data.
    return PydanticCustomError("tree", "{problem}", {"problem": problem, "key": key})


class OperationTree(Document):
    """One cycle of one robot: the root of the tree.

    Names are unique, there is at least one move, and a coarse zone is followed at once by moves of which one is
    fine (thesis 2.1.3): the robot cannot stop inside a coarse zone. Moves of a speed group have the same speeds.
    """

    model_config = ConfigDict(json_schema_extra=accepts_degrees("start"))

    format: Literal["robojoule-operation-tree"] = Field(description="Marks the file format.")
    version: Literal[1] = Field(description="Version of the file format.")
    name: Name = Field(description="Name of the tree.")
    robot: Name | None = Field(default=None, description="Catalog name of the robot it is written for; none: any.")
    angles: Angles = Field(
        default="model", description="Whether angles are those of the robot's model or as its pendant shows them."
    )
    planned_cycle_s: Annotated[Number, Field(gt=0, le=LONGEST_S)] | None = Field(
        default=None, description="Cycle time that the plan in it was made for, which plans write; none: no plan. [s]"
    )
    start_rad: Configuration = Field(description="Joint configuration at the start of the cycle (HOME). [rad]")
    operations: tuple[Operation, ...] = Field(min_length=1, description="Operations in order of execution.")

    @model_validator(mode="before")
    @classmethod
    def _degrees(cls, data: Any) -> Any:
        return from_degrees(data, "start")

    @model_validator(mode="after")
    def _consistent(self) -> OperationTree:
        seen: dict[str, str] = {}
        for key, operation in self.walk():
            if operation.name in seen:
                raise _inconsistent(
                    f"{key}.name", f"the name '{operation.name}' is already used at {seen[operation.name]}"
                )
            seen[operation.name] = key
        if not self.moves():
            raise _inconsistent("operations", "the tree has no move operation")
        self._check_zones()
        self._check_groups()
        return self

    def _check_groups(self) -> None:
        known: dict[str, MoveOperation] = {}
        for key, move in self.walk():
            if not isinstance(move, MoveOperation) or move.speed_group is None:
                continue
            first = known.setdefault(move.speed_group, move)
            for field in ("speed_limit_percent", "least_speed_percent", "fixed"):
                if getattr(move, field) != getattr(first, field):
                    problem = f"moves '{first.name}' and '{move.name}' of speed group '{move.speed_group}' differ in it"
                    raise _inconsistent(f"{key}.{field}", problem)

    def _check_zones(self) -> None:
        steps = [(key, step) for key, step in self.walk() if not isinstance(step, CompoundOperation)]
        for (key, step), (_, following) in zip(steps, [*steps[1:], ("", None)], strict=True):
            if not isinstance(step, MoveOperation) or step.is_fine:
                continue
            problem = f"move '{step.name}' has a coarse zone"
            if step.tool_path is not None:
                raise _inconsistent(
                    f"{key}.zone", f"{problem}, but its path is that of the tool, which stops at its end"
                )
            if isinstance(following, MoveOperation) and following.tool_path is not None:
                text = f"{problem}, so '{following.name}' behind it cannot have a path of the tool"
                raise _inconsistent(f"{key}.zone", text)
            if following is None:
                raise _inconsistent(f"{key}.zone", f"{problem} but no fine move after it")
            if not isinstance(following, MoveOperation):
                text = f"{problem}, so a fine move must come before {following.type} '{following.name}'"
                raise _inconsistent(f"{key}.zone", text)
            if step.all_after_s or following.all_before_s:
                raise _inconsistent(f"{key}.zone", f"{problem}, so there can be no wait before '{following.name}'")

    def walk(self) -> Iterator[tuple[str, Operation]]:
        """Every operation with its key in the file ("operations.0.operations.2"), parents before children."""

        def descend(operations: tuple[Operation, ...], key: str) -> Iterator[tuple[str, Operation]]:
            for index, operation in enumerate(operations):
                yield f"{key}.{index}", operation
                if isinstance(operation, CompoundOperation):
                    yield from descend(operation.operations, f"{key}.{index}.operations")

        return descend(self.operations, "operations")

    def atomic(self) -> tuple[AtomicOperation, ...]:
        """Moves, waits, process steps and changes of payload in order of execution."""
        return tuple(operation for _, operation in self.walk() if not isinstance(operation, CompoundOperation))

    def moves(self) -> tuple[MoveOperation, ...]:
        """Moves in order of execution."""
        return tuple(operation for operation in self.atomic() if isinstance(operation, MoveOperation))

    def payloads(self) -> tuple[Payload | None, ...]:
        """What the robot carries in each move, in order of execution; None: what it was given."""
        found: list[Payload | None] = []
        carried: Payload | None = None
        for operation in self.atomic():
            if isinstance(operation, PayloadOperation):
                carried = operation.payload()
            elif isinstance(operation, MoveOperation):
                found.append(carried)
        return tuple(found)

    def payloads_kg(self, given_kg: float) -> list[float]:
        """What the robot carries in the moves, each mass once, in the order of the moves. [kg]

        Args:
            given_kg: What it was given, which counts until the program sets something else. [kg]
        """
        return list(dict.fromkeys(given_kg if one is None else float(one.mass_kg) for one in self.payloads()))

    @property
    def added_waits_s(self) -> float:
        """Sum of the waits that a plan has added. [s]"""
        return sum(move.added_wait_before_s + move.added_wait_after_s for move in self.moves())

    def configurations_rad(self) -> Array:
        """Joint configurations from the start on: (moves + 1, joints). [rad]

        Raises:
            ValueError: The targets have different numbers of joints (see `check_tree`).
        """
        return np.array([self.start_rad, *(move.target_rad for move in self.moves())])

    def with_plan(
        self,
        speed_limits_percent: Mapping[str, float],
        *,
        waits_before_s: Mapping[str, float] | None = None,
        waits_after_s: Mapping[str, float] | None = None,
        added_waits_before_s: Mapping[str, float] | None = None,
        added_waits_after_s: Mapping[str, float] | None = None,
    ) -> OperationTree:
        """Write a plan back: a new tree with other speed limits and waits of its moves.

        Args:
            speed_limits_percent: Speed limit per name of a move; moves not named keep theirs. [%]
            waits_before_s: Wait before the move, per name of a move. [s]
            waits_after_s: Wait after the move, per name of a move. [s]
            added_waits_before_s: Further wait before the move that the next plan may take away. [s]
            added_waits_after_s: Further wait after the move that the next plan may take away. [s]

        Returns:
            The new tree; nothing else differs.

        Raises:
            InputError: A name is not that of a move of this tree, or a value is out of range.
        """
        settings: dict[str, dict[str, float]] = {}
        given = (speed_limits_percent, waits_before_s, waits_after_s, added_waits_before_s, added_waits_after_s)
        for field, values in zip(PLANNED, given, strict=False):
            for name, value in (values or {}).items():
                settings.setdefault(name, {})[field] = float(value)
        return self.with_settings(settings)

    def with_settings(self, settings: Mapping[str, Mapping[str, Any]]) -> OperationTree:
        """A new tree with other values of some keys of its moves.

        Args:
            settings: New values by their keys, per name of a move.

        Raises:
            InputError: A name is not that of a move of this tree, or a value is out of range.
        """
        unknown = sorted(settings.keys() - {move.name for move in self.moves()})
        if unknown:
            raise InputError(f"the tree '{self.name}' has no move '{unknown[0]}'")

        def rewrite(operation: dict[str, Any]) -> dict[str, Any]:
            if operation["type"] == "compound":
                return {**operation, "operations": [rewrite(child) for child in operation["operations"]]}
            return {**operation, **settings.get(operation["name"], {})} if operation["type"] == "move" else operation

        data = self.model_dump()
        try:
            return OperationTree.model_validate(
                {**data, "operations": [rewrite(child) for child in data["operations"]]}
            )
        except ValidationError as error:
            details = error.errors(include_url=False)[0]
            key = ".".join(str(part) for part in details["loc"])
            said = details["msg"].removeprefix("Value error, ")
            raise InputError(f"the plan does not fit the tree '{self.name}': {said}", key=key) from None

    def planned_for(self, cycle_time_s: float) -> OperationTree:
        """The tree, saying for which cycle time the plan in it was made. [s]"""
        return self.model_copy(update={"planned_cycle_s": round(cycle_time_s, CYCLE_DIGITS)})

    def bounded_by(self, given: OperationTree) -> OperationTree:
        """The tree, saying of each move the speed limit that the program had before its first plan.

        Args:
            given: The tree that this plan was made from; its speed limits are the program's own unless it is a plan
                itself, which says for which cycle time it was made.
        """
        settings = {}
        for move, was in zip(self.moves(), given.moves(), strict=True):
            own = was.most_speed_percent
            if own is None and given.planned_cycle_s is None and not was.fixed and was.speed_limit_percent < 100.0:
                own = was.speed_limit_percent
            if own is not None:  # faster was allowed where it is
                settings[move.name] = {"most_speed_percent": 100.0 if move.speed_limit_percent > own else own}
        return self.with_settings(settings) if settings else self

    def at_most_speeds(self) -> OperationTree:
        """The tree without waits that a plan added, each move that is not fixed as fast as the program let it be."""
        limits = {
            move.name: 100.0 if move.most_speed_percent is None else move.most_speed_percent
            for move in self.moves()
            if not move.fixed
        }
        return self.without_plan().with_plan(limits)

    def without_plan(self, *, full_speed: bool = False) -> OperationTree:
        """The tree without the waits that a plan added.

        Args:
            full_speed: Whether moves that are not fixed get all of their speed, too.
        """
        none = {move.name: 0.0 for move in self.moves()}
        limits = {move.name: 100.0 for move in self.moves() if full_speed and not move.fixed}
        return self.with_plan(limits, added_waits_before_s=none, added_waits_after_s=none)


def tree_from_configurations(
    name: str,
    configurations_rad: ArrayLike,
    robot_name: str | None = None,
    *,
    move_names: Sequence[str | None] | None = None,
) -> OperationTree:
    """Operation tree of fine moves at 100 % through a sequence of configurations.

    Args:
        name: Name of the tree.
        configurations_rad: Start and targets, shape (moves + 1, n). [rad]
        robot_name: Robot for which the tree is written.
        move_names: Names of the moves; by their number where there is none.
    """
    start, *targets = np.asarray(configurations_rad, dtype=float).tolist()
    width = len(str(len(targets)))
    names = move_names if move_names is not None else [None] * len(targets)
    moves = tuple(
        MoveOperation(name=given or f"move-{order:0{width}d}", target_rad=tuple(target))
        for order, (given, target) in enumerate(zip(names, targets, strict=True), start=1)
    )
    return OperationTree(
        format=FORMAT,
        version=FORMAT_VERSION,
        name=name,
        robot=robot_name,
        start_rad=tuple(start),
        operations=moves,
    )
