"""What lines of KRL may do and set, for where nobody knows whether they run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set

from lark import Tree

from robojoule.formats.vendor.krl.expressions import FUNCTIONS, arguments_of, root_of
from robojoule.formats.vendor.krl.syntax import Routine, within
from robojoule.formats.vendor.lines import Line, Node, first_word, words_of

# Routines and functions of the controller that move nothing.
HARMLESS = {"SET_CD_PARAMS", "USE_CM_PRO_VALUES", "MSGNOTIFY", "MSGSTATE", "MSGQUIT", "PULSE", "ANIN", "CLEAR_KRLMSG"}
HARMLESS |= {"IR_STOPM", "CWRITE", "SWRITE", "LOAD_DATA", "SET_OPSTATE", "USERLOG", "RDOUT", "VARSTATE", "INITMSG"}
HARMLESS |= {"ATAN2", "B_AND", "B_OR", "B_EXOR", "B_NOT", "INV_POS", "FORWARD", "INVERSE", "CAST_FROM", "CAST_TO"}
HARMLESS |= {"STRADD", "STRCLEAR", "STRCOMP", "STRCOPY", "STRDECLLEN", "STRFIND", "STRLEN", "STRTOBOOL", "STRTOINT"}
HARMLESS |= {"STRTOREAL", "SREAD", "COPEN", "CCLOSE", "CREAD", "CIOCTL", "GETVAR", "GETCYCDEF", "IS_KEY_PRESSED"}
HARMLESS |= {"SET_KRLMSG", "EXISTS_KRLMSG", "GET_KRLMSG", "SET_KRLDLG", "EXISTS_KRLDLG", "GETSYSSTATE", "MSGDIALOG"}
MOTIONS = {"PTP", "LIN", "CIRC", "SPTP", "SLIN", "SCIRC", "SPL", "PTP_REL", "LIN_REL", "CIRC_REL"}
MOTIONS |= {"SPTP_REL", "SLIN_REL", "SCIRC_REL"}
# First words of lines of which nothing is understood, and which set nothing in their place.
_SETS_NOTHING = {"EXT", "EXTFCT", "SIGNAL", "ENUM", "STRUC", "IMPORT", "GLOBAL", "INTERRUPT", "TRIGGER"}
_PERIPHERY = {"$IN", "$OUT", "$ANIN", "$ANOUT", "$DIGIN", "$AXIS_ACT", "$POS_ACT"}
_FRAMES = ("$TOOL", "$BASE")
# What BAS sets, the routine of the controller, by its first argument.
_SET_BY_BAS: dict[str, tuple[str, ...]] = {
    "#INITMOV": ("$VEL_AXIS", *_FRAMES),
    "#PTP_PARAMS": ("$VEL_AXIS", "$APO", *_FRAMES),
    "#PTP_DAT": ("$VEL_AXIS", "$APO"),
    "#VEL_PTP": ("$VEL_AXIS",),
    "#CP_PARAMS": ("$VEL", "$APO", *_FRAMES),
    "#CP_DAT": ("$VEL", "$APO"),
    "#VEL_CP": ("$VEL",),
    "#ACC_CP": ("$ACC",),
    "#FRAMES": _FRAMES,
    "#TOOL": ("$TOOL",),
    "#BASE": ("$BASE",),
}
_ALL = ("$VEL_AXIS", "$VEL", "$ACC", "$APO", *_FRAMES)


def calls_of(line: Line) -> Iterator[Node]:
    """Calls in a line's expressions, the inner ones first, and the call that the line is; not those behind WITH."""
    if line.tree is None:
        return
    own = {id(call) for part in line.tree.find_data("with_part") for call in part.find_data("call")}
    for node in line.tree.iter_subtrees():
        if node.data in ("call", "call_line") and id(node) not in own:
            yield node


def stops_advance(line: Line) -> bool:
    """Whether a line, without CONTINUE before it, stops the advance run, and so the robot: by inputs or outputs."""
    if line.tree is None or line.kind in ("motion", "spline", "declaration"):
        return False
    names = {root_of(node) for node in line.tree.find_data("ref")}
    return not names.isdisjoint(_PERIPHERY) or any(name_of(call) == "PULSE" for call in calls_of(line))


def name_of(call: Node) -> str:
    """The name of the routine that is called, in capitals."""
    return str(call.children[0]).upper()


def changed_by(lines: Iterable[Line], routines: Mapping[str, Routine]) -> frozenset[str]:
    """Names of variables that lines, and the routines of the file that they call, may set.

    Args:
        lines: The lines.
        routines: The routines of the file.
    """
    found: set[str] = set()
    for own, line in _reached(lines, routines):
        found |= set(_set_by(line, routines)) - own
    return frozenset(found)


def _set_by(line: Line, routines: Mapping[str, Routine]) -> Iterator[str]:
    if line.tree is None:
        named = words_of(line.code.upper())
        yield from named if named and named[0] not in _SETS_NOTHING | MOTIONS else ()
        return
    if line.kind in ("assignment", "for_") and isinstance(line.tree.children[0], Tree):
        yield root_of(line.tree.children[0])
    for call in calls_of(line):
        name, arguments = name_of(call), arguments_of(call)
        if name == "BAS":
            word = str(arguments[0].children[0]).upper() if arguments and arguments[0].data == "enum" else ""
            yield from _SET_BY_BAS.get(word, ()) if word else _ALL
        elif name not in FUNCTIONS and name not in HARMLESS:
            yield from handed_over(arguments, routines.get(name))


def handed_over(arguments: list[Node], routine: Routine | None) -> Iterator[str]:
    """Names of variables that a call hands over by reference, as far as that is not excluded."""
    modes = routine.modes if routine is not None else ()
    for at, argument in enumerate(arguments):
        if argument.data == "ref" and (at >= len(modes) or modes[at] != "IN"):
            yield root_of(argument)


def may_move(lines: Iterable[Line], routines: Mapping[str, Routine], still: frozenset[str]) -> bool:
    """Whether lines, or the routines of the file that they call, may move the robot."""
    known = FUNCTIONS.keys() | HARMLESS | still | routines.keys() | {"BAS"}
    return any(_moves(line, known) for _, line in _reached(lines, routines))


def may_wait(lines: Iterable[Line], routines: Mapping[str, Routine]) -> bool:
    """Whether lines, or the routines of the file that they call, may wait."""
    return any(line.kind in ("wait_sec", "wait_for", "halt") for _, line in _reached(lines, routines))


def _moves(line: Line, known: Set[str]) -> bool:
    if line.tree is None:
        return first_word(line.code).upper() in MOTIONS
    return line.kind in ("motion", "goto") or any(name_of(call) not in known for call in calls_of(line))


def _reached(lines: Iterable[Line], routines: Mapping[str, Routine]) -> Iterator[tuple[frozenset[str], Line]]:
    """Lines, and those of routines of the file that they call, each with the names that its routine has for itself."""
    nothing: frozenset[str] = frozenset()
    pending = [(nothing, line) for line in lines]
    seen: set[str] = set()
    while pending:
        own, line = pending.pop()
        yield own, line
        for name in {name_of(call) for call in calls_of(line)} & routines.keys() - seen:
            seen.add(name)
            pending += [(routines[name].own, one) for one in within(routines[name].body)]
