"""Lines of URScript and their blocks: def, while, if, thread, each up to its `end`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from lark import Lark
from lark.exceptions import LarkError

from robojoule.formats.vendor.lines import Line, Node, first_word, lines_in
from robojoule.formats.vendor.text import SourceText

_OPENING = ("def_", "thread", "while_", "if_")
_OPENING_WORDS = {"while": "while_", "if": "if_"}
_DEEPEST = 100  # blocks within each other


@dataclass(eq=False)
class Block:
    """Lines up to their `end`.

    Attributes:
        head: The line that opens it.
        body: Lines and blocks within.
        parts: elif and else of an if, each with the line that opens it.
    """

    head: Line
    body: list[Line | Block] = field(default_factory=list)
    parts: list[tuple[Line, list[Line | Block]]] = field(default_factory=list)

    def lines(self) -> Iterator[Line]:
        """All lines within, at any depth."""
        for body in (self.body, *(part for _, part in self.parts)):
            for one in body:
                if isinstance(one, Block):
                    yield one.head
                    yield from one.lines()
                else:
                    yield one


@cache
def _grammar() -> Lark:
    text = Path(__file__).with_name("ur.lark").read_text(encoding="utf-8")
    return Lark(text, parser="lalr", start="line", propagate_positions=True, maybe_placeholders=False)


def _parsed(code: str) -> Node | None:
    try:
        return _grammar().parse(code)
    except (LarkError, RecursionError):
        return None


def read_lines(source: SourceText) -> list[Line]:
    """The lines of a file."""
    return lines_in(source, 0, "#", _parsed)


def kind_of(line: Line) -> str:
    """What a line is; one that is not understood and begins as a block does opens that block."""
    return _OPENING_WORDS.get(first_word(line.code), "") if line.tree is None else line.kind


def blocks(lines: list[Line]) -> list[Line | Block]:
    """Lines as blocks; an `end` without a beginning is a line of its own."""
    top: list[Line | Block] = []
    stack: list[tuple[Block, list[Line | Block]]] = []
    body = top
    for line in lines:
        if kind_of(line) in _OPENING and len(stack) < _DEEPEST:
            block = Block(line)
            body.append(block)
            stack.append((block, body))
            body = block.body
        elif line.kind in ("elif_", "else_") and stack and kind_of(stack[-1][0].head) == "if_":
            body = []
            stack[-1][0].parts.append((line, body))
        elif line.kind == "end" and stack:
            _, body = stack.pop()
        else:
            body.append(line)
    return top


def functions_in(body: Sequence[Line | Block]) -> dict[str, Block]:
    """Functions and threads at any depth by their names; of those of one name the outermost, and the first."""
    found: dict[str, Block] = {}
    pending = list(body)
    while pending:
        blocks_here = [one for one in pending if isinstance(one, Block)]
        for block in blocks_here:
            if block.head.kind in ("def_", "thread"):
                found.setdefault(name_of(block.head), block)
        pending = [one for block in blocks_here for part in (block.body, *(p for _, p in block.parts)) for one in part]
    return found


def name_of(head: Line) -> str:
    """Name of the function or thread that a line begins."""
    return str(head.tree.children[0]) if head.tree is not None else ""
