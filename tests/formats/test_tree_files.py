import copy
import json

import jsonschema
import pytest
import yaml

from robojoule.errors import InputError
from robojoule.formats.program import load_program
from robojoule.formats.tree_files import (
    SCHEMA_FILE,
    operation_tree_schema,
    parse_tree,
    save_tree,
    tree_to_data,
)
from robojoule.robots import load_robot

PUBLISHED_SCHEMA = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
NAN, INF = float("nan"), float("inf")


@pytest.fixture(scope="module")
def robot():
    return load_robot("kuka_kr16_r2010_2")


def example() -> dict:
    return {
        "format": "robojoule-operation-tree",
        "version": 1,
        "name": "example",
        "robot": "kuka_kr16_r2010_2",
        "start_deg": [0, -90, 90, 0, 0, 0],
        "operations": [
            {"type": "move", "name": "go", "target_deg": [10, -80, 80, 0, 0, 0]},
            {
                "type": "compound",
                "name": "group",
                "operations": [
                    {"type": "move", "name": "via", "target_rad": [0, -1, 1, 0, 0, 0], "zone": {"radius_m": 0.1}},
                    {"type": "move", "name": "stop", "target_rad": [0, -1.2, 1, 0, 0, 0]},
                ],
            },
            {"type": "wait", "name": "pause", "duration_s": 1},
        ],
    }


def edit(*path, value):
    """A change of the example: set the value at a path; "-" as the last part appends."""

    def change(data):
        for part in path[:-1]:
            data = data[part]
        if path[-1] == "-":
            data.append(value)
        else:
            data[path[-1]] = value

    return change


def remove(*path):
    def change(data):
        for part in path[:-1]:
            data = data[part]
        del data[path[-1]]

    return change


def insert(*path, value):
    def change(data):
        for part in path[:-1]:
            data = data[part]
        data.insert(path[-1], value)

    return change


OPS, IN_GROUP = ("operations",), ("operations", 1, "operations")
WAIT = {"type": "wait", "name": "w", "duration_s": 1}
TYPES = "allowed: compound, move, wait, process, payload, unknown"
MOVE_KEYS = (
    "added_wait_after_s, added_wait_before_s, fixed, least_speed_percent, most_speed_percent, name, path, speed_group, "
    "speed_limit_percent, target_deg, target_rad, type, wait_after_s, wait_before_s, zone"
)
ROOT_KEYS = "angles, format, name, operations, planned_cycle_s, robot, start_deg, start_rad, version"


def fitting(key: str, problem: str, allowed: str) -> str:
    """A message that is too long for one, as it is shortened."""
    return str(InputError(problem, file="cell.yaml", key=key, allowed=allowed)).removeprefix("cell.yaml, ")


