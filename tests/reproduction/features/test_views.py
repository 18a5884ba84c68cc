"""Tables with a gap are refused: SQL alone would pass over it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from reproduction import features
from robojoule.errors import InputError
from tests.reproduction.features.synthetic import DataSet, make

FILES = {"motions": "motions.parquet", "samples": "samples/*.parquet", "runs": "runs.parquet"}


@pytest.fixture(scope="module")
def data() -> DataSet:
    return make(trees=2)


def without(column: str):
    return lambda table: table.drop_columns([column])


def with_values(column: str, change):
    def changed(table: pa.Table) -> pa.Table:
        values = pa.array(change(table[column].to_pylist()))
        return table.set_column(table.column_names.index(column), column, values)

    return changed


def without_motion(number: int):
    return lambda table: table.filter(pa.array(table["motion_id"].to_numpy() != number))


# id: table, its change, words of the message
FAULTS = {
    "column": ("samples", without("path_jerk_per_s3"), "path_jerk_per_s3: this column is missing"),
    "joint in the middle": ("motions", without("start_q3_rad"), "start_q3_rad: this column is missing"),
    "last joint": ("motions", without("end_q6_rad"), "end_q6_rad: this column is missing"),
    "label": ("motions", without("split"), "split: this column is missing"),
    "text": ("runs", with_values("energy_j", lambda v: [str(x) for x in v]), "energy_j: the column holds VARCHAR, not"),
    "not a number": ("runs", with_values("duration_s", lambda v: [np.nan, *v[1:]]), "duration_s: 1 rows are empty or"),
    "empty cell": ("motions", with_values("end_z_m", lambda v: [None, None, *v[2:]]), "end_z_m: 2 rows are empty or"),
    "empty label": ("motions", with_values("split", lambda v: [None, *v[1:]]), "split: 1 rows are empty or"),
    "no motions": ("motions", lambda table: table.slice(0, 0), "there are no motions; allowed: at least one"),
    "motion without runs": ("runs", without_motion(5), "motion_id: 1 motions have no runs, the first is 5"),
    "motion without samples": ("samples", without_motion(2), "motion_id: 1 motions have no samples, the first is 2"),
}


@pytest.mark.parametrize("table, change, message", FAULTS.values(), ids=FAULTS)
def test_gaps_are_refused_with_table_and_column(data: DataSet, table, change, message) -> None:
    tables = {"motions": data.motions, "samples": data.samples, "runs": data.runs}
    tables[table] = change(tables[table])
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        features.connect(tables["motions"], tables["samples"], tables["runs"])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("table", FILES)
def test_missing_and_garbled_files_are_named(data: DataSet, tmp_path: Path, table) -> None:
    data.write(tmp_path, shards=1)
    sources = {name: tmp_path / file for name, file in FILES.items()}
    (path,) = sources[table].parent.glob(sources[table].name)
    whole = path.read_bytes()
    for content in (whole[: len(whole) // 2], b""):
        path.write_bytes(content)
        with pytest.raises(InputError, match=re.escape("the file cannot be read (")) as caught:
            features.connect(**sources)
        assert caught.value.file == str(sources[table])
    path.unlink()
    with pytest.raises(InputError) as caught:
        features.connect(**sources)
    assert str(caught.value) == f"{sources[table]}: the file is missing; run the stage simulate_motions first"
