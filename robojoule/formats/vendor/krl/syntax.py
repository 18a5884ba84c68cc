"""Lines of KRL and their blocks: DEF, IF, FOR ... each with the lines within."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path

from lark import Lark, Token
from lark.exceptions import LarkError

from robojoule.formats.vendor.lines import Line, Node, first_word, lines_in
from robojoule.formats.vendor.text import SourceText

_OPENING = {"if_": "endif", "for_": "endfor", "while_": "endwhile", "repeat": "until", "loop": "endloop"}
_OPENING |= {"switch": "endswitch", "spline": "endspline"}
_OPENING_WORDS = {kind.rstrip("_").upper(): kind for kind in _OPENING}
_DIVIDING = {"else_": "if_", "case": "switch", "default": "switch"}
_DEEPEST = 100  # blocks within each other


@dataclass(eq=False)
class Block:
    """Lines that run together.

    Attributes:
        head: The line that opens it.
        body: Lines and blocks within.
        parts: Further parts: ELSE, CASE, DEFAULT, each with the line that opens it.
        foot: The line that closes it; None: it is never closed.
    """

    head: Line
    body: list[Line | Block] = field(default_factory=list)
    parts: list[tuple[Line, list[Line | Block]]] = field(default_factory=list)
    foot: Line | None = None

    def lines(self) -> Iterator[Line]:
        """All lines within, at any depth."""
        for body in (self.body, *(part for _, part in self.parts)):
            yield from within(body)


def within(body: list[Line | Block]) -> Iterator[Line]:
    """All lines of a body, at any depth."""
    for one in body:
        if isinstance(one, Block):
            yield one.head
            yield from one.lines()
        else:
            yield one


def spline_blocks(body: list[Line | Block]) -> Iterator[Block]:
    """Blocks of motions without a stop between them, at any depth."""
    for one in body:
        if isinstance(one, Block):
            if one.head.kind == "spline":
                yield one
            for part in (one.body, *(part for _, part in one.parts)):
                yield from spline_blocks(part)


@dataclass(frozen=True, eq=False)
class Routine:
    """A program or a subprogram.

    Attributes:
        name: Its name in capitals.
        parameters: Names of its parameters in capitals.
        modes: How each is handed over: "IN", "OUT", or empty where that is not said.
        body: What it does.
    """

    name: str
    parameters: tuple[str, ...]
    modes: tuple[str, ...]
    body: list[Line | Block]

    @cached_property
    def own(self) -> frozenset[str]:
        """Names that it has for itself: its parameters and what it declares."""
        declared = (line.tree for line in within(self.body) if line.tree is not None and line.kind == "declaration")
        names = {str(one.children[0]).upper() for tree in declared for one in tree.find_data("declarator")}
        return frozenset(names | set(self.parameters))


@cache
def _grammar() -> Lark:
    text = Path(__file__).with_name("krl.lark").read_text(encoding="utf-8")
    return Lark(text, parser="lalr", start="line", propagate_positions=True, maybe_placeholders=False)


def read_lines(source: SourceText, file: int) -> list[Line]:
    """The lines of a file."""
    return lines_in(source, file, ";", _parsed)


def _parsed(code: str) -> Node | None:
    if code.startswith("&"):  # what the controller notes of a file
        return None
    try:
        return _grammar().parse(code)
    except (LarkError, RecursionError):
        return None


def action_of(line: Line) -> Line:
    """What an INTERRUPT or a TRIGGER does, as a line of its own: what stands between DO and PRIO."""
    start = line.code.upper().find(" DO ")
    action = line.code[start + len(" DO ") :] if start >= 0 else ""
    end = action.upper().rfind(" PRIO")
    action = (action if end < 0 else action[:end]).strip()
    return replace(line, code=action, tree=_parsed(action) if action else None)


def routines(lines: list[Line]) -> list[Routine]:
    """The routines of a .src file; lines outside of them are none of theirs."""
    found: list[Routine] = []
    inside: list[Line] | None = None
    head: Line | None = None
    for line in lines:
        if line.kind in ("def_", "deffct"):
            if head is not None and inside is not None:
                found.append(_routine(head, inside))
            head, inside = line, []
        elif line.kind == "end" and head is not None and inside is not None:
            found.append(_routine(head, inside))
            head = inside = None
        elif inside is not None:
            inside.append(line)
    if head is not None and inside is not None:  # files that are cut off, or leave END out
        found.append(_routine(head, inside))
    if not found:
        found.append(Routine("", (), (), blocks(lines)))
    return found


def _routine(head: Line, lines: list[Line]) -> Routine:
    assert head.tree is not None
    names = [str(token).upper() for token in head.tree.children if isinstance(token, Token)]
    words = [
        [str(token).upper() for token in one.children if isinstance(token, Token)]
        for one in head.tree.find_data("parameter")
    ]
    modes = tuple(more[0] if more else "" for _, *more in words)
    return Routine(names[-1], tuple(name for name, *_ in words), modes, blocks(lines))


def leaves_loop(body: list[Line | Block]) -> bool:
    """Whether lines may end the loop that they are in: by EXIT, not that of a loop within, by RETURN or GOTO."""
    for one in body:
        if isinstance(one, Line):
            if one.kind in ("exit", "return_", "goto"):
                return True
            continue
        parts = [one.body, *(part for _, part in one.parts)]
        if kind_of(one.head) in ("if_", "switch"):
            if any(leaves_loop(part) for part in parts):
                return True
        elif any(line.kind in ("return_", "goto") for line in one.lines()):
            return True
    return False


def kind_of(line: Line) -> str:
    """What a line is; one that is not understood and begins as a block does opens that block."""
    if line.tree is None and line.code:
        return _OPENING_WORDS.get(first_word(line.code).upper(), "")
    return line.kind


def blocks(lines: list[Line]) -> list[Line | Block]:
    """Lines as blocks; an end without a beginning is a line of its own."""
    top: list[Line | Block] = []
    stack: list[tuple[Block, list[Line | Block]]] = []
    body = top
    for line in lines:
        kind = kind_of(line)
        if kind in _OPENING and len(stack) < _DEEPEST:
            block = Block(line)
            body.append(block)
            stack.append((block, body))
            body = block.body
        elif stack and _DIVIDING.get(kind) == kind_of(stack[-1][0].head):
            body = []
            stack[-1][0].parts.append((line, body))
        elif stack and kind == _OPENING[kind_of(stack[-1][0].head)]:
            stack[-1][0].foot = line
            _, body = stack.pop()
        else:
            body.append(line)
    return top
