"""What the stages left behind, read for figures and report: Parquet through DuckDB, tables and metrics from files."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from functools import cached_property
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
from numpy.typing import NDArray

from reproduction.layout import Layout
from reproduction.methods.three_segment_profile import ThreeSegmentShape
from reproduction.tables import read_csv
from robojoule.errors import InputError
from robojoule.motion.simulation import MotionPaths
from robojoule.profile.sampled import SampledProfile, sampled_profile
from robojoule.robots.robot import Robot

PARQUET = ("trees", "motions", "runs", "features", "predictions", "plans")
Columns = dict[str, NDArray[Any]]
Rows = list[dict[str, str]]

TEXTS = ("tree_id", "split", "complexity", "robot", "model", "method", "point_spacing", "move")
"""Columns of text; all others hold numbers or truth values."""
PLAN_COLUMNS = (
    "krc_segments",
    "move",
    "d_min_s",
    "duration_s",
    "speed_limit_percent",
    "prior_wait_s",
    "post_wait_s",
    "collision_wait_s",
)
"""Figures take whole rows of the plans, so that no query tells which column is missing."""


class Results:
    """Results of all stages; files are read when they are first needed.

    Args:
        layout: Folder of the project.
        robot: The robot that was simulated.
        shape: Constants of the three-segment profile.
        views: Which tables there are already: those of `PARQUET`, if all stages have run.
    """

    def __init__(self, layout: Layout, robot: Robot, shape: ThreeSegmentShape, views: Sequence[str] = PARQUET) -> None:
        self.layout = layout
        self.robot = robot
        self.shape = shape
        self.views = views

    @cached_property
    def _connection(self) -> duckdb.DuckDBPyConnection:
        connection = duckdb.connect(config={"threads": 1})  # sums must not depend on the number of processors
        for name in self.views:
            path = self.layout.data_dir / f"{name}.parquet"
            if not path.exists():
                raise InputError("this result is missing; run the stages before draw_figures first", file=path)
            try:
                relation = connection.read_parquet(str(path))
                relation.create_view(name)
            except duckdb.Error as error:
                first = " ".join(str(error).split())
                raise InputError(f"the file cannot be read ({first})", file=path) from None
            types = dict(zip(relation.columns, map(str, relation.types), strict=True))
            _check_types(types, PLAN_COLUMNS if name == "plans" else (), path)
        return connection

    def query(self, sql: str, *parameters: Any) -> Columns:
        """Result of a query on the views.

        Args:
            sql: Query; it orders its rows.
            parameters: Values of its question marks.

        Returns:
            One array a column; numbers that are null become NaN.

        Raises:
            InputError: A file is missing, unreadable or lacks a column.
        """
        try:
            fetched = self._connection.execute(sql, list(parameters)).fetchnumpy()
        except duckdb.Error as error:
            first = " ".join(str(error).split())
            raise InputError(f"the results do not fit together ({first})", file=self.layout.data_dir) from None
        return {name: _plain(values) for name, values in fetched.items()}

    @cached_property
    def _runs(self) -> tuple[dict[int, slice], Columns]:
        """Rows of each motion, and the runs."""
        runs = self.query(
            "SELECT motion_id, duration_s, energy_j, speed_limit_percent / 100 AS speed_limit FROM runs"
            " ORDER BY motion_id, speed_limit_percent"
        )
        motions, first = np.unique(runs["motion_id"], return_index=True)
        bounds = pairwise([*first.tolist(), len(runs["motion_id"])])
        return {int(motion): slice(a, b) for motion, (a, b) in zip(motions, bounds, strict=True)}, runs

    @cached_property
    def plan_bound(self) -> str:
        """What captions say of the least speed limit, that of the slowest runs."""
        least = float(self._runs[1]["speed_limit"].min()) * 100.0
        return f"No plan uses a speed limit below {least:g} %, that of the slowest run; the optimum keeps to it, too."

    def profile(self, motion_id: int) -> SampledProfile:
        """Distinct runs of a motion."""
        rows, runs = self._runs
        chosen = rows[int(motion_id)]
        return sampled_profile(runs["duration_s"][chosen], runs["energy_j"][chosen], runs["speed_limit"][chosen])

    def paths(self, motion_ids: Sequence[int]) -> MotionPaths:
        """Physics of some motions, in the order given."""
        ends = [f"{end}_q{joint + 1}_rad" for end in ("start", "end") for joint in range(self.robot.joint_count)]
        rows = self.query(f"SELECT motion_id, {', '.join(ends)} FROM motions ORDER BY motion_id")
        places = np.searchsorted(rows["motion_id"], motion_ids)
        values = np.stack([rows[name][places] for name in ends], axis=1)
        return MotionPaths(self.robot, values[:, : self.robot.joint_count], values[:, self.robot.joint_count :])

    def table(self, name: str) -> Rows | None:
        """Rows of `<name>.csv` of the tables folder as text; None if no stage wrote it."""
        return _csv(self.layout.tables_dir / f"{name}.csv")

    def plan_table(self, name: str) -> Rows:
        """Rows of a table that the stage evaluate_plans writes.

        Raises:
            InputError: The table is missing or empty.
        """
        rows = self.table(name)
        if not rows:
            path = self.layout.tables_dir / f"{name}.csv"
            raise InputError("the table is missing; run the stage evaluate_plans first", file=path)
        return rows

    def study(self, name: str) -> Rows | None:
        """Rows of a result table of the studies as text; None if there is none."""
        return _csv(self.layout.study_tables_dir / f"{name}.csv")


def _check_types(types: dict[str, str], needed: Sequence[str], path: Path) -> None:
    for column in needed:
        if column not in types:
            raise InputError("this column is missing", file=path, key=column)
    for column, found in types.items():
        if (found == "VARCHAR") != (column in TEXTS):
            kind = "text" if column in TEXTS else "numbers"
            raise InputError(f"the column holds {found}, not {kind}", file=path, key=column)


def _csv(path: Path) -> Rows | None:
    return read_csv(path) if path.exists() else None


def published(table: str) -> Rows:
    """Rows of a table of the thesis, as text; see `published/README.md` for the source.

    Args:
        table: table_5_1, table_6_1, table_6_2 or table_6_3.
    """
    text = resources.files(__name__.rpartition(".")[0]).joinpath("published", f"{table}.csv").read_text("utf-8")
    return list(csv.DictReader(io.StringIO(text)))


def number(text: str | None) -> float:
    """Number in a table cell; NaN where the cell is empty or no number."""
    try:
        return float(text) if text else float("nan")
    except ValueError:
        return float("nan")


def _plain(values: Any) -> NDArray[Any]:
    if not isinstance(values, np.ma.MaskedArray):
        return np.asarray(values)
    present = ~np.ma.getmaskarray(values)
    if values.dtype.kind in "iufb" and not present.all():
        return np.where(present, values.data.astype(float), np.nan)
    return np.asarray(values.data)