# id: change, message after the file name, whether the JSON Schema can see it
BAD = {
    "unknown-root-key": (edit("opertions", value=[]), f"opertions: unknown key; allowed: {ROOT_KEYS}", True),
    "unknown-move-key": (
        edit(*OPS, 0, "speed", value=3),
        f"operations.0.speed: operation 'go': unknown key; allowed: {MOVE_KEYS}",
        True,
    ),
    "unknown-nested-key": (
        edit(*IN_GROUP, 1, "x", value=3),
        fitting("operations.1.operations.1.x", "operation 'stop': unknown key", MOVE_KEYS),
        True,
    ),
    "missing-version": (remove("version"), "version: this key is missing", True),
    "other-version": (edit("version", value=2), "version: input should be 1 (found 2)", True),
    "missing-name": (remove(*IN_GROUP, 0, "name"), "operations.1.operations.0.name: this key is missing", True),
    "missing-type": (
        remove(*IN_GROUP, 0, "type"),
        f"operations.1.operations.0.type: operation 'via': this key is missing; {TYPES}",
        True,
    ),
    "unknown-type": (
        edit(*IN_GROUP, 0, "type", value="linear"),
        f"operations.1.operations.0.type: operation 'via': unknown operation type 'linear'; {TYPES}",
        True,
    ),
    "not-an-operation": (
        edit(*OPS, 0, value="go"),
        "operations.0: an operation must be a mapping (found 'go')",
        True,
    ),
    "not-a-list": (edit(*IN_GROUP, value=5), "operations.1.operations: operation 'group': this must be a list", True),
    "duplicate-name": (
        edit(*IN_GROUP, 0, "name", value="go"),
        "operations.1.operations.0.name: the name 'go' is already used at operations.0",
        False,
    ),
    "blank-name": (
        edit(*OPS, 0, "name", value=" "),
        r"operations.0.name: operation ' ': string should match pattern '^\S(.*\S)?$' (found ' ')",
        True,
    ),
    "empty-tree": (edit(*OPS, value=[]), "operations: the list is empty", True),
    "empty-group": (edit(*IN_GROUP, value=[]), "operations.1.operations: operation 'group': the list is empty", True),
    "no-move": (edit(*OPS, value=[WAIT]), "operations: the tree has no move operation", False),
    "nan": (
        edit(*IN_GROUP, 0, "target_rad", 1, value=NAN),
        "operations.1.operations.0.target_rad.1: operation 'via': input should be a finite number (found nan)",
        False,
    ),
    "infinite-degrees": (
        edit(*OPS, 0, "target_deg", 1, value=INF),
        "operations.0.target_deg: operation 'go': this must be a list of finite numbers",
        False,
    ),
    "nan-start": (edit("start_deg", 0, value=NAN), "start_deg: this must be a list of finite numbers", False),
    "nan-wait": (
        edit(*OPS, 2, "duration_s", value=NAN),
        "operations.2.duration_s: operation 'pause': input should be a finite number (found nan)",
        False,
    ),
    "text-as-number": (
        edit(*IN_GROUP, 0, "target_rad", 1, value="1"),
        "operations.1.operations.0.target_rad.1: operation 'via': input should be a valid number (found '1')",
        True,
    ),
    "truth-as-number": (
        edit(*OPS, 0, "speed_limit_percent", value=True),
        "operations.0.speed_limit_percent: operation 'go': input should be a valid number (found True)",
        True,
    ),
    "degrees-and-radians": (
        edit(*OPS, 0, "target_rad", value=[0] * 6),
        "operations.0: operation 'go': exactly one of target_rad and target_deg must be given",
        True,
    ),
    "no-target": (
        remove(*OPS, 0, "target_deg"),
        "operations.0: operation 'go': exactly one of target_rad and target_deg must be given",
        True,
    ),
    "empty-target": (
        edit(*IN_GROUP, 0, "target_rad", value=[]),
        "operations.1.operations.0.target_rad: operation 'via': the list is empty",
        True,
    ),
    "zero-speed": (
        edit(*OPS, 0, "speed_limit_percent", value=0),
        "operations.0.speed_limit_percent: operation 'go': input should be greater than or equal to 0.01 (found 0)",
        True,
    ),
    "too-fast": (
        edit(*OPS, 0, "speed_limit_percent", value=101),
        "operations.0.speed_limit_percent: operation 'go': input should be less than or equal to 100 (found 101)",
        True,
    ),
    "negative-wait": (
        edit(*OPS, 0, "wait_before_s", value=-0.1),
        "operations.0.wait_before_s: operation 'go': input should be greater than or equal to 0 (found -0.1)",
        True,
    ),
    "unknown-zone": (
        edit(*OPS, 0, "zone", value="fin"),
        "operations.0.zone: operation 'go': a zone is either the word fine or a mapping with radius_m or path_share "
        "(found 'fin')",
        True,
    ),
    "unknown-zone-key": (
        edit(*IN_GROUP, 0, "zone", value={"radius_m": 1, "radius_mm": 1}),
        "operations.1.operations.0.zone.radius_mm: operation 'via': unknown key; allowed: radius_m",
        True,
    ),
    "zero-zone": (
        edit(*IN_GROUP, 0, "zone", "radius_m", value=0),
        "operations.1.operations.0.zone.radius_m: operation 'via': input should be greater than 0 (found 0)",
        True,
    ),
    "coarse-at-the-end": (
        edit(*IN_GROUP, 1, "zone", value={"radius_m": 0.1}),
        "operations.1.operations.1.zone: move 'stop' has a coarse zone, so a fine move must come before wait 'pause'",
        False,
    ),
    "coarse-last": (
        edit(*OPS, "-", value={"type": "move", "name": "end", "target_rad": [0] * 6, "zone": {"radius_m": 0.1}}),
        "operations.3.zone: move 'end' has a coarse zone but no fine move after it",
        False,
    ),
    "wait-in-coarse-zone": (
        edit(*IN_GROUP, 0, "wait_after_s", value=1),
        "operations.1.operations.0.zone: move 'via' has a coarse zone, so there can be no wait before 'stop'",
        False,
    ),
    "wait-between-coarse-and-fine": (
        insert(*IN_GROUP, 1, value=WAIT),
        "operations.1.operations.0.zone: move 'via' has a coarse zone, so a fine move must come before wait 'w'",
        False,
    ),
}

