"""Texts of vendors' files as they stand, byte for byte, and edits of them."""

from __future__ import annotations

import difflib
import io
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from robojoule.documents import read_bytes
from robojoule.errors import InputError

_MOST_BYTES = 8 * 2**20  # of a robot program; the largest generated ones are smaller


@dataclass(frozen=True, order=True)
class Span:
    """Characters of one of a program's files.

    Attributes:
        start: First character.
        end: The one behind the last.
        file: Which of the files: 0 is the one that was named, 1 the one that goes with it.
    """

    start: int
    end: int
    file: int = 0


@dataclass(frozen=True)
class Edit:
    """Characters, and what shall stand there."""

    span: Span
    text: str


@dataclass(frozen=True)
class SourceText:
    """A file's text with its own line ends and marks.

    Attributes:
        path: The file.
        text: All of it; encoded again it is the file, byte for byte.
        encoding: Its encoding.
    """

    path: Path
    text: str
    encoding: str = "utf-8"

    @cached_property
    def _line_starts(self) -> list[int]:
        starts = [0]
        for line in lines_of(self.text):
            starts.append(starts[-1] + len(line))
        return starts

    def line(self, place: int) -> int:
        """Number of the line of a character, from 1 on."""
        return max(bisect_right(self._line_starts, place), 1) if place < self._line_starts[-1] else self.lines

    @property
    def lines(self) -> int:
        """How many lines there are, at least 1."""
        return max(len(self._line_starts) - 1, 1)

    def line_span(self, line: int, file: int = 0) -> Span:
        """A line with its end."""
        return Span(self._line_starts[line - 1], self._line_starts[min(line, len(self._line_starts) - 1)], file)

    @property
    def line_end(self) -> str:
        """How its lines end."""
        return "\r\n" if "\r\n" in self.text else "\n"

    def encoded(self, text: str) -> bytes:
        """Another text in the file's encoding."""
        return text.encode(self.encoding)


def read_source(path: Path) -> SourceText:
    """Read a file: UTF-8 if it is that, else one character for each byte, as code pages of controllers have it.

    Raises:
        InputError: It cannot be read, or is not text.
    """
    content = read_bytes(path, _MOST_BYTES)
    if b"\0" in content:
        raise InputError("the file is not 8-bit text", file=path, allowed="ANSI or UTF-8 text")
    try:
        return SourceText(path, content.decode("utf-8"), "utf-8")
    except UnicodeDecodeError:
        return SourceText(path, content.decode("latin-1"), "latin-1")


@contextmanager
def numbers_in_bounds(path: Path) -> Iterator[None]:
    """Refuse a program that is nested too deeply, or has a number that cannot be a place, a count or a time.

    Raises:
        InputError: Reading ends for want of depth, or meets a number that is infinite or has thousands of digits.
    """
    try:
        yield
    except RecursionError:
        raise InputError("the program is nested too deeply", file=path) from None
    except OverflowError:
        raise InputError("a number is beyond all bounds", file=path) from None
    except ValueError as error:
        if "digits" not in str(error):  # what Python says of integers that it does not read
            raise
        raise InputError("a number has too many digits", file=path) from None


def lines_of(text: str) -> list[str]:
    """Lines with their ends, as editors count them: other marks that Python takes for ends are none."""
    return list(io.StringIO(text, newline=""))


def edited(text: str, edits: Iterable[Edit]) -> str:
    """A text with edits, which do not overlap; those at the same place stand in their given order."""
    pieces, at = [], 0
    for edit in sorted(edits, key=lambda one: (one.span.start, one.span.end)):
        if edit.span.start < at:
            raise ValueError(f"two edits overlap at character {edit.span.start}")
        pieces += [text[at : edit.span.start], edit.text]
        at = edit.span.end
    return "".join([*pieces, text[at:]])


def unified_diff(before: Sequence[SourceText], after: Sequence[str]) -> str:
    """What changes in files, as a unified diff; empty if nothing does."""
    found: list[str] = []
    for source, text in zip(before, after, strict=True):
        lines = [[f"{line.rstrip(chr(13) + chr(10))}\n" for line in lines_of(one)] for one in (source.text, text)]
        found += difflib.unified_diff(lines[0], lines[1], str(source.path), str(source.path), n=2)
    return "".join(found)
