"""New KRL programs: points in the .dat, motions and waits in the .src."""

from __future__ import annotations

from robojoule.errors import InputError
from robojoule.formats.vendor.composing import Composed, degrees_text, identifiers, plain, renamed, steps_of
from robojoule.formats.vendor.krl.machine import ADDED
from robojoule.formats.vendor.krl.targets import AXIS_NAMES
from robojoule.programs.operation_tree import OperationTree
from robojoule.robots.robot import Robot

# Words of KRL, and programs of every controller: no program can have their names.
_WORDS = {"AND", "ANIN", "ANOUT", "AXIS", "BAS", "BOOL", "BRAKE", "B_AND", "B_EXOR", "B_NOT", "B_OR", "CASE"}
_WORDS |= {"CAST_FROM", "CAST_TO", "CCLOSE", "CHANNEL", "CHAR", "CIRC", "CIRC_REL", "CONFIRM", "CONST", "CONST_VEL"}
_WORDS |= {"CONTINUE", "COPEN", "CREAD", "CWRITE", "C_DIS", "C_ORI", "C_PTP", "C_SPL", "C_VEL", "DECL", "DEF"}
_WORDS |= {"DEFAULT", "DEFDAT", "DEFFCT", "DELAY", "DIGIN", "DISTANCE", "DO", "E3AXIS", "E3POS", "E6AXIS", "E6POS"}
_WORDS |= {"ELSE", "END", "ENDDAT", "ENDFCT", "ENDFOR", "ENDIF", "ENDLOOP", "ENDSPLINE", "ENDSWITCH", "ENDWHILE"}
_WORDS |= {"ENUM", "EXIT", "EXOR", "EXT", "EXTFCT", "FALSE", "FOR", "FRAME", "GLOBAL", "GOTO", "HALT", "IF", "IMPORT"}
_WORDS |= {"INT", "INTERRUPT", "IR_STOPM", "IS", "LIN", "LIN_REL", "LOOP", "MAXIMUM", "MINIMUM", "NOT", "OFF", "ON"}
_WORDS |= {"OR", "PATH", "POS", "PRIO", "PTP", "PTP_REL", "PTP_SPLINE", "PUBLIC", "PULSE", "REAL", "REPEAT", "RESUME"}
_WORDS |= {"RETURN", "SCIRC", "SCIRC_REL", "SEC", "SIGNAL", "SLIN", "SLIN_REL", "SPL", "SPLINE", "SPS", "SPTP"}
_WORDS |= {"SPTP_REL", "SREAD", "STEP", "STRUC", "SWITCH", "SWRITE", "THEN", "TIME_BLOCK", "TO", "TRIGGER", "TRUE"}
_WORDS |= {"UNTIL", "WAIT", "WHEN", "WHILE", "WITH"}
_LONGEST = 22  # of names: KRL takes 24 characters, the first of which says that it is a point


def compose_krl(tree: OperationTree, robot: Robot | None, name: str) -> Composed:
    """A new program; see `robojoule.formats.vendor.composing`.

    Raises:
        InputError: The robot has more axes than KRL's.
    """
    steps = steps_of(tree, robot, shares=True)
    moves = [step for step in steps.steps if step.kind == "move"]
    if len(steps.start_rad) > len(AXIS_NAMES):
        raise InputError(f"KRL has {len(AXIS_NAMES)} axes, the program has {len(steps.start_rad)}")
    (program,) = identifiers([name], _LONGEST, tuple(_WORDS))
    lost = [*steps.lost, *renamed(name, program)]
    points = identifiers([move.name for move in moves], _LONGEST, ("HOME", "START"))
    angles = degrees_text([steps.start_rad, *(move.target_rad for move in moves)])
    data = [f"DEFDAT {program}"]
    for point, values in zip(["START", *points], angles, strict=True):
        axes = ",".join(f"{axis} {value}" for axis, value in zip(AXIS_NAMES, values, strict=False))
        data.append(f"DECL E6AXIS X{point}={{{axes}}}")
    lines = ["&ACCESS RVP", "&REL 1", f"DEF {program}( )", "BAS(#INITMOV,0)", "PTP XSTART"]
    pending, percent, radius, share = iter(points), 100.0, None, None
    for step in steps.steps:
        if step.kind == "wait":
            mark = f" {ADDED}: wait added by a plan" if step.added else f" ;{step.name}"
            lines.append(f"WAIT SEC {plain(step.seconds)}{mark}")
        elif step.kind == "remark":
            lines.append(f";{step.name}: nobody knows how long it takes")
        else:
            if step.percent != percent:
                percent = step.percent
                lines.append(f"BAS(#VEL_PTP,{plain(percent)})")
            if step.radius_m and step.radius_m != radius:
                radius = step.radius_m
                lines.append(f"$APO.CDIS={plain(1e3 * radius)}")
            if step.path_share and step.path_share != share:
                share = step.path_share
                lines.append(f"$APO.CPTP={plain(200.0 * share)}")
            zone = " C_DIS" if step.radius_m else " C_PTP" if step.path_share else ""
            lines.append(f"PTP X{next(pending)}{zone}")
    texts = {".src": [*lines, "END"], ".dat": [*data, "ENDDAT"]}
    return Composed({suffix: "".join(f"{line}\r\n" for line in text) for suffix, text in texts.items()}, (*lost,))
