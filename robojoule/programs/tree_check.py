"""Whether a robot can execute an operation tree."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from robojoule.errors import InputError
from robojoule.programs.operation_tree import MoveOperation, OperationTree
from robojoule.robots.robot import Robot


def check_tree(
    tree: OperationTree,
    robot: Robot,
    source: str | Path | None = None,
    places: Mapping[str, str] | None = None,
) -> None:
    """Check that a robot can execute a tree: name, joint count and joint limits of every configuration.

    Args:
        tree: Tree to check.
        robot: Robot that shall execute it.
        source: Name of the file for messages.
        places: What messages say in place of the keys.

    Raises:
        InputError: First violation, naming the operation and the joint.
    """
    if not robot.takes_programs_of(tree.robot):
        problem = f"the tree is written for robot '{tree.robot}', not for '{robot.name}'"
        raise InputError(problem, file=source, key=(places or {}).get("robot", "robot"))
    configurations = [("start_rad", "the start", tree.start_rad)]
    for key, operation in tree.walk():
        if isinstance(operation, MoveOperation):
            configurations.append((f"{key}.target_rad", f"move '{operation.name}'", operation.target_rad))
    for key, what, values in configurations:
        try:
            robot.check_configuration(values)
        except InputError as error:
            place = (places or {}).get(key, key)
            raise InputError(f"{what}: {error.problem}", file=source, key=place, allowed=error.allowed) from None
