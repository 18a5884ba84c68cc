"""New RAPID modules: joint motions with their durations."""

from __future__ import annotations

import math

import numpy as np

from robojoule.errors import InputError
from robojoule.formats.vendor.composing import Composed, degrees_text, identifiers, plain, steps_of
from robojoule.formats.vendor.rapid.data import ZONES_MM, predefined
from robojoule.formats.vendor.rapid.instructions import FUNCTIONS, HARMLESS, RESERVED, SETTINGS, WAITS
from robojoule.formats.vendor.rapid.machine import ADDED
from robojoule.formats.vendor.rapid.motions import FORMS
from robojoule.motion.simulation import MotionPaths
from robojoule.programs.operation_tree import OperationTree
from robojoule.programs.tree_check import check_tree
from robojoule.robots.pendant import PendantAngles
from robojoule.robots.robot import Robot

AXES = 6
_LONGEST = 32
_NOT_USED = "[9E9,9E9,9E9,9E9,9E9,9E9]"
_WAIT_STEP_S = 1e-3  # of WaitTime
_TAKEN = tuple(
    {"MAIN", "WAITTIME", *RESERVED, *predefined(), *FORMS, *WAITS, *HARMLESS, *SETTINGS, *FUNCTIONS},
)


def compose_rapid(tree: OperationTree, robot: Robot | None, name: str) -> Composed:
    r"""A new program; see `robojoule.formats.vendor.composing`. Its motions say how long they take (\T).

    Raises:
        InputError: No robot says how long the motions take, it has more axes than RAPID's, or it cannot get there.
    """
    if robot is None:
        problem = "RAPID says durations, and no robot says how long a motion at a share of its limits takes"
        raise InputError(problem, key="robot", allowed="a robot, as --robot")
    steps = steps_of(tree, robot)
    moves = [step for step in steps.steps if step.kind == "move"]
    if len(steps.start_rad) > AXES:
        raise InputError(f"RAPID has {AXES} axes, the program has {len(steps.start_rad)}")
    zones = _zones([move.radius_m for move in moves])
    own = [zone for zone in zones.values() if zone.startswith("zone")]
    program, start, *points = identifiers([name, "start", *(m.name for m in moves)], _LONGEST, (*_TAKEN, *own))
    durations, lost = _durations_s(tree, robot), list(steps.lost)
    angles = degrees_text([steps.start_rad, *(move.target_rad for move in moves)])
    lines = [f"MODULE {program}"]
    for point, values in zip([start, *points], angles, strict=True):
        joints = ",".join([*values, *["0"] * (AXES - len(values))])
        lines.append(f"  CONST jointtarget {point}:=[[{joints}],{_NOT_USED}];")
    for radius_mm, zone in zones.items():
        if zone.startswith("zone"):
            figures = ",".join(plain(share * radius_mm) for share in (1.0, 1.5, 1.5, 0.15, 1.5, 0.15))
            lines.append(f"  CONST zonedata {zone}:=[FALSE,{figures}];")
    lines += ["", "  PROC main()", f"    MoveAbsJ {start}\\NoEOffs,v1000,fine,tool0;"]
    pending = iter(zip(points, durations, moves, strict=True))
    for step in steps.steps:
        if step.kind == "wait":
            mark = f"{ADDED}: wait added by a plan" if step.added else f"! {step.name}"
            seconds = math.floor(step.seconds / _WAIT_STEP_S + 1e-6) * _WAIT_STEP_S
            if step.seconds - seconds > 1e-6:
                lost.append(f"the wait '{step.name}' is {plain(seconds, 3)} s, a whole number of milliseconds")
            lines.append(f"    WaitTime {plain(seconds, 3)}; {mark}")
        elif step.kind == "remark":
            lines.append(f"    ! {step.name}: nobody knows how long it takes")
        else:
            point, seconds, move = next(pending)
            timed = rf"\T:={plain(seconds, 5)}" if seconds > 0.0 else ""
            zone = zones[1e3 * move.radius_m] if move.radius_m else "fine"
            lines.append(f"    MoveAbsJ {point}\\NoEOffs,v1000{timed},{zone},tool0;")
    text = "".join(f"{line}\n" for line in [*lines, "  ENDPROC", "ENDMODULE"])
    return Composed({".mod": text}, tuple(lost))


def _durations_s(tree: OperationTree, robot: Robot) -> list[float]:
    """Durations of all moves, each from rest to rest, rounded down to the digits that are written. [s]"""
    check_tree(tree, robot)
    places = tree.configurations_rad()
    if tree.angles == "pendant":
        places = PendantAngles.of(robot).model_rad(places)
    moves = tree.moves()
    turning = np.flatnonzero(np.abs(np.diff(places, axis=0)).max(axis=1) > 0.0)
    durations = np.zeros(len(moves))
    if len(turning):
        limits = np.array([[moves[at].speed_limit_percent / 100.0] for at in turning])
        durations[turning] = MotionPaths(robot, places[turning], places[turning + 1]).durations(limits)[:, 0]
    return [float(value) for value in np.floor(durations * 1e5) / 1e5]


def _zones(radii_m: list[float]) -> dict[float, str]:
    """Names of zones by their radius in mm: those of the controller, else own ones."""
    known = {radius: f"z{zone}" for zone, radius in ZONES_MM.items()}
    found: dict[float, str] = {}
    for radius_m in radii_m:
        radius_mm = 1e3 * radius_m
        same = next((name for radius, name in known.items() if abs(radius - radius_mm) < 1e-6), None)
        if radius_mm and radius_mm not in found:
            found[radius_mm] = same or f"zone{len(found) + 1}"
    return found
