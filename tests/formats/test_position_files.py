"""CSV files of joint positions: what they mean, and where exactly a bad one is wrong."""

import numpy as np
import pytest

from robojoule.errors import InputError
from robojoule.formats.program import Program, load_program
from robojoule.formats.tree_files import parse_tree
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots import load_robot

GOOD = """\
name,q1_deg,q2_deg,speed_limit_percent,wait_before_s,wait_after_s
,0,-90,,,
pick,45,-60.5,50,0.25,
"place, left", 0 ,-9e1,,,1.5
"""
COLUMNS = (
    "allowed: q1_deg .. or q1_rad .., name, robot, angles, speed_limit_percent, least_speed_percent, fixed, "
    "[added_]wait_before_s, [added_]wait_after_s"
)


def read(tmp_path, text, name="cycle.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_program(path)


def test_rows_become_fine_moves(tmp_path):
    program = read(tmp_path, GOOD)
    assert (program.name, program.robot, program.format) == ("cycle", None, "joint positions")
    expected = np.radians([[0, -90], [45, -60.5], [0, -90]])
    np.testing.assert_allclose(program.tree.configurations_rad(), expected, rtol=1e-15)
    found = [(m.name, m.speed_limit_percent, m.wait_before_s, m.wait_after_s, m.is_fine) for m in program.moves]
    assert found == [("pick", 50.0, 0.25, 0.0, True), ("place, left", 100.0, 0.0, 1.5, True)]


def test_positions_alone_are_enough(tmp_path):
    program = read(tmp_path, "q2_rad,q1_rad\n\n1,0\n1.5,0.5\n,\n")
    assert program.tree.configurations_rad().tolist() == [[0, 1], [0.5, 1.5]]
    assert [move.name for move in program.moves] == ["move-1"]


def test_what_spreadsheets_put_in_is_no_obstacle(tmp_path):
    """A byte order mark and Windows line ends."""
    program = read(tmp_path, b"\xef\xbb\xbfq1_deg,q2_deg\r\n0,0\r\n90,0\r\n")
    assert program.tree.configurations_rad()[1].tolist() == [np.pi / 2, 0.0]


# text of the file, message after its name
BAD = {
    "empty": ("", f": the file is empty; {COLUMNS}"),
    "header alone": ("q1_deg\n", ": there is no move: the first row is the start of the cycle"),
    "start alone": ("q1_deg\n0\n", ": there is no move: the first row is the start of the cycle"),
    "semicolons": (
        "q1_deg;q2_deg\n0;0\n1;1\n",
        ", line 1: the columns are not separated by commas; allowed: commas, and decimal points in numbers",
    ),
    "unknown column": ("q1_deg,speed\n0,1\n", f", line 1, column speed: unknown column; {COLUMNS}"),
    "joint zero": ("q0_deg,q1_deg\n0,1\n", f", line 1, column q0_deg: unknown column; {COLUMNS}"),
    "nameless column": ("q1_deg,\n0,\n", f", line 1: a column has no name; {COLUMNS}"),
    "doubled column": ("\nq1_deg,q1_deg\n0,1\n", ", line 2, column q1_deg: the column appears twice"),
    "both units": (
        "q1_deg,q2_rad\n0,1\n",
        ", line 1, column q2_rad: positions are given in degrees and in radians; allowed: one unit for all joints",
    ),
    "missing joint": ("q1_rad,q3_rad\n0,1\n", ", line 1, column q2_rad: the column is missing"),
    "no joint": ("name\na\n", f", line 1: there are no joint positions; {COLUMNS}"),
    "short row": ("q1_deg,q2_deg\n0,0\n\n1\n", ", line 4: the header names 2 columns, but the row has 1"),
    "decimal comma": (
        'q1_deg,q2_deg\n0,0\n"1,5",0\n',
        ", line 3, column q1_deg: '1,5' is not a number; allowed: digits with a decimal point",
    ),
    "word": ("q1_deg\n0\nhome\n", ", line 3, column q1_deg: 'home' is not a number; allowed: digits with a"),
    "digit groups": ("q1_deg\n0\n1_0\n", ", line 3, column q1_deg: '1_0' is not a number"),
    "empty cell": ("q1_deg,q2_deg\n0,0\n1,\n", ", line 3, column q2_deg: the cell is empty; allowed: a number"),
    "nan": ("q1_deg\n0\nnan\n", ", line 3, column q1_deg: 'nan' is not a finite number"),
    "infinite": ("q1_deg\n0\n1e999\n", ", line 3, column q1_deg: '1e999' is not a finite number"),
    "speed": (
        "q1_deg,speed_limit_percent\n0,\n1,101\n",
        ", line 3, column speed_limit_percent: 101 is not a valid speed limit; allowed: 0.01 to 100",
    ),
    "no speed": ("q1_deg,speed_limit_percent\n0,\n1,0\n", ", line 3, column speed_limit_percent: 0 is not a valid"),
    "wait": ("q1_deg,wait_after_s\n0,\n1,-1\n", ", line 3, column wait_after_s: -1 is not a valid wait; allowed: 0 to"),
    "wait at the start": (
        "q1_deg,wait_after_s\n0,2\n1,0\n",
        ", line 2, column wait_after_s: the first row is the start of the cycle, not a move; allowed: an empty cell",
    ),
    "robot of a move": (
        "q1_deg,robot\n0,\n1,ur_ur10e\n",
        ", line 3, column robot: the robot is named in the first row alone; allowed: an empty cell",
    ),
    "endless robot": ("q1_deg,robot\n0," + "a" * 201 + "\n1,\n", ": String should have at most 200 characters"),
    "nameless move": ("q1_deg,name\n0,\n1,\n", ", line 3, column name: the move has no name; allowed: a name in every"),
    "doubled name": (
        "q1_deg,name\n0,a\n1,a\n2,a\n",
        ", line 4, column name: the name 'a' is already used in line 3",
    ),
    "endless name": ("q1_deg,name\n0,\n1," + "a" * 201 + "\n", ": String should have at most 200 characters"),
    "open quote": ('q1_deg\n0\n"1\n', ", line 3: the row cannot be read (unexpected end of data)"),
}


@pytest.mark.parametrize("text, message", BAD.values(), ids=BAD.keys())
def test_a_bad_file_says_where_it_is_wrong(tmp_path, text, message):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path / 'cycle.csv'}{message}")


