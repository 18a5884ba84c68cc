"""What statements of RAPID may do, whether or not they run: motions, waits, data, settings, and where they lead."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from lark import Token, Tree

from robojoule.formats.vendor.lines import words_of
from robojoule.formats.vendor.rapid.expressions import arguments_of
from robojoule.formats.vendor.rapid.instructions import CHANGING, FUNCTIONS, HARMLESS, SETTINGS, WAITS
from robojoule.formats.vendor.rapid.motions import FORMS
from robojoule.formats.vendor.rapid.syntax import Node, Routine, Statement, within


@dataclass
class Effects:
    """What may happen where statements run.

    Attributes:
        moves: The robot may be elsewhere behind them.
        waits: They may wait.
        sets: Names in capitals of data that they set.
        settings: Instructions of `SETTINGS` among them.
        calls: Routines and functions that they call, in capitals.
        returns: Lines that end the routine.
        ends: Lines that end the program, or its cycle.
    """

    moves: bool = False
    waits: bool = False
    sets: set[str] = field(default_factory=set)
    settings: set[str] = field(default_factory=set)
    calls: set[str] = field(default_factory=set)
    returns: set[int] = field(default_factory=set)
    ends: set[int] = field(default_factory=set)


class Search:
    """Finds what statements may do, through all routines of the file that they call.

    Args:
        routines: Procedures and functions of the file by their names in capitals.
        still: Routines of other files that do not move the robot, in capitals.
    """

    def __init__(self, routines: Mapping[str, Routine], still: frozenset[str]) -> None:
        self.routines = routines
        self.still = still

    def of(self, statements: Iterable[Statement]) -> Effects:
        """What statements may do."""
        return self._through_calls(self._direct(statements))

    def of_calls(self, names: Iterable[str]) -> Effects:
        """What routines and functions may do."""
        return self._through_calls(Effects(calls=set(names)))

    def is_still(self, name: str) -> bool:
        """Whether a function that is not in the file moves nothing."""
        return name in FUNCTIONS or name in self.still

    def _direct(self, statements: Iterable[Statement]) -> Effects:
        found = Effects()
        for one in statements:
            if one.tree is None:
                found.moves = True
                words = words_of(one.code.upper())
                found.sets |= set() if words and words[0] in FORMS else set(words)
            else:
                self._look(one, one.tree, found)
        return found

    def _look(self, one: Statement, tree: Node, found: Effects) -> None:
        kind = str(tree.data)
        found.calls |= set(functions_in(tree))
        if kind == "assignment":
            found.sets.add(root_of(tree.children[0]))
        elif kind == "call":
            self._look_at_call(tree, found)
        elif kind == "compact_if" and isinstance(tree.children[1], Tree):
            self._look(one, tree.children[1], found)
        elif kind in ("late_call", "goto"):
            found.moves = True
        elif kind == "stop":
            found.waits = True
        elif kind == "return_":
            (found.returns if is_return(one) else found.ends).add(one.line)

    def _look_at_call(self, tree: Node, found: Effects) -> None:
        name = str(tree.children[0]).upper()
        plain, named = arguments_of(tree)
        routine = self.routines.get(name)
        if routine is not None:
            found.calls.add(name)
            given = given_to(routine, plain, named)
            found.sets |= {root_of(given[key]) for key in routine.by_reference if _is_ref(given.get(key))}
        elif name in WAITS or name == "WAITTIME":
            found.waits = True
        elif name in SETTINGS:
            found.settings.add(name)
        elif name in HARMLESS:
            found.sets |= {root_of(plain[0])} if name in CHANGING and plain and _is_ref(plain[0]) else set()
        else:
            found.moves |= name not in self.still

    def _through_calls(self, found: Effects) -> Effects:
        pending, seen = list(found.calls), set(found.calls)
        while pending:
            name = pending.pop()
            routine = self.routines.get(name)
            if routine is None:
                found.moves |= not self.is_still(name)
                continue
            inner = self._direct(within(routine.body))
            found.moves |= inner.moves or bool(inner.ends)
            found.waits |= inner.waits
            found.settings |= inner.settings
            found.sets |= inner.sets - own_names_of(routine)
            pending += inner.calls - seen
            seen |= inner.calls
        return found


def given_to(
    routine: Routine, plain: list[Node | Token], named: Mapping[str, Node | Token | None]
) -> dict[str, Node | Token | None]:
    """Arguments of a call by the names of the routine's parameters; None: a bare switch."""
    optional = {name: named[name] for name in routine.parameters if name in named}
    required = [name for name in routine.parameters if name not in named and name not in routine.optional]
    return {**dict(zip(required, plain, strict=False)), **optional}


def own_names_of(routine: Routine) -> set[str]:
    """Names in capitals that a routine has for itself: parameters, and what it declares."""
    declared = {declared_by(one.tree) for one in within(routine.body) if one.kind == "declaration" and one.tree}
    return {*routine.parameters, *declared}


def declared_by(tree: Node) -> str:
    """The name in capitals that a declaration declares."""
    return [str(child) for child in tree.children if isinstance(child, Token)][-1].upper()


def shared_by(one: Statement) -> str:
    """The name in capitals of the PERS data that a statement declares and other modules may change; else empty.

    Those of tools, work objects and loads are always PERS, and calibrated rather than changed.
    """
    if one.kind != "declaration" or one.tree is None:
        return ""
    storage, kind, *_ = (str(child).upper() for child in one.tree.children if isinstance(child, Token))
    is_local = "LOCAL" in one.code.upper().split()
    is_shared = storage == "PERS" and not is_local and kind not in ("TOOLDATA", "WOBJDATA", "LOADDATA")
    return declared_by(one.tree) if is_shared else ""


def functions_in(tree: Node | Token) -> list[str]:
    """Names in capitals of the functions that an expression or a statement calls, in their order."""
    if isinstance(tree, Token):
        return []
    return list(dict.fromkeys(str(one.children[0]).upper() for one in tree.find_data("function")))


def root_of(ref: Node | Token | None) -> str:
    """The name in capitals that a reference begins with."""
    return str(ref.children[0]).upper() if isinstance(ref, Tree) else ""


def _is_ref(node: Node | Token | None) -> bool:
    return isinstance(node, Tree) and node.data == "ref"


def is_return(one: Statement) -> bool:
    """Whether a statement that ends something ends the routine, not the program."""
    return re.search(r"\bRETURN\b", one.code, re.IGNORECASE) is not None
