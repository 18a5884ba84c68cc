"""The views that the features are computed from, checked before anything is computed.

SQL would pass over a gap: a motion without runs drops out of a join, a joint without a column out of a sum, and a value
that is not a number spreads. So tables are refused here, by file and column.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TypeAlias

import duckdb
import pyarrow as pa

from robojoule.errors import InputError

Source: TypeAlias = str | Path | pa.Table

NUMBERS = {
    "motions": ["motion_id"]
    + [f"{end}_{part}" for end in ("start", "end") for part in ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")],
    "samples": [
        "motion_id",
        "speed_limit_percent",
        "path_velocity_per_s",
        "path_acceleration_per_s2",
        "path_jerk_per_s3",
    ],
    "runs": ["motion_id", "speed_limit_percent", "duration_s", "energy_j"],
}
LABELS = {"motions": ["tree_id", "split", "order"], "samples": [], "runs": ["distinct"]}
"""Columns that must be there beside the numbers."""
_NUMBER_TYPES = {"tinyint", "smallint", "integer", "bigint", "hugeint", "float", "double"}
_JOINT = re.compile(r"(?:start|end)_q(\d+)_rad")


def add_view(connection: duckdb.DuckDBPyConnection, name: str, source: Source) -> None:
    """Create the view `name` over `source`.

    Args:
        connection: Database.
        name: A key of `NUMBERS`.
        source: Parquet file (a glob is allowed) or table.

    Raises:
        InputError: The file is missing or unreadable; a column is missing, holds no numbers or a gap.
    """
    shown, labels = source_name(source), LABELS[name]
    if isinstance(source, (str, Path)) and not any(Path(source).parent.glob(Path(source).name)):
        raise InputError("the file is missing; run the stage simulate_motions first", file=shown)
    try:
        relation = (
            connection.read_parquet(str(source)) if isinstance(source, (str, Path)) else connection.from_arrow(source)
        )
        relation.create_view(name)
    except duckdb.Error as error:
        raise InputError(f"the file cannot be read ({' '.join(str(error).split())})", file=shown) from None
    types = dict(zip(relation.columns, relation.types, strict=True))
    numbers = NUMBERS[name] + (_joint_columns(relation.columns) if name == "motions" else [])
    for column in (*numbers, *labels):
        if column not in types:
            raise InputError("this column is missing", file=shown, key=column)
    for column in numbers:
        if types[column].id not in _NUMBER_TYPES:
            raise InputError(f"the column holds {types[column]}, not numbers", file=shown, key=column)
    filled = ", ".join(
        [f'count(*) - count("{column}") FILTER (isfinite("{column}"::DOUBLE))' for column in numbers]
        + [f'count(*) - count("{column}")' for column in labels]
    )
    gaps = connection.execute(f"SELECT {filled} FROM {name}").fetchall()[0]
    for column, rows in zip((*numbers, *labels), gaps, strict=True):
        if rows:
            raise InputError(f"{rows} rows are empty or no finite number", file=shown, key=column)


def check_complete(connection: duckdb.DuckDBPyConnection, sources: dict[str, Source]) -> None:
    """Check that there are motions, and that each has its rows in the other views.

    Raises:
        InputError: There is no motion, or one without runs, or one that moves without samples.
    """
    if connection.execute("SELECT count(*) FROM motions").fetchall()[0][0] == 0:
        raise InputError("there are no motions", file=source_name(sources["motions"]), allowed="at least one")
    ends = (
        r"SELECT motion_id, [*COLUMNS('^start_q\d+_rad$')] AS first, [*COLUMNS('^end_q\d+_rad$')] AS last FROM motions"
    )
    needed = {"samples": "first <> last", "runs": "true"}  # a motion of length zero has nothing to sample
    for name, condition in needed.items():
        query = (
            f"SELECT count(*), min(motion_id) FROM ({ends}) "
            f"WHERE {condition} AND motion_id NOT IN (SELECT DISTINCT motion_id FROM {name})"
        )
        lacking, first = connection.execute(query).fetchall()[0]
        if lacking:
            raise InputError(
                f"{lacking} motions have no {name}, the first is {first}",
                file=source_name(sources[name]),
                key="motion_id",
                allowed="every motion",
            )


def source_name(source: Source) -> str | Path:
    """How messages name a source."""
    return source if isinstance(source, (str, Path)) else "table"


def _joint_columns(columns: list[str]) -> list[str]:
    """Start and end columns of as many joints as any of them names."""
    joints = max((int(match[1]) for name in columns if (match := _JOINT.fullmatch(name))), default=1)
    return [f"{end}_q{joint}_rad" for end in ("start", "end") for joint in range(1, joints + 1)]
