"""Moves of operation trees along a path of the tool, as motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.motion.tool_motions import ToolMove
from robojoule.programs.operation_tree import MoveOperation, OperationTree
from robojoule.robots.robot import Robot
from robojoule.robots.tool_following import Followed


@dataclass(frozen=True, eq=False)
class NamedToolMove(ToolMove):
    """A motion of the tool with the name of its move, for messages."""

    name: str = ""

    def followed(self, robot: Robot) -> Followed:
        """How the joints of a robot follow it.

        Raises:
            InputError: They cannot; says why.
        """
        try:
            return super().followed(robot)
        except InputError as error:
            problem = f"the tool of {robot.name} cannot follow the path of move '{self.name}': {error.problem}"
            raise InputError(problem, allowed="a path within reach, or path: joint") from None


def tool_moves_of_tree(tree: OperationTree) -> list[NamedToolMove | None]:
    """Motions along a path of the tool, with None in place of all others, in order of execution."""
    points = tree.configurations_rad()
    found: list[NamedToolMove | None] = []
    for place, move in enumerate(tree.moves()):
        if move.tool_path is not None:
            found.append(_tool_move(move, points[place]))
        elif move.is_fine:
            found.append(None)
    return found


def _tool_move(move: MoveOperation, start_rad: Array) -> NamedToolMove:
    path = move.tool_path
    assert path is not None
    return NamedToolMove(
        start_rad=start_rad,
        end_rad=np.array(move.target_rad),
        tool_m=path.tool_m,
        via_m=path.via_m,
        acceleration_m_s2=path.acceleration_m_s2,
        acceleration_rad_s2=path.acceleration_rad_s2,
        name=move.name,
    )