def test_a_position_beyond_a_limit_names_its_line(tmp_path):
    header = ",".join(f"q{joint}_deg" for joint in range(1, 7))
    program = read(tmp_path, f"{header}\n0,-90,90,0,0,0\n\n0,90,0,0,0,0\n")
    message = r"cycle\.csv, line 4: move 'move-1': joint_2 = 1\.5708 rad \(90 deg\) is beyond its limit"
    with pytest.raises(InputError, match=message):
        program.check(load_robot("kuka_kr16_r2010_2"))


def test_another_robot_is_refused_with_its_place(tmp_path):
    program = read(tmp_path, "q1_deg,robot\n\n0,ur_ur10e\n1,\n")
    message = r"cycle\.csv, line 3, column robot: the tree is written for robot 'ur_ur10e', not for 'kuka_kr16_r2010_2'"
    with pytest.raises(InputError, match=message):
        program.check(load_robot("kuka_kr16_r2010_2"))


# in degrees, the robot, the header of the written file
SAVED = {
    "degrees": ([[0.0, -90.0], [45.0, -60.5], [1e-3, 12.3456789]], None, "name,q1_deg,q2_deg,"),
    "a robot": ([[0.0, -90.0], [45.0, -60.5]], "ur_ur10e", "name,q1_deg,q2_deg,"),
    "random": (np.random.default_rng(3).uniform(-180.0, 180.0, (40, 6)).round(4), "ur_ur10e", "name,q1_deg,"),
}


@pytest.mark.parametrize("degrees, robot, header", SAVED.values(), ids=SAVED.keys())
def test_a_saved_program_is_read_as_the_same_one(tmp_path, degrees, robot, header):
    tree = tree_from_configurations("saved", np.radians(degrees), robot)
    tree = tree.with_plan({tree.moves()[0].name: 100.0 / 3.0}, waits_after_s={tree.moves()[-1].name: 0.1 + 0.2})
    path = tmp_path / "saved.csv"
    Program(tree).save(path)
    assert path.read_text().startswith(header)
    assert load_program(path).tree == tree


def test_positions_that_are_no_degrees_are_written_in_radians(tmp_path):
    radians = np.random.default_rng(4).uniform(-3.0, 3.0, (40, 6))
    assert (np.radians(np.degrees(radians)) != radians).any()
    tree = tree_from_configurations("saved", radians)
    Program(tree).save(tmp_path / "saved.csv")
    assert (tmp_path / "saved.csv").read_text().startswith("name,q1_rad,")
    assert load_program(tmp_path / "saved.csv").tree == tree


MOVE = {"type": "move", "name": "a", "target_rad": [1.0]}
# operations of a tree, what is said of them
TOO_RICH = {
    "process": ([MOVE, {"type": "process", "name": "weld", "duration_s": 1.0}], "the process operation 'weld'"),
    "wait": ([{"type": "wait", "name": "part", "duration_s": 1.0}, MOVE], "the wait operation 'part'"),
    "group": ([{"type": "compound", "name": "left", "operations": [MOVE]}], "the compound operation 'left'"),
    "coarse": ([MOVE | {"name": "via", "zone": {"radius_m": 0.1}}, MOVE], "the coarse zone of move 'via'"),
    "ragged": ([MOVE | {"target_rad": [1.0, 2.0]}], "move 'a' has another number of joints than the start"),
}


@pytest.mark.parametrize("operations, message", TOO_RICH.values(), ids=TOO_RICH.keys())
def test_what_rows_cannot_hold_is_refused_not_lost(tmp_path, operations, message):
    data = {
        "format": "robojoule-operation-tree",
        "version": 1,
        "name": "t",
        "start_rad": [0.0],
        "operations": operations,
    }
    with pytest.raises(InputError, match=message):
        Program(parse_tree(data, "t")).save(tmp_path / "out.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "unit, row, written",
    [
        ("rad", "0.5,-1.2,1.4,0,0.5,0", "target_rad: [0.5, -1.2, 1.4, 0.0, 0.5, 0.0]"),
        ("deg", "12.34,-71.7,80.03,0,30,1", "target_deg: [12.34, -71.7, 80.03, 0.0, 30.0, 1.0]"),
    ],
)
def test_a_table_becomes_a_tree_in_its_own_unit(tmp_path, unit, row, written):
    """Not in the other one's sixteen digits."""
    header = ",".join(f"q{joint}_{unit}" for joint in range(1, 7))
    (tmp_path / "a.csv").write_text(f"{header}\n0,0,0,0,0,0\n{row}\n", encoding="utf-8")
    read = load_program(tmp_path / "a.csv")
    read.save(tmp_path / "a.yaml")
    assert written in (tmp_path / "a.yaml").read_text(encoding="utf-8")
    assert load_program(tmp_path / "a.yaml").tree.moves()[0].target_rad == read.tree.moves()[0].target_rad
