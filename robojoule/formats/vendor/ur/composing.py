"""New URScript programs."""

from __future__ import annotations

from robojoule.errors import InputError
from robojoule.formats.vendor.composing import Composed, identifiers, plain, steps_of
from robojoule.formats.vendor.ur.builtins import ALL
from robojoule.formats.vendor.ur.machine import ADDED
from robojoule.formats.vendor.ur.motions import MOTIONS
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.robot import Robot

_LONGEST = 60


def compose_ur(tree: OperationTree, robot: Robot | None, name: str) -> Composed:
    """A new program; see `robojoule.formats.vendor.composing`.

    Raises:
        InputError: No robot says how fast a share of its limits is.
    """
    if robot is None:
        problem = "speeds of URScript are in rad/s, and no robot says how fast a share of its limits is"
        raise InputError(problem, key="robot", allowed="a robot, as --robot")
    steps = steps_of(tree, robot)
    moves = [step for step in steps.steps if step.kind == "move"]
    taken = tuple(ALL | MOTIONS.keys())
    start, *points = identifiers(["start", *(move.name for move in moves)], _LONGEST, taken)
    (program,) = identifiers([name], _LONGEST, (*taken, *(f"{point}_q" for point in (start, *points))))
    lines = [f"def {program}():"]
    for point, position in zip([start, *points], [steps.start_rad, *(m.target_rad for m in moves)], strict=True):
        lines.append(f"  global {point}_q=[{', '.join(map(repr, position))}]")
    lines.append(f"  movej({start}_q)")
    pending = iter(points)
    for step in steps.steps:
        if step.kind == "wait":
            mark = f"{ADDED}: wait added by a plan" if step.added else f"# {step.name}"
            lines.append(f"  sleep({plain(step.seconds)}) {mark}")
        elif step.kind == "remark":
            lines.append(f"  # {step.name}: nobody knows how long it takes")
        else:
            speed = f", v={plain(step.leading_rad_s, 9)}" if step.leading_rad_s is not None else ""
            radius = f", r={plain(step.radius_m)}" if step.radius_m else ""
            lines.append(f"  movej({next(pending)}_q{speed}{radius})")
    return Composed({".script": "".join(f"{line}\n" for line in [*lines, "end"])}, (*steps.lost,))
