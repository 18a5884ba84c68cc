"""Plans written into the text of a table: cells change, columns are added, all else stays."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

_CELL = re.compile(r'("(?:[^"]|"")*"|[^,\r\n]*)(,|\r\n|\n|\r|\Z)')


def text_with_columns(text: str, columns: Mapping[str, Sequence[str | None]]) -> str:
    """The text of a table with other cells.

    Args:
        text: Comma-separated values; rows without any text do not count.
        columns: For each column a text for every row below the header, None where the cell stays as it is. A column
            that is not there is added if it has a text that is not empty.
    """
    rows = _rows(text)
    names = [text[slice(*cell)].strip().strip('"').strip() for cell in rows[0]]
    edits: list[tuple[int, int, str]] = []
    added = [""] * len(rows)
    for name, cells in columns.items():
        if name in names:
            spans = [row[names.index(name)] for row in rows[1:]]
            edits += [(*span, cell) for span, cell in zip(spans, cells, strict=True) if cell is not None]
        elif any(cells):
            added = [f"{more},{cell or ''}" for more, cell in zip(added, [name, *cells], strict=True)]
    ends = [(row[-1][1], row[-1][1], more) for row, more in zip(rows, added, strict=True)]
    # From the end of the text on; what is added to a row stands behind its last cell, which may be empty.
    for start, end, cell in sorted([*ends, *edits], key=lambda edit: -edit[0]):
        text = text[:start] + cell + text[end:]
    return text


def _rows(text: str) -> list[list[tuple[int, int]]]:
    """Where the cells of each row begin and end, rows without any text left out."""
    rows: list[list[tuple[int, int]]] = []
    row: list[tuple[int, int]] = []
    place = 0
    while place < len(text) or row:
        match = _CELL.match(text, place)
        if match is None:  # a quote within a cell: readers refuse it
            break
        row.append(match.span(1))
        place = match.end()
        if match[2] != ",":
            rows.append(row)
            row = []
    return [row for row in rows if any(text[slice(*cell)].strip() for cell in row)]
