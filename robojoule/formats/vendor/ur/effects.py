"""What lines of URScript may do, whether or not they run: motions, waits, variables, and where they lead."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from lark import Token, Tree

from robojoule.formats.vendor.lines import Line, Node, first_word, words_of
from robojoule.formats.vendor.ur.builtins import HARMLESS, KEYWORDS, PAYLOADS, PREFIXES, STANDING, STREAMS
from robojoule.formats.vendor.ur.motions import MOTIONS
from robojoule.formats.vendor.ur.syntax import Block, kind_of


@dataclass
class Effects:
    """What may happen where lines run.

    Attributes:
        moves: The robot may be elsewhere behind them.
        waits: They may wait.
        tool: They may set the TCP.
        payload: They may set the payload.
        sets: Names that they set, with `global`, `local` or nothing before them.
        shared: Names that functions set which they call.
        calls: Functions that they call.
        breaks: Lines that leave the loop in which they stand.
        continues: Lines that end its pass.
        returns: Lines that end the function.
        halts: Lines that end the program.
    """

    moves: bool = False
    waits: bool = False
    tool: bool = False
    payload: bool = False
    sets: set[tuple[str, str]] = field(default_factory=set)
    shared: set[str] = field(default_factory=set)
    calls: set[str] = field(default_factory=set)
    breaks: set[int] = field(default_factory=set)
    continues: set[int] = field(default_factory=set)
    returns: set[int] = field(default_factory=set)
    halts: set[int] = field(default_factory=set)

    @property
    def names(self) -> set[str]:
        """All names that may be set."""
        return {name for _, name in self.sets} | self.shared


class Search:
    """Finds what lines may do, through all functions of the file that they call.

    Args:
        functions: Functions and threads of the file.
        still: Functions of other files that do not move the robot, in capitals.
    """

    def __init__(self, functions: Mapping[str, Block], still: frozenset[str]) -> None:
        self.functions = functions
        self.still = still

    def of(self, body: Sequence[Line | Block]) -> Effects:
        """What lines may do."""
        found = Effects()
        _collect(body, found, in_loop=False)
        return self._through_calls(found)

    def of_block(self, block: Block) -> Effects:
        """What the lines within a block may do; its first condition is not one of them."""
        is_loop = kind_of(block.head) == "while_"
        found = Effects()
        _collect(block.body, found, in_loop=is_loop)
        for head, body in block.parts:
            _collect([head, *body], found, in_loop=is_loop)
        return self._through_calls(found)

    def of_calls(self, names: Iterable[str]) -> Effects:
        """What functions may do."""
        return self._through_calls(Effects(calls=set(names)))

    def _through_calls(self, found: Effects) -> Effects:
        pending, seen = list(found.calls), set(found.calls)
        while pending:
            name = pending.pop()
            block = self.functions.get(name)
            if block is None:
                found.moves |= not (name in STANDING or self.is_harmless(name))
                found.waits |= name in STANDING
                found.tool |= name == "set_tcp"
                found.payload |= name in PAYLOADS
                continue
            inner = Effects()
            _collect(block.body, inner, in_loop=False)
            found.moves |= inner.moves or bool(inner.halts)
            found.waits |= inner.waits
            own = set(parameters_of(block)) | {name for scope, name in inner.sets if scope == "local"}
            found.shared |= {name for scope, name in inner.sets if scope == "global" or name not in own}
            pending += inner.calls - seen
            seen |= inner.calls
        return found

    def is_harmless(self, name: str) -> bool:
        """Whether a function that is not in the file moves nothing and takes no time."""
        is_known = name in HARMLESS or name in PAYLOADS or name == "set_tcp"
        return is_known or name.startswith(PREFIXES) or name.upper() in self.still


def parameters_of(block: Block) -> list[str]:
    """Names of a function's parameters."""
    return [] if block.head.tree is None else [str(one.children[0]) for one in block.head.tree.find_data("parameter")]


def called_in(node: Node | Token) -> list[str]:
    """Names of the functions that an expression or a statement calls."""
    if isinstance(node, Token):
        return []
    return [str(one.children[0]) for one in node.iter_subtrees() if one.data in ("call", "call_line")]


def thread_of(node: Node) -> str | None:
    """The thread that `run` starts; None: which one is not known."""
    inner = node.children[0] if node.children else None
    is_call = isinstance(inner, Tree) and inner.data == "call"
    return str(inner.children[0]) if is_call else None  # type: ignore[union-attr]


def _collect(body: Sequence[Line | Block], found: Effects, *, in_loop: bool) -> None:
    """What lines do themselves."""
    for one in body:
        if isinstance(one, Line):
            _collect_line(one, found, in_loop=in_loop)
        elif one.head.kind not in ("def_", "thread"):
            _collect_line(one.head, found, in_loop=in_loop)
            within = in_loop or kind_of(one.head) == "while_"
            _collect(one.body, found, in_loop=within)
            for head, part in one.parts:
                _collect([head, *part], found, in_loop=within)


def _collect_line(line: Line, found: Effects, *, in_loop: bool) -> None:
    if line.tree is None:
        word = first_word(line.code)
        found.moves |= word in MOTIONS or word in STREAMS
        if word in MOTIONS or word in STREAMS:
            return
        found.sets |= {("", one) for one in words_of(line.code) if one.isidentifier() and one not in KEYWORDS}
        return
    found.calls |= set(called_in(line.tree))
    if line.kind == "assignment":
        scope, name = assigned_by(line.tree)
        found.sets.add((scope, name))
    elif line.kind == "join":
        found.waits = True
    elif line.kind in ("break_", "continue_") and not in_loop:
        (found.breaks if line.kind == "break_" else found.continues).add(line.number)
    elif line.kind == "return_":
        found.returns.add(line.number)
    elif line.kind == "halt":
        found.halts.add(line.number)


def assigned_by(tree: Node) -> tuple[str, str]:
    """Scope and name of what an assignment, or a declaration, sets."""
    tokens = {one.type: str(one) for one in tree.children if isinstance(one, Token)}
    return tokens.get("SCOPE", ""), tokens.get("NAME", "")
