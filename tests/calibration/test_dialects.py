"""Tables as text: separators, decimals, units, encodings, stamps, packed files."""

import gzip

import numpy as np
import pytest

from robojoule.calibration.dialects import decoded, rows_of, seconds_of_stamps, unpacked
from robojoule.calibration.log_table import read_table
from robojoule.errors import InputError


def test_a_comma_is_a_decimal_only_where_it_does_not_separate():
    assert rows_of("a;b\n1,5;2\n").number_text("1,5") == "1.5"
    assert rows_of("a,b\n1,5\n").number_text("1") == "1"
    assert rows_of("a;b\n1,5;2\n").number_text("1.234,5") == "1.234,5"  # thousands: not guessed


def test_blanks_separate_where_nothing_else_does():
    """As the recorder of Universal Robots' client library writes; names with blanks stay whole beside a separator."""
    found = rows_of("timestamp  actual_q_0 actual_q_1 \n0,5  1 2\n\n 1.5 3 4\n")
    assert found.names == ["timestamp", "actual_q_0", "actual_q_1"]
    assert [[found.number_text(cell) for cell in row] for row in found.cells] == [["0.5", "1", "2"], ["1.5", "3", "4"]]
    assert rows_of("move name, t\nto the belt, 1\n").cells == [["to the belt", " 1"]]
    assert rows_of("move name\tt\nto the belt\t1\n").names == ["move name", "t"]


def test_a_row_of_numbers_or_of_names_is_no_row_of_units():
    assert rows_of("t,x\n0,1\n1,2\n").units == []
    assert rows_of("move,t\nhome,1\nback,2\n").units == []
    assert rows_of("move,t\n,s\nback,2\n").units == ["", "s"]


def test_stamps_are_seconds_from_the_first_one():
    found = seconds_of_stamps(["2025-03-01T12:00:59.900Z", "2025-03-01T12:01:00.150Z"])
    assert found == pytest.approx([0.0, 0.25])
    assert seconds_of_stamps(["2025-03-01T12:00:59", "noon"]) is None
    assert seconds_of_stamps(["2025-02-30T12:00:59"]) is None


def test_packed_tables_are_read_and_damaged_ones_refused(tmp_path):
    text = "time_s,x\n0,1\n1,2\n"
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(text.encode()))
    assert read_table(path).column("x") == pytest.approx([1.0, 2.0])
    path.write_bytes(gzip.compress(text.encode())[:-6])
    with pytest.raises(InputError, match=r"cannot be read .it is cut off"):
        read_table(path)
    path.write_bytes(b"not packed")
    with pytest.raises(InputError, match="cannot be read"):
        read_table(path)


def test_what_unpacks_without_end_is_refused():
    bomb = gzip.compress(b"0" * 5_000_000)
    with pytest.raises(ValueError, match="unpacks to more than"):
        unpacked(bomb, 1_000_000)


def test_parts_that_were_packed_one_by_one_are_one_text():
    """As bgzip packs, across the pieces in which they are read; empty ones without end take no time."""
    noise = np.random.default_rng(1).bytes(50_000)
    packed = gzip.compress(noise, 1) * 3 + gzip.compress(b"") * 50_000 + gzip.compress(b"end")
    assert unpacked(packed, 200_000) == noise * 3 + b"end"


def test_letters_of_windows_and_of_two_bytes():
    assert decoded("Größe;x".encode("latin-1")) == "Größe;x"
    assert decoded("Größe".encode("utf-16")) == "Größe"
    with pytest.raises(ValueError, match="not text"):
        decoded(b"PK\x00\x01")


def test_time_stamps_become_a_column(tmp_path):
    path = tmp_path / "log.tsv"
    path.write_text("time_s\tx\n2025-03-01 12:00:00.000\t1\n2025-03-01 12:00:00.004\t2\n", encoding="utf-8")
    assert np.diff(read_table(path).column("time_s")) == pytest.approx([0.004])


@pytest.mark.parametrize("unit", ["Nm", "N\u00b7m", "N\u22c5m", "[N m]", "nm"])
def test_spellings_of_a_unit(tmp_path, unit):
    path = tmp_path / "log.csv"
    path.write_text(f"time_s,q1_torque_nm\ns,{unit}\n0,1\n1,2\n", encoding="utf-8")
    assert read_table(path).column("q1_torque_nm").tolist() == [1.0, 2.0]


def test_units_of_columns_that_nobody_asks_for_do_not_matter(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,temp_a\ns,\u00b0C\n0,1\n1,2\n", encoding="utf-8")
    table = read_table(path)
    assert table.column("time_s").tolist() == [0.0, 1.0]
    with pytest.raises(InputError, match=r"temp_a: the row of units says '\u00b0C'; allowed: A"):
        table.column("temp_a")
