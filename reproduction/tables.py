"""Tables of the pipeline: read and checked, so that a fault is refused by file and column, and written."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from robojoule.arrays import Array, Index
from robojoule.documents import atomic_path, write_text
from robojoule.errors import InputError

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
    schema = _schema(path, stage)
    try:
        # Before the rows are filtered: a filter on a column of another type fails without its name.
        _check_schema(schema, numbers, path)
        _check_schema(schema, texts, path, text=True)
        table = pq.read_table(path, columns=[*numbers, *texts], filters=filters)
    except (OSError, pa.ArrowException) as error:
        raise _unreadable(path, error) from None
    columns(table, numbers, path)
    for name in texts:
        if table[name].null_count:
            raise InputError(f"{table[name].null_count} rows are empty", file=path, key=name)
    return table


def column_names(path: Path, stage: str) -> list[str]:
    """Names of the columns of a Parquet file.

    Raises:
        InputError: The file is missing, which `stage` writes, or unreadable.
    """
    return list(_schema(path, stage).names)


def _schema(path: Path, stage: str) -> pa.Schema:
    if not path.exists():
        raise InputError(f"the file is missing; run the stage {stage} first", file=path)
    try:
        return pq.read_schema(path)
    except (OSError, pa.ArrowException) as error:
        raise _unreadable(path, error) from None


def _unreadable(path: Path, error: Exception) -> InputError:
    return InputError(f"the file cannot be read ({' '.join(str(error).split())})", file=path)


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
            raise InputError(f"{gaps} rows are empty or not finite numbers", file=source, key=name)
    return values


def read_runs(path: Path, motion_id: Index) -> tuple[Array, Array, Array]:
    """Simulated runs of some motions.

    Args:
        path: Runs, one row per motion and speed limit.
        motion_id: Which motions, shape (M,).

    Returns:
        Speed limits, rising fractions, shape (S,) [-]; durations [s] and energies [J], shape (M, S).

    Raises:
        InputError: The file is missing or cannot be read, or there is not one run for each motion and speed limit.
    """
    names = ["motion_id", "speed_limit_percent", "duration_s", "energy_j"]
    wanted = [("motion_id", "in", motion_id.tolist())]
    table = read_table(path, "simulate_motions", numbers=names, filters=wanted)
    found, percent, duration, energy = columns(table, names, path).T
    limits = np.unique(percent)
    order = np.lexsort((percent, found))
    rows = len(motion_id), len(limits)
    pairs = np.repeat(np.sort(motion_id), rows[1]), np.tile(limits, rows[0])
    if not len(table) or not np.array_equal([found[order], percent[order]], pairs):
        raise InputError("there is not one run for each motion and speed limit", file=path, key="motion_id")
    place = np.argsort(np.argsort(motion_id))
    return limits / 100.0, duration[order].reshape(rows)[place], energy[order].reshape(rows)[place]


def _check_schema(schema: pa.Schema, names: Sequence[str], source: str | Path, *, text: bool = False) -> None:
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


def write_parquet(path: Path, table: pa.Table) -> None:
    """Write a table as Parquet, atomically."""
    with atomic_path(path) as temporary:
        pq.write_table(table, temporary, compression="zstd")


def table_of_rows(rows: Sequence[Mapping[str, object]], texts: Sequence[str] = ()) -> pa.Table:
    """Rows as a table; the columns `texts`, which may hold numbers and words, are kept as text."""
    return pa.table({name: [str(row[name]) if name in texts else row[name] for row in rows] for name in rows[0]})
