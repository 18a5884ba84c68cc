"""Plain data of a robot to a checked robot file: everything that is wrong with it is told at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from robojoule.documents import parse
from robojoule.errors import InputError, each_of, refuse
from robojoule.robots.robot_file import RobotFile, limit_problems, of_joint


def robot_file_of(data: Any, source: str, found: Iterable[InputError] = (), drive_file: str | None = None) -> RobotFile:
    """Check plain data of a robot.

    Args:
        data: What a robot file holds.
        source: How messages name it.
        found: What is wrong with it already.
        drive_file: Name of the drive file that can give limits and links, if there is one.

    Raises:
        InputError: All that was found: limits, structure and the bodies that joints move.
    """
    errors = list(found)
    if isinstance(data, Mapping) and isinstance(data.get("joints"), list):
        data = {**data, "joints": [with_limits(joint, source, errors, drive_file) for joint in data["joints"]]}
    try:
        file = parse(RobotFile, data, source)
    except InputError as error:
        errors += each_of(error)
    else:
        if errors:  # else the robot, which is assembled in any case, finds them
            errors += body_errors(file, source)
    refuse(errors)
    return file


def with_limits(joint: Any, source: str, errors: list[InputError], drive_file: str | None) -> Any:
    """A joint whose wrong limits have become errors, with figures in their place that let the other checks go on."""
    if not isinstance(joint, Mapping) or joint.get("type") != "revolute":
        return joint
    stand_ins: dict[str, float | None] = {}
    for one in limit_problems(joint):
        allowed = f"{one.allowed}: limits.{joint.get('name')}.{one.key} in {drive_file}" if drive_file else one.allowed
        errors.append(InputError(one.problem, file=source, key=of_joint(joint.get("name")), allowed=allowed))
        stand_ins |= one.stand_ins
    return {**joint, **stand_ins}


def body_errors(file: RobotFile, source: str) -> Iterable[InputError]:
    """What is wrong with the bodies that the joints of an arm move."""
    from robojoule.robots.mechanism import assemble  # late: listing robots needs no numpy

    try:
        assemble(file, source)
    except InputError as error:
        return each_of(error)
    return ()