# id: change, message after the file name
BAD_FOR_ROBOT = {
    "other-robot": (
        edit("robot", value="ur_ur10e"),
        "robot: the tree is written for robot 'ur_ur10e', not for 'kuka_kr16_r2010_2'",
    ),
    "joint-count": (
        edit(*OPS, 0, "target_deg", value=[0, 0, 0]),
        "operations.0.target_deg: move 'go': 3 joint positions given, but kuka_kr16_r2010_2 has 6 joints",
    ),
    "start-joint-count": (
        edit("start_deg", value=[0] * 7),
        "start_deg: the start: 7 joint positions given, but kuka_kr16_r2010_2 has 6 joints",
    ),
    "beyond-limit": (
        edit(*IN_GROUP, 1, "target_rad", 1, value=2),
        "operations.1.operations.1.target_rad: move 'stop': joint_2 = 2 rad (114.592 deg) is beyond its limit; "
        "allowed: -3.22886 to 1.13446 rad (-185 to 65 deg)",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_tree_gives_one_sentence_with_file_and_key(case):
    change, message, _ = BAD[case]
    data = example()
    change(data)
    with pytest.raises(InputError) as caught:
        parse_tree(data, "cell.yaml")
    assert str(caught.value) == f"cell.yaml, {message}"


@pytest.mark.parametrize("case", BAD)
def test_schema_refuses_what_it_can_see(case):
    change, _, visible = BAD[case]
    data = example()
    change(data)
    assert jsonschema.Draft202012Validator(PUBLISHED_SCHEMA).is_valid(data) != visible


@pytest.mark.parametrize("case", BAD_FOR_ROBOT)
def test_tree_that_does_not_fit_the_robot(case, robot, tmp_path):
    change, message = BAD_FOR_ROBOT[case]
    data = example()
    change(data)
    path = tmp_path / "cell.yaml"
    path.write_text(yaml.safe_dump(data))
    program = load_program(path)  # without a robot nothing is wrong with it
    with pytest.raises(InputError) as caught:
        program.check(robot)
    assert str(caught.value) == f"{path}, {message}"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        pytest.param("a.yaml", "operations: [", "cannot be read", id="truncated-yaml"),
        pytest.param("a.json", '{"format": ', "cannot be read", id="truncated-json"),
        pytest.param("a.yaml", "", "must be a mapping", id="empty-file"),
        pytest.param("a.yaml", "- 1", "must be a mapping", id="a-list"),
        pytest.param("a.yaml", "name: a\nname: b", "key 'name' appears twice", id="doubled-key"),
        pytest.param("a.txt", "", "unknown file type", id="suffix"),
        pytest.param("a.yaml", "format: &a [*a]\n", "a.yaml", id="endless-alias"),
    ],
)
def test_unreadable_file(name, text, message, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=message):
        load_program(tmp_path / name)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_program(tmp_path / "none.yaml")


def test_operations_that_contain_themselves():
    data = example()
    data["operations"][1]["operations"] = data["operations"]
    with pytest.raises(InputError, match="the operations contain themselves"):
        parse_tree(data, "cell.yaml")


@pytest.mark.parametrize("suffix", [".yaml", ".yml", ".json"])
def test_saved_tree_loads_equal(suffix, tmp_path):
    tree = parse_tree(example(), "x").with_plan({"go": 1 / 3 * 100}, waits_after_s={"stop": 0.1 + 0.2})
    path = tmp_path / f"tree{suffix}"
    save_tree(tree, path)
    assert load_program(path).tree == tree
    first = path.read_bytes()
    save_tree(tree, path)
    assert path.read_bytes() == first
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_unknown_suffix_writes_nothing(tmp_path):
    with pytest.raises(InputError, match="unknown file type"):
        save_tree(parse_tree(example(), "x"), tmp_path / "tree.xml")
    assert not list(tmp_path.iterdir())


def test_saved_data_fits_the_schema():
    jsonschema.Draft202012Validator(PUBLISHED_SCHEMA).validate(
        json.loads(json.dumps(tree_to_data(parse_tree(example(), "x"))))
    )


def test_published_schema_is_in_sync_and_valid():
    jsonschema.Draft202012Validator.check_schema(PUBLISHED_SCHEMA)
    assert operation_tree_schema() == PUBLISHED_SCHEMA


def test_parsing_leaves_its_input_alone():
    data = example()
    before = copy.deepcopy(data)
    parse_tree(data, "x")
    assert data == before
