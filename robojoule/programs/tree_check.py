"""Whether a robot can execute an operation tree."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from robojoule.errors import InputError
from robojoule.programs.operation_tree import (
    CompoundOperation,
    MoveOperation,
    Operation,
    OperationTree,
    PayloadOperation,
    UnknownOperation,
)
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.pendant_file import Angles
from robojoule.robots.robot import Robot


def check_tree(
    tree: OperationTree,
    robot: Robot,
    source: str | Path | None = None,
    places: Mapping[str, str] | None = None,
) -> None:
    """Check that a robot can execute a tree: name, joint count and limits of every configuration, payloads.

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
    counted = "" if tree.angles == "model" else " in angles of the model"
    mapping = None if tree.angles == "model" else PendantAngles.of(robot)
    configurations = [("start_rad", "the start", tree.start_rad)]
    for key, operation in tree.walk():
        if isinstance(operation, MoveOperation):
            configurations.append((f"{key}.target_rad", f"move '{operation.name}'", operation.target_rad))
        if isinstance(operation, PayloadOperation):
            robot.file.check_payload(operation.mass_kg, file=source, key=f"{key}.mass_kg")
        elif isinstance(operation, UnknownOperation) and operation.target_rad is not None:
            configurations.append((f"{key}.target_rad", f"operation '{operation.name}'", operation.target_rad))
    for key, what, values in configurations:
        try:
            is_mapped = mapping is not None and len(values) == robot.joint_count
            robot.check_configuration(mapping.model_rad(values) if mapping and is_mapped else values)
        except InputError as error:
            place = (places or {}).get(key, key)
            problem = f"{what}: {error.problem}{counted}"
            raise InputError(problem, file=source, key=place, allowed=error.allowed) from None


def with_angles(tree: OperationTree, angles: Angles, configurations_rad: ArrayLike) -> OperationTree:
    """A tree with other numbers for the same configurations.

    Args:
        tree: The tree.
        angles: How the numbers count.
        configurations_rad: Start and targets, shape (moves + 1, n). [rad]
    """
    start, *targets = np.asarray(configurations_rad, dtype=float).tolist()
    pending = iter(targets)

    def rewrite(operation: Operation) -> Operation:
        if isinstance(operation, CompoundOperation):
            return operation.model_copy(update={"operations": tuple(map(rewrite, operation.operations))})
        if isinstance(operation, MoveOperation):
            return operation.model_copy(update={"target_rad": tuple(next(pending))})
        return operation

    changes = {"angles": angles, "start_rad": tuple(start), "operations": tuple(map(rewrite, tree.operations))}
    return tree.model_copy(update=changes)


def in_model_angles(tree: OperationTree, robot: Robot) -> OperationTree:
    """The tree in angles of the robot's model, in which everything is computed.

    Raises:
        InputError: The tree is in angles of the pendant, and the robot's file does not say how that counts.
    """
    if tree.angles == "model":
        return tree
    return with_angles(tree, "model", PendantAngles.of(robot).model_rad(tree.configurations_rad()))


def robot_warnings(tree: OperationTree, robot: Robot) -> tuple[str, ...]:
    """What to know about the robot before its tree is used, a sentence each: doubts, and how its pendant counts."""
    return (*map(str, robot.doubts), *_angle_warnings(tree, robot))


def _angle_warnings(tree: OperationTree, robot: Robot) -> tuple[str, ...]:
    """What to say of a tree without its angles stated, for a robot whose pendant counts otherwise than its model."""
    if "angles" in tree.model_fields_set or robot.file.pendant is None:
        return ()
    joints = ", ".join(robot.file.pendant.joints)
    if not joints:
        return ()
    taken = f"joint angles are taken as those of the model, but the pendant of {robot.name} counts {joints} otherwise"
    return (f"{taken}: say angles: pendant (or model) in the file, or --angles",)
