"""Tables of numbers from CSV and Parquet files, column by column."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robojoule.arrays import Array
from robojoule.documents import check_file, read_text, reason
from robojoule.errors import InputError, require_package
from robojoule.inputs import counted, shown

MOST_LOG_BYTES = 2**31


@dataclass(frozen=True)
class LogTable:
    """A table as it was read; a column is converted when it is asked for.

    Attributes:
        source: File it was read from.
        names: Names of the columns, as the file has them.
        values: Numbers of the column at a place, shape (T,); NaN where a cell is empty.
    """

    source: str
    names: tuple[str, ...]
    values: Callable[[int], Array]

    def column(self, name: str) -> Array:
        """Numbers of a column, shape (T,).

        Raises:
            InputError: There is no such column, or a cell is empty or not a finite number.
        """
        if name not in self.names:
            raise InputError("this column is missing", file=self.source, key=name)
        values = self.values(self.names.index(name))
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise InputError(f"row {bad[0] + 1} is empty or not a finite number", file=self.source, key=name)
        return values


def read_table(path: Path) -> LogTable:
    """Read a table with at least one row; rows are counted from 1 below the header.

    Args:
        path: CSV file (comma-separated, with a header) or, if pyarrow is installed, Parquet file.

    Raises:
        InputError: The file cannot be read, has no rows or a column twice.
    """
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".parquet"):
        raise InputError(f"unknown file type '{suffix}'", file=path, allowed=".csv, .parquet")
    check_file(path, MOST_LOG_BYTES)
    try:
        table, rows = _read_parquet(path) if suffix == ".parquet" else _read_csv(path)
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"the log cannot be read ({reason(error)})", file=path) from None
    doubled = sorted({name for name in table.names if table.names.count(name) > 1})
    if doubled:
        raise InputError("this column appears twice", file=path, key=doubled[0])
    if rows == 0:
        raise InputError("the log has no rows", file=path)
    return table


def _read_csv(path: Path) -> tuple[LogTable, int]:
    """The table and its number of rows; whole rows are kept, so that one of another length is noticed."""
    rows = [row for row in csv.reader(io.StringIO(read_text(path, MOST_LOG_BYTES))) if row]
    if not rows:
        raise ValueError("it is empty")
    names, cells = rows[0], rows[1:]
    for number, row in enumerate(cells, start=1):
        if len(row) != len(names):
            raise ValueError(f"row {number} has {counted(len(row), 'cell')}, the header {len(names)}")

    def values(place: int) -> Array:
        column = [row[place].strip() or "nan" for row in cells]
        try:
            text = "".join(column)
            if text.isascii() and "_" not in text:
                return np.array(column, dtype=float)
        except ValueError:
            pass
        number = next(number for number, cell in enumerate(column, start=1) if not _is_number(cell))
        problem = f"row {number} holds {shown(column[number - 1])}, which is not a number"
        raise InputError(problem, file=path, key=names[place])

    return LogTable(str(path), tuple(names), values), len(cells)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return cell.isascii() and "_" not in cell


def _read_parquet(path: Path) -> tuple[LogTable, int]:
    require_package("pyarrow", "parquet", "reading Parquet")
    import pyarrow as pa
    from pyarrow import parquet

    try:
        table = parquet.read_table(path)
    except pa.ArrowException as error:
        raise ValueError(error) from None

    def values(place: int) -> Array:
        column: Any = table.column(place)
        if not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
            raise InputError(f"the column holds {column.type}, not numbers", file=path, key=table.column_names[place])
        return np.asarray(column.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=float)

    return LogTable(str(path), tuple(table.column_names), values), table.num_rows
