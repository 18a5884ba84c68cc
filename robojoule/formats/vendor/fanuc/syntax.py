"""Lines of a teach pendant program: its sections, its instructions with their numbers, and blocks of these."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from lark import Lark, Token, Tree
from lark.exceptions import LarkError

from robojoule.formats.vendor.text import SourceText, Span, lines_of

Node = Tree[Token]
_PREFIX = re.compile(r"[ \t]*(\d*)[ \t]*:")
_MOTION = re.compile(r"[ \t]*[JLCSA][ \t]+PR?\[")
_DEEPEST = 100  # blocks within each other


@dataclass(frozen=True)
class Line:
    """One line of the file.

    Attributes:
        number: Its number in the file, from 1 on.
        start: Its first character.
        end: The first one of the next line.
        text: The line without its end.
    """

    number: int
    start: int
    end: int
    text: str


@dataclass(frozen=True, eq=False)
class Instruction:
    """One instruction, which may go over several lines.

    Attributes:
        line: Line of the file on which it begins.
        start: First character of that line.
        end: The one behind its last line, with the lines that belong to it, such as those of a TB block.
        code: Its text without number and semicolon; continued lines stand in their places.
        code_start: First character of the code in the file.
        tree: The parsed code; None: there is none, or it was not understood.
        is_nested: Whether it is in a block of another one, with numbers of its own.
    """

    line: Line
    start: int
    end: int
    code: str
    code_start: int
    tree: Node | None
    is_nested: bool = False

    @property
    def kind(self) -> str:
        """What it is: the rule of the grammar."""
        return str(self.tree.data) if self.tree is not None else ""

    def span(self, token: Token) -> Span:
        """Where a part of the code stands in the file."""
        return Span(self.code_start + (token.start_pos or 0), self.code_start + (token.end_pos or 0))


@dataclass(eq=False)
class Block:
    """Instructions from IF to ENDIF, or from FOR to ENDFOR.

    Attributes:
        head: The instruction that opens it.
        body: What is within.
        other: What is behind ELSE.
    """

    head: Instruction
    body: list[Instruction | Block] = field(default_factory=list)
    other: list[Instruction | Block] = field(default_factory=list)

    def instructions(self) -> Iterator[Instruction]:
        """All instructions within, at any depth."""
        yield self.head
        yield from within([*self.body, *self.other])


def within(body: Sequence[Instruction | Block]) -> Iterator[Instruction]:
    """All instructions of a body, at any depth."""
    for one in body:
        if isinstance(one, Block):
            yield from one.instructions()
        else:
            yield one


def own_row(lines: Sequence[Line]) -> list[Line]:
    """The numbered lines of a program's own row; those of blocks below a motion have rows of their own.

    Such a block is set in farther than the program, its numbers begin anew, and nothing in it moves the robot. Else
    numbers and where they stand may be irregular, as they are in files that people have edited.
    """
    found: list[Line] = []
    digits_at = colon_at = last = inner = 0
    for line in lines:
        prefix = _PREFIX.match(line.text)
        if prefix is None or not prefix[1]:
            continue
        number = int(prefix[1])
        is_set_in = bool(found) and prefix.start(1) > digits_at and prefix.end() - 1 > colon_at
        is_set_in &= _MOTION.match(line.text, prefix.end()) is None
        if is_set_in and (number <= last or number == inner + 1):
            inner = number
            continue
        if not found:
            digits_at, colon_at = prefix.start(1), prefix.end() - 1
        last, inner = number, -1
        found.append(line)
    return found


@cache
def grammar(name: str, start: str) -> Lark:
    """A grammar beside this module."""
    text = Path(__file__).with_name(name).read_text(encoding="utf-8")
    return Lark(text, parser="lalr", start=start, propagate_positions=True, maybe_placeholders=False)


def parsed(name: str, start: str, text: str) -> Node | None:
    """The tree of a text; None: it is not of the grammar."""
    try:
        return grammar(name, start).parse(text)
    except (LarkError, RecursionError):
        return None


def renumbered(text: str, number: int | None) -> str:
    """A line with another number, or with none, its colon kept in line where spaces allow that."""
    prefix = _PREFIX.match(text)
    if prefix is None:
        return text
    digits = str(number) if number is not None else " " * len(prefix[1])
    before, more = text[: prefix.start(1)], len(digits) - len(prefix[1])
    if more > 0 and before.endswith(" " * more):
        before = before[:-more]
    elif more < 0 and before.endswith(" "):
        before += " " * -more
    return f"{before}{digits}{text[prefix.end(1) :]}"


def number_of_line(text: str) -> int | None:
    """The number of a line, if it has one."""
    prefix = _PREFIX.match(text)
    return int(prefix[1]) if prefix is not None and prefix[1] else None


def lines_in(source: SourceText) -> list[Line]:
    """The lines of a file."""
    found, start = [], 0
    for number, raw in enumerate(lines_of(source.text), start=1):
        found.append(Line(number, start, start + len(raw), raw.rstrip("\r\n")))
        start += len(raw)
    return found


def sections(lines: Sequence[Line]) -> dict[str, list[Line]]:
    """Lines by the section that they are in, such as "MN"; those before the first one by an empty name."""
    found: dict[str, list[Line]] = {"": []}
    name = ""
    for line in lines:
        word = line.text.strip().split(" ")[0].split("\t")[0].upper()
        if word.startswith("/") and word[1:].isalpha():
            name = word[1:]
            found.setdefault(name, [])
        else:
            found[name].append(line)
    return found


def instructions(lines: Sequence[Line]) -> list[Instruction]:
    """The instructions of the section MN."""
    own = {line.start for line in own_row(lines)}
    found: list[Instruction] = []
    at = 0
    while at < len(lines):
        line = lines[at]
        prefix = _PREFIX.match(line.text)
        if prefix is None:
            at += 1
            continue
        last = at
        while not lines[last].text.rstrip().endswith(";") and last + 1 < len(lines) and _goes_on(lines[last + 1].text):
            last += 1
        nested = bool(prefix[1]) and line.start not in own
        found.append(_instruction(lines[at : last + 1], prefix.end(), nested))
        at = last + 1
    return _with_blocks(found, lines)


def _goes_on(text: str) -> bool:
    """Whether a line continues the one before it: it has a colon without a number."""
    prefix = _PREFIX.match(text)
    return prefix is not None and not prefix[1]


def _instruction(lines: Sequence[Line], begin: int, nested: bool) -> Instruction:
    first, last = lines[0], lines[-1]
    pieces = [first.text[begin:].ljust(first.end - first.start - begin)]
    for line in lines[1:]:
        prefix = _PREFIX.match(line.text)
        skipped = prefix.end() if prefix is not None else 0
        pieces.append((" " * skipped + line.text[skipped:]).ljust(line.end - line.start))
    code = "".join(pieces).rstrip()
    code = code.removesuffix(";").rstrip()
    start = first.start + begin + len(code) - len(code.lstrip())
    code = code.strip()
    tree = None if not code or is_remark(code) else parsed("tp.lark", "instruction", code)
    return Instruction(first, first.start, last.end, code, start, tree, nested)


def is_remark(code: str) -> bool:
    """Whether an instruction is a remark, or commented out."""
    return code.startswith(("!", "//", "--eg"))


def _with_blocks(found: list[Instruction], lines: Sequence[Line]) -> list[Instruction]:
    """Instructions that end behind the numbered blocks which belong to them."""
    result: list[Instruction] = []
    for index, one in enumerate(found):
        if one.is_nested or index + 1 >= len(found) or not found[index + 1].is_nested:
            result.append(one)
            continue
        following = next((other.start for other in found[index + 1 :] if not other.is_nested), None)
        end = following if following is not None else lines[-1].end
        result.append(Instruction(one.line, one.start, end, one.code, one.code_start, one.tree))
    return result


def kind_of(one: Instruction) -> str:
    """What an instruction is; one that is not understood and stands as a block's head opens that block."""
    if one.tree is not None or not one.code:
        return one.kind
    words = one.code.upper().replace("(", " ( ").replace(",", " ").split()
    return "for_" if words[0] == "FOR" else "if_" if words[0] == "IF" and words[-1] == "THEN" else ""


def blocks(found: Sequence[Instruction]) -> list[Instruction | Block]:
    """Instructions as blocks; an end without a beginning is an instruction of its own."""
    top: list[Instruction | Block] = []
    stack: list[tuple[Block, list[Instruction | Block]]] = []
    body = top
    closing = {"if_": "endif", "for_": "endfor"}
    for one in found:
        if one.is_nested:
            continue
        if kind_of(one) in closing and len(stack) < _DEEPEST:
            block = Block(one)
            body.append(block)
            stack.append((block, body))
            body = block.body
        elif one.kind == "else_" and stack and kind_of(stack[-1][0].head) == "if_":
            body = stack[-1][0].other
        elif stack and one.kind == closing[kind_of(stack[-1][0].head)]:
            _, body = stack.pop()
        else:
            body.append(one)
    return top
