"""Tables with every kind of fault; runs in any order."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from reproduction.tables import (
    column_names,
    columns,
    read_csv,
    read_runs,
    read_table,
    table_of_rows,
    write_csv,
    write_parquet,
)
from robojoule.errors import InputError

GOOD = {"tree_id": ["a", "b", "b"], "motion_id": [4, 2, 7], "energy_j": [1.0, 2.0, 3.0]}


def read(path):
    return read_table(path, "simulate_motions", numbers=["motion_id", "energy_j"], texts=["tree_id"])


def test_wanted_columns_and_rows_are_read(tmp_path):
    path = tmp_path / "runs.parquet"
    pq.write_table(pa.table(GOOD | {"other": [None, None, None]}), path)
    wanted = [("tree_id", "==", "b")]
    table = read_table(path, "any", numbers=["energy_j", "motion_id"], texts=["tree_id"], filters=wanted)
    assert table.to_pydict() == {"energy_j": [2.0, 3.0], "motion_id": [2, 7], "tree_id": ["b", "b"]}


def test_columns_keep_the_wanted_order():
    table = pa.table({"b": [1, 2], "a": [3.0, 4.0]})
    assert columns(table, ("a", "b")).tolist() == [[3.0, 1.0], [4.0, 2.0]]


@pytest.mark.parametrize("column", list(GOOD))
@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("missing", "this column is missing"),
        ("type", "the column holds .*, not (numbers|text)"),
        ("null", "1 rows are empty"),
    ],
)
def test_a_bad_column_is_named(tmp_path, column, fault, message):
    path = tmp_path / "runs.parquet"
    changed = {"type": [1, 2, 3] if column == "tree_id" else ["1", "2", "3"], "null": [*GOOD[column][:2], None]}
    data = {name: values for name, values in GOOD.items() if name != column}
    pq.write_table(pa.table(data if fault == "missing" else data | {column: changed[fault]}), path)
    with pytest.raises(InputError, match=rf"runs\.parquet, {column}: {message}"):
        read(path)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_are_finite(tmp_path, value):
    path = tmp_path / "runs.parquet"
    pq.write_table(pa.table(GOOD | {"energy_j": [1.0, value, value]}), path)
    with pytest.raises(InputError, match=r"runs\.parquet, energy_j: 2 rows are empty or not finite numbers"):
        read(path)


def test_missing_and_garbled_files_are_named(tmp_path):
    with pytest.raises(InputError, match=r"runs\.parquet: the file is missing; run the stage simulate_motions first"):
        read(tmp_path / "runs.parquet")
    (tmp_path / "runs.parquet").write_text("nothing", encoding="utf-8")
    with pytest.raises(InputError, match=r"runs\.parquet: the file cannot be read"):
        read(tmp_path / "runs.parquet")
    with pytest.raises(InputError, match="the file cannot be read"):
        read(tmp_path)


def runs():
    """Runs of motions 7, 2 and 4 at 10 %, 60 % and 100 %: durations 10 id / percent, energies id + percent."""
    ids, percents = np.repeat([7, 2, 4], 3), np.tile([60.0, 10.0, 100.0], 3)
    durations, energies = 10.0 * ids / percents, ids + percents
    values = {"motion_id": ids, "speed_limit_percent": percents, "duration_s": durations, "energy_j": energies}
    return pa.table(values)


def test_runs_follow_the_motions_asked_for(tmp_path):
    pq.write_table(runs(), tmp_path / "runs.parquet")
    limits, durations, energies = read_runs(tmp_path / "runs.parquet", np.array([4, 7]))
    assert limits.tolist() == [0.1, 0.6, 1.0]
    assert durations == pytest.approx(np.array([[4.0, 40.0 / 60.0, 0.4], [7.0, 70.0 / 60.0, 0.7]]))
    assert energies.tolist() == [[14.0, 64.0, 104.0], [17.0, 67.0, 107.0]]


@pytest.mark.parametrize("rows", [[], [0, 1, 2], [0, 1, 2, 6, 7], [0, 1, 2, 6, 7, 7], [0, 1, 2, 6, 7, 8, 8]])
def test_one_run_for_each_motion_and_speed_limit(tmp_path, rows):
    pq.write_table(runs().take(pa.array(rows, pa.int64())), tmp_path / "runs.parquet")
    with pytest.raises(InputError, match=r"runs\.parquet, motion_id: there is not one run for each motion and speed"):
        read_runs(tmp_path / "runs.parquet", np.array([4, 7]))


def test_rows_are_written_as_csv_and_read_back(tmp_path):
    path = tmp_path / "new" / "claims.csv"
    write_csv(path, [{"claim": "a, and b", "held": "false"}, {"claim": "c", "held": ""}])
    assert path.read_text() == 'claim,held\n"a, and b",false\nc,\n'
    assert read_csv(path) == [{"claim": "a, and b", "held": "false"}, {"claim": "c", "held": ""}]
    write_csv(path, [], ("claim", "held"))
    assert read_csv(path) == [] and path.read_text() == "claim,held\n"
    with pytest.raises(InputError, match=r"none\.csv: the table cannot be read"):
        read_csv(tmp_path / "none.csv")


def test_columns_with_numbers_and_words_become_text(tmp_path):
    rows = [{"payload_kg": 0.0, "energy_j": 1.0}, {"payload_kg": "all", "energy_j": 2.0}]
    write_parquet(tmp_path / "plans.parquet", table_of_rows(rows, ["payload_kg"]))
    table = pq.read_table(tmp_path / "plans.parquet")
    assert table.to_pydict() == {"payload_kg": ["0.0", "all"], "energy_j": [1.0, 2.0]}
    assert column_names(tmp_path / "plans.parquet", "evaluate_plans") == ["payload_kg", "energy_j"]


def test_columns_of_a_missing_file_name_the_stage(tmp_path):
    with pytest.raises(InputError, match=r"plans\.parquet: the file is missing; run the stage evaluate_plans first"):
        column_names(tmp_path / "plans.parquet", "evaluate_plans")
