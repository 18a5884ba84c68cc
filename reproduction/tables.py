"""Tables of the pipeline: Parquet read and checked, so that every fault is refused by its name and column; CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robojoule.arrays import Array
from robojoule.documents import write_text
from robojoule.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa

Filters = Sequence[tuple[str, str, object]]
Row = dict[str, object]
"""Cells of one line of a result table, by column."""


def write_csv(path: Path, rows: Sequence[Mapping[str, object]], names: Sequence[str] | None = None) -> None:
    """Write rows as CSV with a header, lines ended by a line feed, atomically.

    Args:
        path: The file.
        rows: The rows.
        names: Columns in order; those of the first row if not given.
    """
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, list(names or (rows[0] if rows else ())), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, buffer.getvalue())


def read_csv(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file as text.

    Raises:
        InputError: The file is missing or cannot be read.
    """
    try:
        return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"the table cannot be read ({error})", file=path) from None


def read_table(
    path: Path, stage: str, *, numbers: Sequence[str], texts: Sequence[str] = (), filters: Filters | None = None
) -> pa.Table:
    """Some columns of a Parquet file.

    Args:
        path: The file.
        stage: Stage that writes it, named where it is missing.
        numbers: Columns of finite numbers.
        texts: Columns of text.
        filters: Rows wanted, as (column, operator, value); these columns are among the others.

    Raises:
        InputError: The file is missing or unreadable; a column is missing, holds something else or a gap.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not path.exists():
        raise InputError(f"the file is missing; run the stage {stage} first", file=path)
    try:
        schema = pq.read_schema(path)
        # Before the rows are filtered: a filter on a column of another type fails without its name.
        _check_schema(schema, numbers, path)
        _check_schema(schema, texts, path, text=True)
        table = pq.read_table(path, columns=[*numbers, *texts], filters=filters)
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"the file cannot be read ({' '.join(str(error).split())})", file=path) from None
    columns(table, numbers, path)
    for name in texts:
        if table[name].null_count:
            raise InputError(f"{table[name].null_count} rows are empty", file=path, key=name)
    return table


def columns(table: pa.Table, names: Sequence[str], source: str | Path = "features") -> Array:
    """Columns of a table as one array.

    Args:
        table: Table of N rows.
        names: Columns wanted, K names.
        source: File named in an error.

    Returns:
        Values, shape (N, K).

    Raises:
        InputError: A column is missing, or holds a value that is not a finite number.
    """
    _check_schema(table.schema, names, source)
    values = np.empty((table.num_rows, len(names)))
    for place, name in enumerate(names):
        values[:, place] = table[name].to_numpy()
        gaps = int((~np.isfinite(values[:, place])).sum())
        if gaps:
            raise InputError(f"{gaps} rows are empty or no finite number", file=source, key=name)
    return values


def _check_schema(schema: pa.Schema, names: Sequence[str], source: str | Path, *, text: bool = False) -> None:
    import pyarrow as pa

    for name in names:
        if name not in schema.names:
            raise InputError("this column is missing", file=source, key=name)
        kind = schema.field(name).type
        right = (
            pa.types.is_string(kind) or pa.types.is_large_string(kind)
            if text
            else pa.types.is_integer(kind) or pa.types.is_floating(kind)
        )
        if not right:
            raise InputError(f"the column holds {kind}, not {'text' if text else 'numbers'}", file=source, key=name)
