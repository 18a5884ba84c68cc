"""Statements of RAPID, their blocks and routines."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from lark import Lark, Token, Tree
from lark.exceptions import LarkError

from robojoule.formats.vendor.text import SourceText, Span

Node = Tree[Token]
# What a scan for the ends of statements must tell apart.
_PIECES = re.compile(r'"(?:[^"\r\n]|"")*"?|![^\r\n]*|:=|\r\n|\w+|.', re.DOTALL)
# First words of what ends without a semicolon: at once, or with the line.
_WORDS = {"ELSE", "ENDIF", "ENDFOR", "ENDWHILE", "ENDTEST", "ENDPROC", "ENDFUNC", "ENDTRAP", "ENDMODULE", "ENDRECORD"}
_WORDS |= {"UNDO", "BACKWARD"}
_HEADS = {"MODULE", "PROC", "FUNC", "TRAP", "RECORD", "TEST", "ERROR"}
_SCOPES = {"LOCAL", "TASK"}
_OPENED_BY = {"IF": "THEN", "ELSEIF": "THEN", "FOR": "DO", "WHILE": "DO"}
_DEEPEST = 100  # blocks within each other


@dataclass(frozen=True, eq=False)
class Statement:
    """One statement.

    Attributes:
        line: Line on which it begins, from 1 on.
        start: Its first character in the file.
        end: The one behind it, semicolon included.
        code: Its text without semicolon; comments are blank.
        tree: The parsed code; None: it was not understood.
        comment: What stands behind it on its line, from `!` on.
        lines: What to take away with it: all of its line where it stands there alone.
    """

    line: int
    start: int
    end: int
    code: str
    tree: Node | None
    comment: str
    lines: Span

    @property
    def kind(self) -> str:
        """What it is: the rule of the grammar."""
        return str(self.tree.data) if self.tree is not None else ""

    def span(self, node: Token | Node) -> Span:
        """Where a part of it stands in the file."""
        if isinstance(node, Token):
            first, last = node.start_pos or 0, node.end_pos or 0
        else:
            first, last = node.meta.start_pos, node.meta.end_pos
        return Span(self.start + first, self.start + last)

    def text(self, node: Token | Node) -> str:
        """The text of a part of it."""
        span = self.span(node)
        return self.code[span.start - self.start : span.end - self.start]


@dataclass(eq=False)
class Block:
    """Statements that run together.

    Attributes:
        head: The statement that opens it.
        body: What is within.
        parts: Further parts: ELSEIF, ELSE, CASE, DEFAULT, each with the statement that opens it.
    """

    head: Statement
    body: list[Statement | Block] = field(default_factory=list)
    parts: list[tuple[Statement, list[Statement | Block]]] = field(default_factory=list)


def within(body: Sequence[Statement | Block]) -> Iterator[Statement]:
    """All statements of a body, at any depth."""
    for one in body:
        if isinstance(one, Block):
            yield one.head
            for inner in (one.body, *(part for _, part in one.parts)):
                yield from within(inner)
        else:
            yield one


@dataclass(frozen=True, eq=False)
class Routine:
    """A procedure or a function.

    Attributes:
        name: Its name in capitals.
        parameters: Names of its parameters in capitals.
        by_reference: Those of them through which it changes data of its caller.
        optional: Those of them that a call may leave out.
        is_function: Whether it is a function, which expressions call.
        is_trap: Whether it is a trap, which interrupts run.
        body: What it does, without its handlers of errors.
        line: Line on which it begins.
    """

    name: str
    parameters: tuple[str, ...]
    body: list[Statement | Block]
    line: int
    by_reference: frozenset[str] = frozenset()
    optional: frozenset[str] = frozenset()
    is_function: bool = False
    is_trap: bool = False


@cache
def _grammar() -> Lark:
    text = Path(__file__).with_name("rapid.lark").read_text(encoding="utf-8")
    return Lark(text, parser="lalr", start="statement", propagate_positions=True, maybe_placeholders=False)


def _parsed(code: str) -> Node | None:
    try:
        return _grammar().parse(code)
    except (LarkError, RecursionError):
        return None


def statements(source: SourceText) -> list[Statement]:
    """The statements of a file, in its order."""
    return [_statement(source, start, end, code) for start, end, code in _pieces(source.text)]


def _statement(source: SourceText, start: int, end: int, code: str) -> Statement:
    rest = source.text[end:].split("\n", 1)[0].strip()
    line = source.line(start)
    lines = source.line_span(line)
    is_alone = not source.text[lines.start : start].strip() and end <= lines.end
    comment = rest if rest.startswith("!") else ""
    return Statement(line, start, end, code, _parsed(code), comment, lines if is_alone else Span(start, end))


def _pieces(text: str) -> Iterator[tuple[int, int, str]]:
    """Where statements begin and end, with their code in which comments are blank."""
    code: list[str] = []
    start, depth = 0, 0
    first = before = ""
    at = _header_end(text)
    for found in _PIECES.finditer(text, at):
        piece = found[0]
        is_blank = piece.isspace() or piece.startswith("!")
        if not code:
            if is_blank or piece == ";":
                continue
            start, depth, first, before = found.start(), 0, "", ""
        ends_line = piece in ("\n", "\r\n", "\r") and depth <= 0 and first in _HEADS
        if piece == ";" or ends_line:
            yield start, found.end() if piece == ";" else found.start(), "".join(code).rstrip()
            code = []
            continue
        code.append(" " * len(piece) if piece.startswith("!") else piece)
        if is_blank:
            continue
        depth += (piece in "([{") - (piece in ")]}")
        word = piece.upper()
        if not first or first in _SCOPES:
            first = word
        # THEN and DO are words of the language: a bracket before them that is not closed does not hide them.
        ends_here = (len(code) == 1 and word in _WORDS) or _OPENED_BY.get(first) == word
        ends_here |= piece == ":" and (first in ("CASE", "DEFAULT") or before == "name")
        before = "name" if len(code) == 1 and piece.isidentifier() else before if is_blank else ""
        if ends_here:
            yield start, found.end(), "".join(code)
            code = []
    if code:
        yield start, len(text), "".join(code).rstrip()


def _header_end(text: str) -> int:
    """Where the lines between %%% at the top of a file end."""
    if not text.lstrip("\ufeff \t\r\n").startswith("%%%"):
        return 1 if text.startswith("\ufeff") else 0
    second = text.find("%%%", text.find("%%%") + 3)
    return second + 3 if second >= 0 else len(text)


def routines(found: Sequence[Statement]) -> tuple[list[Routine], list[Statement]]:
    """Procedures, functions and traps of a file, and the declarations outside of them."""
    procedures: list[Routine] = []
    data: list[Statement] = []
    inside: list[Statement] | None = None
    head: Statement | None = None
    is_handler = is_other = False
    for one in found:
        if one.kind in ("proc", "func", "trap", "record"):
            is_other = one.kind == "record"
            head, inside, is_handler = None if is_other else one, [], False
        elif one.kind in ("endproc", "endfunc", "endtrap", "endrecord", "endmodule"):
            if head is not None and inside is not None:
                procedures.append(_routine(head, inside))
            head, inside, is_other = None, None, False
        elif one.kind == "handler" and inside is not None:
            is_handler = True
        elif inside is None:
            data.append(one)
        elif not is_handler and not is_other:
            inside.append(one)
    if head is not None and inside is not None:  # a file that is cut off
        procedures.append(_routine(head, inside))
    return procedures, data


def _routine(head: Statement, body: Sequence[Statement]) -> Routine:
    assert head.tree is not None
    name = [str(token) for token in head.tree.children if isinstance(token, Token)][
        -1
    ]  # of a function, behind its type
    by_reference, optional, parameters = set(), set(), []
    for one in head.tree.find_data("parameter"):
        tokens = [token for token in one.children if isinstance(token, Token)]
        parameters.append(str(tokens[-1]).upper())
        by_reference |= {parameters[-1]} if tokens[0].type == "MODE" else set()
        optional |= {parameters[-1]} if head.text(one).lstrip().startswith("\\") else set()
    is_function = head.kind == "func"
    return Routine(
        name.upper(),
        tuple(parameters),
        blocks(body),
        head.line,
        frozenset(by_reference),
        frozenset(optional),
        is_function,
        head.kind == "trap",
    )


_CLOSED_BY = {"if_": "endif", "for_": "endfor", "while_": "endwhile", "test": "endtest"}
_PART_OF = {"elseif": "if_", "else_": "if_", "case": "test", "default": "test"}


def kind_of(one: Statement) -> str:
    """What a statement is; one that is not understood and stands as a block's head opens that block."""
    if one.tree is not None:
        return one.kind
    words = one.code.upper().replace("(", " ( ").replace(")", " ) ").split() or [""]
    is_head = words[0] in ("IF", "FOR", "WHILE") and words[-1] == _OPENED_BY[words[0]]
    return f"{words[0].lower()}_" if is_head else ""


def blocks(found: Sequence[Statement]) -> list[Statement | Block]:
    """Statements as blocks; an end without a beginning is a statement of its own."""
    top: list[Statement | Block] = []
    stack: list[tuple[Block, list[Statement | Block]]] = []
    body = top
    for one in found:
        if kind_of(one) in _CLOSED_BY and len(stack) < _DEEPEST:
            block = Block(one)
            body.append(block)
            stack.append((block, body))
            body = block.body
        elif stack and _PART_OF.get(one.kind) == kind_of(stack[-1][0].head):
            body = []
            stack[-1][0].parts.append((one, body))
        elif stack and one.kind == _CLOSED_BY[kind_of(stack[-1][0].head)]:
            _, body = stack.pop()
        else:
            body.append(one)
    return top
