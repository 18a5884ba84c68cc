"""Features and targets of motions, computed by DuckDB from the pipeline's Parquet files: one SQL file per table."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import duckdb
import pyarrow as pa

from reproduction.features.optima import add_optima
from reproduction.features.views import add_view, check_complete, source_name
from robojoule.errors import InputError

FEATURE_TABLES = ("joint_travel", "path_figures", "joint_figures", "geometry", "inputs", "optima", "features")
"""Tables up to the features and targets of every motion."""
FINDING_TABLES = ("correlations", "retrace", "claims_features")
"""Tables that say what the features show (thesis 4.3)."""


def connect(
    motions: str | Path | pa.Table, samples: str | Path | pa.Table, runs: str | Path | pa.Table
) -> duckdb.DuckDBPyConnection:
    """Open an in-memory database with the views `motions`, `samples` and `runs`.

    Args:
        motions: Parquet file (a glob is allowed) or table of motions, see `docs/nomenclature.md` for its columns.
        samples: Time series of the runs.
        runs: Runs with their energy.

    Returns:
        Connection with one thread, because the order of a floating-point sum must not depend on the machine. Its
        variables `slowest_percent` and `fastest_percent` are the least and the largest speed limit of the runs. [%]

    Raises:
        InputError: A file is missing or unreadable; a column is missing or holds anything but finite numbers; a motion
            lacks its runs or samples; the runs have fewer than two speed limits.
    """
    connection = duckdb.connect(config={"threads": 1, "preserve_insertion_order": True})
    sources = {"motions": motions, "samples": samples, "runs": runs}
    for name, source in sources.items():
        add_view(connection, name, source)
    check_complete(connection, sources)
    connection.execute("SET VARIABLE slowest_percent = (SELECT min(speed_limit_percent) FROM runs)")
    connection.execute("SET VARIABLE fastest_percent = (SELECT max(speed_limit_percent) FROM runs)")
    query = "SELECT getvariable('slowest_percent') < getvariable('fastest_percent')"
    if not connection.execute(query).fetchall()[0][0]:
        raise InputError(
            "the runs need a slowest and a fastest speed limit",
            file=source_name(runs),
            allowed="two or more",
        )
    return connection


def build(connection: duckdb.DuckDBPyConnection, tables: tuple[str, ...] = FEATURE_TABLES) -> None:
    """Create `tables` in their order by running the SQL file of each; `optima` is computed by `robojoule.profile`.

    Args:
        connection: From `connect`.
        tables: Some of `FEATURE_TABLES`, `FINDING_TABLES`; a table needs those before it.
    """
    for table in tables:
        if table == "optima":
            add_optima(connection)
        else:
            connection.execute(sql(table))


def sql(table: str) -> str:
    """Text of the SQL file that creates `table`."""
    return resources.files(__name__).joinpath(f"{table}.sql").read_text(encoding="utf-8")


def fetch(connection: duckdb.DuckDBPyConnection, table: str) -> pa.Table:
    """Whole `table`, in the order in which its SQL file sorts it."""
    return connection.table(table).to_arrow_table()
