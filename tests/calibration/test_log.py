import re

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import csv

from robojoule.calibration.log import read_log
from robojoule.calibration.log_table import read_table
from robojoule.errors import InputError
from robojoule.robots import load_robot
from tests.calibration.plant import ROBOT

N = 400


@pytest.fixture(scope="module")
def robot():
    return load_robot(ROBOT)


def columns(**changes):
    """A small, plausible log; a change of None removes a column."""
    time = np.arange(N) * 0.004
    table = {"time_s": time}
    home = load_robot(ROBOT).home_rad
    for joint in range(6):
        table[f"q{joint + 1}_rad"] = home[joint] + 0.2 * np.sin(2.0 * time + joint)
    table["power_w"] = 500.0 + 100.0 * np.sin(time)
    for name, values in changes.items():
        if values is None:
            del table[name]
        else:
            table[name] = values
    return table


def save(tmp_path, table, suffix=".csv"):
    path = tmp_path / f"log{suffix}"
    if suffix == ".csv":
        csv.write_csv(pa.table(table), path)
    else:
        pq.write_table(pa.table(table), path)
    return path


def with_degrees(names):
    table = columns()
    for joint in range(1, 7):
        table[f"q{joint}_{names}"] = np.degrees(table.pop(f"q{joint}_rad"))
    return table


def cell(name, row, value):
    table = columns()
    table[name] = table[name].copy()
    table[name][row] = value
    return table


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_reads_radians_and_degrees_alike(tmp_path, robot, suffix):
    radians = read_log(save(tmp_path, columns(note=["x"] * N), suffix), robot)
    degrees = read_log(save(tmp_path, with_degrees("deg"), suffix), robot)
    assert radians.position_rad.shape == (N, 6)
    np.testing.assert_allclose(degrees.position_rad, radians.position_rad, atol=1e-12)
    assert radians.velocity_rad_s is None
    assert radians.torque_nm is None


def test_currents_become_link_side_torques(tmp_path, robot):
    currents = {f"q{joint}_current_a": np.full(N, 2.0) for joint in range(1, 7)}
    path = save(tmp_path, columns(**currents))
    log = read_log(path, robot, [0.5] * 6)
    np.testing.assert_allclose(log.torque_nm, np.tile(robot.drives.gear_ratio, (N, 1)))
    with pytest.raises(InputError, match="torque constants"):
        read_log(path, robot)
    with pytest.raises(InputError, match=r"are not valid torque constants; allowed: 6 numbers"):
        read_log(path, robot, [0.5] * 5)


def test_irregular_time_stamps_are_fine(tmp_path, robot):
    time = np.arange(N) * 0.004 + np.random.default_rng(0).uniform(0.0, 0.0039, N)
    np.testing.assert_array_equal(read_log(save(tmp_path, columns(time_s=time), ".parquet"), robot).time_s, time)


