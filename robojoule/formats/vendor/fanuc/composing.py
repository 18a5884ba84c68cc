"""New teach pendant programs: motions to positions by joint angles."""

from __future__ import annotations

import math

from robojoule.errors import InputError
from robojoule.formats.vendor.composing import Composed, degrees_text, identifiers, renamed, steps_of
from robojoule.formats.vendor.fanuc.flow import ADDED
from robojoule.formats.vendor.fanuc.positions import JOINTS
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.robot import Robot

_LONGEST_PROGRAM, _LONGEST_POINT, _LONGEST_REMARK = 32, 16, 32
# Names of devices, which no file can have.
_DEVICES = ("CON", "PRN", "AUX", "NUL", *(f"{port}{at}" for port in ("COM", "LPT") for at in range(1, 10)))
_MOST_WAIT_S = 327.67


def compose_teach_pendant(tree: OperationTree, robot: Robot | None, name: str) -> Composed:
    """A new program; see `robojoule.formats.vendor.composing`.

    Raises:
        InputError: The robot has another number of axes, or a wait is longer than the language can say.
    """
    steps = steps_of(tree, robot, shares=True)
    moves = [step for step in steps.steps if step.kind == "move"]
    if len(steps.start_rad) != len(JOINTS):
        raise InputError(f"teach pendant programs have {len(JOINTS)} axes, the program has {len(steps.start_rad)}")
    lost = list(steps.lost)
    (program,) = identifiers([name], _LONGEST_PROGRAM, _DEVICES)
    lost += renamed(name, program)
    points = identifiers([move.name for move in moves], _LONGEST_POINT, ("START",))
    codes = ["UFRAME_NUM=0", "UTOOL_NUM=1", "J P[1:START] 100% FINE"]
    number = 1
    for step in steps.steps:
        if step.kind == "wait":
            if step.seconds > _MOST_WAIT_S:
                raise InputError(f"a wait of {step.seconds:g} s is too long", allowed=f"up to {_MOST_WAIT_S:g} s")
            hundredths = math.floor(100.0 * step.seconds + 1e-6) / 100.0
            if abs(hundredths - step.seconds) > 1e-6:
                lost.append(f"the wait at '{step.name}' is {hundredths:g} s instead of {step.seconds:g} s")
            codes.append(ADDED if step.added else f"!{_plain(step.name)}")
            codes.append(f"WAIT {hundredths:6.2f}(sec)")
        elif step.kind == "remark":
            codes.append(f"!{_plain(step.name)} not known")
        else:
            number += 1
            whole = min(max(math.ceil(step.percent - 1e-6), 1), 100)
            if whole != step.percent:
                lost.append(f"the speed limit of '{step.name}' is {whole} % instead of {step.percent:g} %")
            if step.radius_m:
                lost.append(f"the zone of '{step.name}' is CNT100: CNT is not a radius")
            zone = "CNT100" if step.radius_m else f"CNT{round(200.0 * step.path_share)}" if step.path_share else "FINE"
            codes.append(f"J P[{number}:{points[number - 2]}] {whole}% {zone}")
    rows = [f"{at:4d}:{'' if code.startswith('J P[') else '  '}{code} ;" for at, code in enumerate(codes, start=1)]
    angles = degrees_text([steps.start_rad, *(move.target_rad for move in moves)])
    text = [
        *(
            f"/PROG  {program.upper()}",
            "/ATTR",
            "OWNER\t\t= MNEDITOR;",
            'COMMENT\t\t= "";',
            f"LINE_COUNT\t= {len(rows)};",
        ),
        *("PROTECT\t\t= READ_WRITE;", "DEFAULT_GROUP\t= 1,*,*,*,*;", "CONTROL_CODE\t= 00000000 00000000;", "/MN"),
        *rows,
        "/POS",
    ]
    for at, (point, values) in enumerate(zip(["START", *points], angles, strict=True), start=1):
        joints = [f"\t{joint}= {value} deg" for joint, value in zip(JOINTS, values, strict=True)]
        text += [f'P[{at}:"{point}"]{{', "   GP1:", "\tUF : 0, UT : 1,\t", ",\n".join(joints), "};"]
    return Composed({".ls": "".join(f"{line}\n" for line in [*text, "/END"])}, (*lost,))


def _plain(name: str) -> str:
    """A name as a remark: short, and without what would end it."""
    return "".join(letter if letter.isascii() and letter != ";" else "_" for letter in name)[: _LONGEST_REMARK - 10]
