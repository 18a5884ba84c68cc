"""Folds: comments for the editor of KUKA controllers, which rebuilds the code of a motion from them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from robojoule.formats.vendor.lines import Line
from robojoule.formats.vendor.text import Span

_OPENS = re.compile(r";\s*FOLD\b\s*(.*)", re.IGNORECASE)
_CLOSES = re.compile(r";\s*ENDFOLD\b", re.IGNORECASE)
_OF_A_MOTION = re.compile(r"S?(PTP|LIN|CIRC)\b", re.IGNORECASE)
_OF_A_SPLINE = re.compile(r"(PTP_)?SPLINE\b", re.IGNORECASE)
# Where the comments of a joint motion say its speed: "Vel= 100 %", "Kuka.VelocityPtp=100;", "%P 1:PTP, ... 5:100,".
_SPEEDS = (
    re.compile(r"\bVel\s*=\s*(\d+(?:\.\d+)?)\s*%", re.IGNORECASE),
    re.compile(r"\bKuka\.VelocityPtp\s*=\s*(\d+(?:\.\d+)?)", re.IGNORECASE),
    re.compile(r"%P\s+1:S?PTP\b.*?\b5:\s*(\d+(?:\.\d+)?)", re.IGNORECASE),
)


@dataclass(frozen=True)
class Fold:
    """The fold of one motion.

    Attributes:
        first: Index of its first line.
        last: Index of its last line.
    """

    first: int
    last: int


def motion_folds(lines: list[Line]) -> dict[int, Fold]:
    """Folds of motions by the first character of the motion's statement."""
    found: dict[int, Fold] = {}
    stack: list[tuple[int, bool, list[int]]] = []
    for index, line in enumerate(lines):
        comment = "" if line.code else line.comment
        opens = _OPENS.match(comment)
        if opens is not None:
            stack.append((index, _OF_A_MOTION.match(opens[1]) is not None, []))
        elif _CLOSES.match(comment) and stack:
            first, is_motion, statements = stack.pop()
            if is_motion and len(statements) == 1:  # more than one: the editor does not rebuild it
                found.setdefault(statements[0], Fold(first, index))
            elif stack:
                stack[-1][2].extend(statements)
        elif line.kind == "motion" and stack:
            stack[-1][2].append(line.code_start)
    return found


def spline_folds(lines: list[Line]) -> dict[int, Fold]:
    """Folds of blocks of splines by the first character of the line that opens the block."""
    found: dict[int, Fold] = {}
    stack: list[tuple[int, list[int]]] = []
    for index, line in enumerate(lines):
        comment = "" if line.code else line.comment
        opens = _OPENS.match(comment)
        if opens is not None:
            stack.append((index, []))
        elif _CLOSES.match(comment) and stack:
            first, heads = stack.pop()
            name = _OPENS.match(lines[first].comment)
            if len(heads) == 1 and name is not None and _OF_A_SPLINE.match(name[1]):
                found.setdefault(heads[0], Fold(first, index))
            elif stack:
                stack[-1][1].extend(heads)
        elif line.kind == "spline" and stack:
            stack[-1][1].append(line.code_start)
    return found


def speeds_in(lines: list[Line]) -> Iterator[Span]:
    """Where the comments of a fold say its motion's speed."""
    for line in lines:
        if line.code:
            continue
        offset = line.start + len(line.text) - len(line.comment)
        for pattern in _SPEEDS:
            for match in pattern.finditer(line.comment):
                yield Span(offset + match.start(1), offset + match.end(1), line.file)
