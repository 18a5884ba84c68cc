"""How tables of numbers come as text: which signs separate cells and decimals, what the letters are coded by.

A table has a header; below it may be a row of units. Cells are separated by commas, semicolons or tabs, or by blanks
where the header has none of these, as recorders of Universal Robots controllers write. Where commas do not separate
cells, they may separate decimals. Text is UTF-8 or UTF-16 with a mark at its beginning; text that is
not UTF-8 is read as Latin-1, as older programs of Windows write it. Time may be in ISO stamps.
"""

from __future__ import annotations

import codecs
import csv
import io
import re
import zlib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from robojoule.arrays import Array
from robojoule.errors import InputError
from robojoule.inputs import shown

_SEPARATORS = (",", ";", "\t")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|nan", re.IGNORECASE)
_STAMP = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d")
# The longest endings first: q1_velocity_rad_s does not end with a unit of time.
_UNITS = {
    "_rad_s": ("rad/s",),
    "_percent": ("%", "percent"),
    "_rad": ("rad",),
    "_deg": ("deg", "°", "degree", "degrees"),
    "_nm": ("Nm", "N m", "N*m", "N\u00b7m", "N\u22c5m"),
    "_kg": ("kg",),
    "_j": ("J", "Ws"),
    "_w": ("W", "watt", "watts"),
    "_a": ("A", "amp", "ampere"),
    "_s": ("s", "sec", "second", "seconds"),
}


@dataclass(frozen=True)
class Rows:
    """A table as text.

    Attributes:
        names: Names of the columns.
        units: What the row of units says, column by column; empty without one.
        cells: Its rows.
        separator: What separates cells.
    """

    names: list[str]
    units: list[str]
    cells: list[list[str]]
    separator: str

    def number_text(self, cell: str) -> str:
        """A cell as Python writes numbers: a decimal comma becomes a point."""
        text = cell.strip()
        if self.separator != "," and _DECIMAL_COMMA.fullmatch(text):
            return text.replace(",", ".")
        return text


_CHUNK_BYTES = 2**16


def unpacked(content: bytes, most_bytes: int) -> bytes:
    """Content of a gzip file.

    Raises:
        ValueError: It is larger than `most_bytes`, or cut off.
        zlib.error: It is damaged or none.
    """
    parts: list[bytes] = []
    left, engine = most_bytes, None
    for place in range(0, len(content), _CHUNK_BYTES):
        rest = content[place : place + _CHUNK_BYTES]  # in chunks: what follows a member is copied
        while rest:
            engine = engine or zlib.decompressobj(wbits=31)
            parts.append(engine.decompress(rest, left + 1))
            left -= len(parts[-1])
            if left < 0:
                raise ValueError(f"it unpacks to more than {most_bytes // 2**20} MB")
            rest = engine.unused_data
            engine = None if engine.eof else engine
    if engine is not None:
        raise ValueError("it is cut off")
    return b"".join(parts)


def decoded(content: bytes) -> str:
    """Text of a file's content.

    Raises:
        ValueError: UTF-16 that is cut off, or bytes that no text holds.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    if "\0" in text:
        raise ValueError("it is not text")
    return text


def rows_of(text: str) -> Rows:
    """A table's header, units and rows; empty lines are left out.

    Raises:
        ValueError: There is no header.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n")
    header = next((line for line in lines.split("\n") if line.strip()), "")
    separator = max(_SEPARATORS, key=header.count)
    if separator not in header and " " in header.strip():
        separator = " "
        lines = "\n".join(" ".join(line.split()) for line in lines.split("\n"))
    rows = [row for row in csv.reader(io.StringIO(lines), delimiter=separator) if any(cell.strip() for cell in row)]
    if not rows:
        raise ValueError("it is empty")
    names, cells = [name.strip() for name in rows[0]], rows[1:]
    units: list[str] = []
    if len(cells) > 1 and _holds_units(cells[0], cells[1]):
        units, cells = [cell.strip().strip("[]()") for cell in cells[0]], cells[1:]
    return Rows(names, units, cells, separator)


def _holds_units(row: list[str], following: list[str]) -> bool:
    """Whether a row says units: no number in it, numbers below, and what is above a number is short."""
    if len(row) != len(following) or any(_NUMBER.fullmatch(cell.strip()) for cell in row):
        return False
    below = [cell for cell, next_cell in zip(row, following, strict=True) if _NUMBER.fullmatch(next_cell.strip())]
    return bool(below) and all(len(cell.strip()) <= 10 for cell in below) and any(cell.strip() for cell in below)


def check_unit(name: str, unit: str, file: Path) -> None:
    """Refuse a unit that contradicts the ending of a column's name.

    Raises:
        InputError: It does.
    """
    text = unit.strip().casefold()
    expected = next((units for ending, units in _UNITS.items() if name.endswith(ending)), None)
    if text in ("", "-", "1") or expected is None or text in (one.casefold() for one in expected):
        return
    raise InputError(f"the row of units says {shown(unit)}", file=file, key=name, allowed=expected[0])


def seconds_of_stamps(column: list[str]) -> Array | None:
    """ISO stamps as seconds since the first one, shape (T,); None where a cell holds something else. [s]"""
    if not column or not all(_STAMP.match(cell) for cell in column):
        return None
    try:
        stamps = [datetime.fromisoformat(cell) for cell in column]
    except ValueError:
        return None
    aware = [stamp if stamp.tzinfo is not None else stamp.replace(tzinfo=UTC) for stamp in stamps]
    return np.array([(stamp - aware[0]).total_seconds() for stamp in aware])