TIME = np.arange(N) * 0.004
GAP = np.where(np.arange(N) < 200, TIME, TIME + 0.5)
CASES = {
    "no time": (columns(time_s=None), "time_s: this column is missing"),
    "no power": (columns(power_w=None), "power_w: this column is missing"),
    "no positions": (columns(**{f"q{j}_rad": None for j in range(1, 7)}), "q1_rad: this column is missing"),
    "one joint missing": (columns(q4_rad=None), "q4_rad: this column is missing (the other joints have theirs)"),
    "a joint too many": (columns(q7_rad=TIME), "q7_rad: the robot has 6 joints only"),
    "unknown quantity": (columns(q1_velocity_deg_s=TIME), "q1_velocity_deg_s: unknown joint column"),
    "both units": (columns(**{f"q{j}_deg": TIME for j in range(1, 7)}), "in radians and in degrees"),
    "not a number": (cell("power_w", 7, np.nan), "power_w: row 8 is empty or not a finite number"),
    "text": (columns(power_w=["many"] * N), "power_w: row 1 holds 'many', which is not a number"),
    "time falls": (cell("time_s", 9, 0.0), "time_s: time falls at row 10"),
    "gap": (columns(time_s=GAP), "gap of 0.504 s after row 200 (t = 0.7960 s)"),
    "too coarse": (columns(time_s=10.0 * TIME), "the samples are 0.04 s apart"),
    "milliseconds": (columns(time_s=1000.0 * TIME), "looks like milliseconds"),
    "a clock of 1 s": (
        columns(time_s=np.floor(TIME)),
        "time_s: the clock's step of 1 s is too long: some 250 rows have one instant; allowed: at most 0.02 s",
    ),
    "a clock of 0.1 s": (columns(time_s=0.1 * np.floor(10.0 * TIME)), "the clock's step of 0.1 s is too long: some 25"),
    "degrees as radians": (with_degrees("rad"), "the columns look like degrees (name them q1_deg ..)"),
    "beyond a limit": (cell("q2_rad", 30, 1.4), "row 31: 1.4 rad is beyond the limits of joint_2"),
    "a jump": (cell("q1_rad", 30, 3.0), "the limit of joint_1; are time and positions in the units"),
    "velocity in deg/s": (
        columns(**{f"q{j}_velocity_rad_s": np.full(N, 90.0) for j in range(1, 7)}),
        "q2_velocity_rad_s: the velocity reaches",
    ),
    "negative payload": (columns(payload_kg=np.full(N, -1.0)), "payload_kg: a payload is negative"),
    "payload above the rated one": (
        columns(payload_kg=np.full(N, 20.0)),
        "payload_kg: a payload of 20 kg is more than kuka_kr16_r2010_2 is rated for; allowed: 0 to 16 kg",
    ),
    "standing": (
        columns(**{f"q{j}_rad": np.full(N, load_robot(ROBOT).home_rad[j - 1]) for j in range(1, 7)}),
        "no joint moves by more than 0.05 rad",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_logs_are_refused_with_file_and_place(tmp_path, robot, case):
    table, message = CASES[case]
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        read_log(save(tmp_path, table), robot)
    assert "log.csv" in str(caught.value)


def test_radians_as_degrees_are_noticed(tmp_path, robot):
    table = columns()
    for joint in range(1, 7):
        table[f"q{joint}_deg"] = table.pop(f"q{joint}_rad")
    with pytest.raises(InputError, match="the columns look like radians"):
        read_log(save(tmp_path, table), robot)


def test_unreadable_files(tmp_path, robot):
    with pytest.raises(InputError, match="there is no such file"):
        read_log(tmp_path / "none.csv", robot)
    with pytest.raises(InputError, match=r"unknown file type '.xls'; allowed: .csv, .tsv, .txt, .csv.gz"):
        read_log(tmp_path / "log.xls", robot)
    whole = save(tmp_path, columns(), ".parquet").read_bytes()
    (tmp_path / "cut.parquet").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"cut.parquet: the table cannot be read"):
        read_log(tmp_path / "cut.parquet", robot)
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(InputError, match="the table cannot be read"):
        read_log(tmp_path / "empty.csv", robot)
    (tmp_path / "header.csv").write_text("time_s,power_w\n")
    with pytest.raises(InputError, match="the table has no rows"):
        read_log(tmp_path / "header.csv", robot)
    (tmp_path / "doubled.csv").write_text("time_s,power_w,power_w\n0,1,2\n")
    with pytest.raises(InputError, match="power_w: this column appears twice"):
        read_log(tmp_path / "doubled.csv", robot)


def test_csv_files_of_spreadsheets_are_read(tmp_path, robot):
    """A byte order mark, quoted names, blank lines and Windows line ends."""
    path = save(tmp_path, columns())
    lines = path.read_text().splitlines()
    text = "\r\n".join(["\ufeff" + lines[0], *lines[1:200], "", *lines[200:], "", ""])
    (tmp_path / "sheet.csv").write_bytes(text.encode())
    np.testing.assert_array_equal(read_log(tmp_path / "sheet.csv", robot).power_w, read_log(path, robot).power_w)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (lambda cells: cells[:-1], "row 4 has 7 cells, the header 8"),
        (lambda cells: [*cells, "1.0"], "row 4 has 9 cells, the header 8"),
        (lambda cells: [*cells[:-1], ""], "power_w: row 4 is empty or not a finite number"),
        (lambda cells: [*cells[:-1], "5OO"], "power_w: row 4 holds '5OO', which is not a number"),
    ],
    ids=["a cell too few", "a cell too many", "an empty cell", "a slip of the pen"],
)
def test_damaged_rows_are_refused(tmp_path, robot, line, message):
    path = save(tmp_path, columns())
    lines = path.read_text().splitlines()
    lines[4] = ",".join(line(lines[4].split(",")))
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=re.escape(message)):
        read_log(path, robot)


def test_parquet_columns_must_be_numbers(tmp_path, robot):
    with pytest.raises(InputError, match="power_w: the column holds string, not numbers"):
        read_log(save(tmp_path, columns(power_w=["many"] * N), ".parquet"), robot)


def test_parquet_that_unpacks_without_end_is_refused(tmp_path, robot):
    """Rows that repeat take no space in the file."""
    path = tmp_path / "log.parquet"
    zeros = pa.chunked_array([pa.array(np.zeros(2**20))] * 257)
    pq.write_table(pa.table({"time_s": zeros}), path, compression="zstd")
    assert path.stat().st_size < 5_000_000
    with pytest.raises(InputError, match=r"cannot be read \(it holds 269484032 rows, more than 2048 MB"):
        read_log(path, robot)


def test_a_long_text_in_every_row_is_read_once(tmp_path):
    """Columns of texts that repeat: a gigabyte, were each row's copied."""
    rows = 10_000
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table({"time_s": np.arange(float(rows)), "note": ["x" * 100_000] * rows}), path)
    assert path.stat().st_size < 1_000_000
    before = pa.total_allocated_bytes()
    table = read_table(path)
    assert len(table.column("time_s")) == rows and pa.total_allocated_bytes() - before < 10_000_000


@pytest.mark.parametrize(
    ("time", "message"),
    [
        (np.where(np.arange(N) == 60, 0.1, TIME), "time falls at row 66"),
        (GAP, "gap of 0.504 s after row 205 (t = 0.7960 s)"),
    ],
)
def test_rows_in_messages_are_those_of_the_file_where_packets_came_twice(tmp_path, robot, time, message):
    twice = np.sort(np.append(np.arange(N), [20] * 5))
    table = {name: np.asarray(values)[twice] for name, values in columns(time_s=time).items()}
    with pytest.raises(InputError, match=re.escape(message)):
        read_log(save(tmp_path, table), robot)


def test_a_clock_coarser_than_the_samples_is_told_and_doubled_packets_are_not(tmp_path, robot):
    coarse = read_log(save(tmp_path, columns(time_s=0.01 * np.floor(TIME / 0.01 + 1e-9))), robot)
    assert coarse.clock_step_s == pytest.approx(0.01)
    (warning,) = coarse.clock_warnings
    assert warning.startswith("the clock's step of 10 ms is longer than that of the samples")
    doubled = {name: np.repeat(values, 2) for name, values in columns().items()}
    for fine in (columns(), doubled):
        assert read_log(save(tmp_path, fine), robot).clock_warnings == ()
