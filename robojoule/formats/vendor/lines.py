"""Lines of programs in languages that have one statement a line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lark import Token, Tree

from robojoule.formats.vendor.text import Edit, SourceText, Span, lines_of

Node = Tree[Token]

_BRACKETS = {"(": ")", "[": "]", "{": "}", ")": "(", "]": "[", "}": "{"}


@dataclass(frozen=True, eq=False)
class Line:
    """One line.

    Attributes:
        number: Its number, from 1 on.
        start: Its first character in the file.
        end: The first one of the next line.
        text: The line without its end.
        code: Its code without white space around it; empty where there is none.
        code_start: First character of the code in the file.
        comment: What stands behind the sign of comments, with it.
        tree: The parsed code; None: there is none, or it was not understood.
        file: Which of the program's files it is in.
    """

    number: int
    start: int
    end: int
    text: str
    code: str
    code_start: int
    comment: str
    tree: Node | None
    file: int

    @property
    def kind(self) -> str:
        """What the line is: the rule of the grammar."""
        return str(self.tree.data) if self.tree is not None else ""

    @property
    def indent(self) -> str:
        """White space before it."""
        return self.text[: len(self.text) - len(self.text.lstrip())]

    def span(self, node: Token | Node) -> Span:
        """Where a part of the code stands in the file."""
        if isinstance(node, Token):
            first, last = node.start_pos or 0, node.end_pos or 0
        else:
            first, last = node.meta.start_pos, node.meta.end_pos
        return Span(self.code_start + first, self.code_start + last, self.file)


def lines_in(source: SourceText, file: int, sign: str, parse: Callable[[str], Node | None]) -> list[Line]:
    """The lines of a file.

    Args:
        source: The file.
        file: Which of the program's files it is.
        sign: What begins a comment outside of texts in double quotes.
        parse: The code of a line as a tree; None where it is not understood.
    """
    found, start = [], 0
    for number, raw in enumerate(lines_of(source.text), start=1):
        text = raw.rstrip("\r\n")
        split = _comment_start(text, sign)
        code = text[:split].strip().lstrip("\ufeff")
        code_start = start + (text.index(code) if code else 0)
        tree = parse(code) if code else None
        found.append(Line(number, start, start + len(raw), text, code, code_start, text[split:], tree, file))
        start += len(raw)
    return found


def _comment_start(text: str, sign: str) -> int:
    """Where the comment of a line begins: at the first sign of one outside of texts."""
    quoted = False
    for place, letter in enumerate(text):
        if letter == '"':
            quoted = not quoted
        elif letter == sign and not quoted:
            return place
    return len(text)


def behind(line: Line, text: str, line_end: str) -> Edit:
    """A further line behind a line; the last one of a file may have no end."""
    is_cut = line.end == line.start + len(line.text)
    return Edit(Span(line.end, line.end, line.file), f"{line_end}{text}" if is_cut else f"{text}{line_end}")


def first_word(code: str) -> str:
    """The word that a line begins with, up to white space or a parenthesis; empty where there is none."""
    return next(iter(code.replace("(", " ( ").split()), "")


def words_of(code: str) -> list[str]:
    """Names and other words in code, wherever they stand."""
    return "".join(letter if letter.isalnum() or letter in "_$" else " " for letter in code).split()


def short(code: str) -> str:
    """Code as messages show it."""
    text = " ".join(code.split())
    return text if len(text) <= 60 else f"{text[:57]}..."


def flaw_of(code: str) -> str:
    """Which bracket lacks its other half, in parentheses for messages; empty: none does."""
    opened: list[str] = []
    quoted = False
    for letter in code:
        if letter == '"':
            quoted = not quoted
        elif quoted or letter not in _BRACKETS:
            continue
        elif letter in "([{":
            opened.append(letter)
        elif not opened:
            return f" (nothing opens its '{letter}')"
        elif _BRACKETS[opened[-1]] != letter:
            break
        else:
            opened.pop()
    return f" (its '{opened[-1]}' is not closed)" if opened else ""
