"""Tables of numbers from CSV and Parquet files, column by column."""

from __future__ import annotations

import csv
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robojoule.arrays import Array
from robojoule.calibration.dialects import check_unit, decoded, rows_of, seconds_of_stamps, unpacked
from robojoule.documents import check_file, read_bytes, reason
from robojoule.errors import InputError, require_package
from robojoule.inputs import LARGEST, counted, shown

MOST_LOG_BYTES = 2**31
SUFFIXES = (".csv", ".tsv", ".txt", ".csv.gz", ".tsv.gz", ".txt.gz", ".parquet")


@dataclass(frozen=True)
class LogTable:
    """A table as it was read; a column is converted when it is asked for.

    Attributes:
        source: File it was read from.
        names: Names of the columns, in small letters.
        values: Numbers of the column at a place, shape (T,); NaN where a cell is empty.
        texts: Texts of the column at a place.
    """

    source: str
    names: tuple[str, ...]
    values: Callable[[int], Array]
    texts: Callable[[int], list[str]]

    def words(self, name: str) -> list[str]:
        """Texts of a column.

        Raises:
            InputError: There is no such column, or a cell is empty.
        """
        if name not in self.names:
            raise InputError("this column is missing", file=self.source, key=name)
        found = self.texts(self.names.index(name))
        if "" in found:
            raise InputError(f"row {found.index('') + 1} is empty", file=self.source, key=name)
        return found

    def column(self, name: str) -> Array:
        """Numbers of a column, shape (T,).

        Raises:
            InputError: There is no such column, or a cell is empty or not a finite number.
        """
        if name not in self.names:
            raise InputError("this column is missing", file=self.source, key=name)
        values = self.values(self.names.index(name))
        bad = np.flatnonzero(~(np.abs(values) <= LARGEST))
        if bad.size:
            is_far = np.isfinite(values[bad[0]])
            problem = "holds a number beyond all bounds" if is_far else "is empty or not a finite number"
            raise InputError(f"row {bad[0] + 1} {problem}", file=self.source, key=name)
        return values


def read_table(path: Path) -> LogTable:
    """Read a table with at least one row; rows are counted from 1 below the header.

    Args:
        path: CSV file as `robojoule.calibration.dialects` describes it or, if pyarrow is installed, Parquet file.

    Raises:
        InputError: The file cannot be read, has no rows or a column twice.
    """
    name = path.name.lower()
    if not name.endswith(SUFFIXES):
        raise InputError(f"unknown file type '{path.suffix.lower()}'", file=path, allowed=", ".join(SUFFIXES))
    check_file(path, MOST_LOG_BYTES)
    try:
        table, rows = _read_parquet(path) if name.endswith(".parquet") else _read_csv(path)
    except (OSError, EOFError, ValueError, csv.Error, zlib.error) as error:
        raise InputError(f"the table cannot be read ({reason(error)})", file=path) from None
    doubled = sorted({name for name in table.names if table.names.count(name) > 1})
    if doubled:
        raise InputError("this column appears twice", file=path, key=doubled[0])
    if rows == 0:
        raise InputError("the table has no rows", file=path)
    return table


def _read_csv(path: Path) -> tuple[LogTable, int]:
    """The table and its number of rows; whole rows are kept, so that one of another length is noticed."""
    content = read_bytes(path, MOST_LOG_BYTES)
    if path.name.lower().endswith(".gz"):
        content = unpacked(content, MOST_LOG_BYTES)
    found = rows_of(decoded(content))
    names, cells = [name.casefold() for name in found.names], found.cells
    for number, row in enumerate(cells, start=1):
        if len(row) != len(names):
            raise ValueError(f"row {number} has {counted(len(row), 'cell')}, the header {len(names)}")

    def values(place: int) -> Array:
        if found.units:  # those of columns that nobody asks for do not matter
            check_unit(names[place], found.units[place], path)
        column = [found.number_text(row[place]) or "nan" for row in cells]
        try:
            text = "".join(column)
            if text.isascii() and "_" not in text:
                return np.array(column, dtype=float)
        except ValueError:
            pass
        seconds = seconds_of_stamps(column)
        if seconds is not None:
            return seconds
        number = next(number for number, cell in enumerate(column, start=1) if not _is_number(cell))
        problem = f"row {number} holds {shown(column[number - 1])}, which is not a number"
        raise InputError(problem, file=path, key=names[place])

    def texts(place: int) -> list[str]:
        return [row[place].strip() for row in cells]

    return LogTable(str(path), tuple(names), values, texts), len(cells)


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
        schema = parquet.read_schema(path)
        texts_of = [field.name for field in schema if pa.types.is_string(field.type)]
        with parquet.ParquetFile(path, read_dictionary=texts_of) as file:  # else a text is repeated in every row
            if 8 * file.metadata.num_rows * file.metadata.num_columns > MOST_LOG_BYTES:
                raise ValueError(f"it holds {file.metadata.num_rows} rows, more than {MOST_LOG_BYTES // 2**20} MB")
            table = file.read()
            kinds = {field.name: field.type for field in schema}
    except pa.ArrowException as error:
        raise ValueError(error) from None

    def values(place: int) -> Array:
        column: Any = table.column(place)
        if not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
            kind = kinds[table.column_names[place]]
            raise InputError(f"the column holds {kind}, not numbers", file=path, key=table.column_names[place])
        return np.asarray(column.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=float)

    def texts(place: int) -> list[str]:
        return [str(value) if value is not None else "" for value in table.column(place).to_pylist()]

    names = tuple(name.casefold() for name in table.column_names)
    return LogTable(str(path), names, values, texts), table.num_rows
