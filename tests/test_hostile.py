"""Hostile and unlucky input through the door and through the commands: one sentence each, and nothing written."""

import json
import math
import os

import numpy as np
import pytest

import robojoule as rj
from robojoule.calibration.log import MeasuredLog
from robojoule.calibration.run_table import MeasuredRuns
from robojoule.cli import main
from robojoule.errors import InputError
from robojoule.programs.operation_tree import tree_from_configurations
from robojoule.robots import catalog_path
from robojoule.year import Operation

NAME = "kuka_kr16_r2010_2"
ROBOT = rj.load_robot(NAME, payload_kg=10)
HOME, THERE = [0, -90, 90, 0, 0, 0], [30, -80, 90, 0, 0, 0]
PROGRAM = rj.Program(tree_from_configurations("pick", np.radians([HOME, THERE, HOME])))
STILL = rj.Program(tree_from_configurations("still", np.radians([HOME, HOME, HOME])))
NO_FILE = [None, 5, True, b"x", [], {}, ROBOT, PROGRAM, np.zeros(3), "", "\0", "\ud800.yaml", ".", 10**5000, math.nan]
NO_FILE += [object(), "~/x.yaml", "no/such/x.yaml", "x" * 5000 + ".yaml", "/dev/zero", "folder.yaml", "folder.csv"]
NO_NUMBER = ["x", "", "\uff11", b"1", True, [], {}, math.nan, math.inf, -math.inf, -1, 10**400, 1e300, ROBOT, object()]
NO_FLAG = [None, "no", "false", "", 0, 1, [], np.zeros(3), ROBOT]
NO_JOINTS = [
    *(None, 5, "home", b"x", [], {}, ROBOT, PROGRAM, [0] * 5, [True, *HOME[1:]], ["0"] * 6, [[1] * 6]),
    *([[1], [2, 3]], [math.nan] * 6, [math.inf] * 6, [1e308] * 6, [10**400] * 6, [1j] * 6, [None] * 6),
]
LOG = MeasuredLog("log.csv", np.zeros(1), np.zeros((1, 6)), np.zeros(1))
PLAN = rj.optimize(PROGRAM, ROBOT, cycle_time="+20%")
ONES = np.ones(3)
NO_RUNS = [
    MeasuredRuns("runs", np.array(motion), limits, seconds, energy, 0.01)
    for motion, limits, seconds, energy in (
        ([0, 1, 7], ONES, ONES, ONES),
        ([0, 1, -1], ONES, ONES, ONES),
        ([0.0, 1.0, 0.5], ONES, ONES, ONES),
        ([0, 1], ONES, ONES, ONES),
        ([], [], [], []),
        ([0, 1, 0], 2.0 * ONES, ONES, ONES),
        ([0, 1, 0], ONES, -ONES, ONES),
        ([0, 1, 0], ONES, ONES * np.nan, ONES),
        ([0, 1, 0], ONES, ONES, ONES * np.inf),
    )
]
# what is tried, and values that it refuses; lengths and torque constants are checked first, by name
CALLS = {
    "load_robot": (rj.load_robot, NO_FILE),
    "drive file": (lambda value: rj.load_robot(NAME, drives=value), NO_FILE[1:]),
    "load_program": (rj.load_program, NO_FILE),
    "save": (PROGRAM.save, NO_FILE),
    "log": (lambda value: rj.identify(value, ROBOT), NO_FILE),
    "program": (lambda value: rj.simulate(value, ROBOT), [value for value in NO_FILE if value is not PROGRAM]),
    "robot": (lambda value: rj.simulate(PROGRAM, value), [value for value in NO_FILE if value is not ROBOT]),
    "Program": (rj.Program, NO_FILE),
    "path of a Program": (lambda value: rj.Program(PROGRAM.tree, value), [5, b"x", [], "", "\0", PROGRAM]),
    "Robot": (rj.Robot, NO_FILE),
    "payload of a Robot": (lambda value: rj.Robot(ROBOT.file, value), NO_FILE[1:]),
    "payload_kg": (lambda value: rj.load_robot(NAME, payload_kg=value), NO_NUMBER),
    "mass": (rj.Payload, [value for value in NO_NUMBER if value != 1e300]),
    "cycle time": (lambda value: rj.optimize(PROGRAM, ROBOT, cycle_time=value), [*NO_NUMBER, None, 1e9, "+1e308%"]),
    "torque_constants": (lambda value: rj.identify(LOG, ROBOT, torque_constants=value), [*NO_NUMBER, *NO_JOINTS[1:]]),
    "window_s": (lambda value: rj.identify(LOG, ROBOT, window_s=value), [*NO_NUMBER, 0, 1e-300, 1.5]),
    "smoothing_s": (lambda value: rj.identify(LOG, ROBOT, smoothing_s=value), [*NO_NUMBER, 0, 1e-300, 1.5]),
    "points": (lambda value: rj.energy_profile(ROBOT, HOME, THERE, degrees=True, points=value), [*NO_NUMBER, 2.5]),
    "start": (lambda value: rj.energy_profile(ROBOT, value, HOME, degrees=True), NO_JOINTS),
    "end [rad]": (lambda value: rj.energy_profile(ROBOT, np.radians(HOME), value), NO_JOINTS),
    "centre of mass": (lambda value: rj.Payload(1.0, value), [*NO_JOINTS, [1e308, 0, 0], [0, 0]]),
    "allow_faster": (lambda value: rj.optimize(PROGRAM, ROBOT, cycle_time="+5%", allow_faster=value), NO_FLAG),
    "cautious": (lambda value: rj.optimize(PROGRAM, ROBOT, cycle_time="+5%", cautious=value), NO_FLAG),
    "allow_faster of pareto": (lambda value: rj.pareto(PROGRAM, ROBOT, allow_faster=value), NO_FLAG),
    "degrees": (lambda value: rj.energy_profile(ROBOT, HOME, THERE, degrees=value), NO_FLAG),
    "profiles": (lambda value: rj.pareto(PROGRAM, ROBOT, profiles=value), [*NO_FLAG[1:], "meassured"]),
    "angles": (PROGRAM.counted_as, NO_FLAG),
    "model": (lambda value: rj.optimize(PROGRAM, ROBOT, cycle_time="+5%", model=value), [5, True, b"x", [], {}, "\0"]),
    "model of a profile": (lambda value: rj.energy_profile(ROBOT, HOME, THERE, degrees=True, model=value), [5, [], ""]),
    "country": (lambda value: Operation.of(country=value), [None, 5, True, ["DEU"], {}, "", "XXX"]),
    "plan of a report": (lambda value: rj.report(value, PROGRAM, ROBOT), NO_FILE),
    "operation": (lambda value: rj.report(PLAN, PROGRAM, ROBOT, operation=value), [5, True, "", [], {}, PLAN]),
    "trade_off": (lambda value: rj.report(PLAN, PROGRAM, ROBOT, trade_off=value), [5, True, "", [], {}, PLAN]),
    "given": (lambda value: rj.adjust(PROGRAM, ROBOT, measured_cycle=4, cycle_time=5, given=value), NO_FILE[1:7]),
    "runs": (lambda value: rj.optimize(PROGRAM, ROBOT, cycle_time="+5%", runs=value), [*NO_FILE[1:], *NO_RUNS]),
    "inertia": (lambda value: rj.Payload(1.0, inertia_kg_m2=value), [*NO_JOINTS[1:], -np.eye(3), 1e300 * np.eye(3)]),
}


def one_sentence(text: str) -> bool:
    return 0 < len(text) < 300 and text.isprintable()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, which must be left as it was."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "folder.csv").mkdir()
    return tmp_path


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", CALLS)
def test_values_that_the_door_refuses(folder, name):
    call, values = CALLS[name]
    before = sorted(folder.iterdir())
    for value in values:
        with pytest.raises(InputError) as caught:
            call(value)
        assert one_sentence(str(caught.value)), value
        assert not name.endswith(("_s", "_constants")) or str(caught.value).startswith(f"{name}: "), value
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("name", ["name", "payload", "drives", "lower_rad"])
def test_robots_cannot_be_changed(name):
    with pytest.raises(AttributeError):
        setattr(ROBOT, name, getattr(ROBOT, name))
    with pytest.raises(ValueError, match="read-only"):
        ROBOT.lower_rad[0] = 0.0


@pytest.mark.parametrize("call", [rj.pareto, lambda *given: rj.optimize(*given, cycle_time="+10%")])
def test_a_program_that_goes_nowhere_has_nothing_to_plan(call):
    with pytest.raises(InputError, match="there is no motion: all positions of the program are the same"):
        call(STILL, ROBOT)


def tree(**changes) -> str:
    """The text of a program with changes of its first move."""
    moves = [{"type": "move", "name": name, "target_deg": at} for name, at in (("go", THERE), ("back", HOME))]
    moves[0] |= changes
    head = {"format": "robojoule-operation-tree", "version": 1, "name": "t", "start_deg": HOME}
    return json.dumps({**head, "operations": moves})


def nested(left: str, right: str) -> str:
    return left * 100_000 + "1" + right * 100_000


LAUGHS = "a: &a [1,1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"{b}: &{b} [{','.join([f'*{a}'] * 10)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
# name of a program, its content, what is said of it
PROGRAMS = {
    "nested JSON": ("a.json", nested("[", "]"), "a.json: lists and mappings are nested more than 64 deep"),
    "nested objects": ("a.json", nested('{"a":', "}"), "nested more than 64 deep"),
    "nested YAML": ("a.yaml", nested("[", "]"), "a.yaml: lists and mappings are nested more than 64 deep"),
    "YAML in itself": ("a.yaml", "&a [*a]\n", "nested more than 64 deep"),
    "values without end": ("a.yaml", LAUGHS, "a.yaml: the file holds too many values"),
    "list as key": ("a.yaml", "? [a]\n: b\n", "a list or a mapping is not a key (line 1)"),
    "long integer": ("a.json", f'{{"a": {"1" * 5001}}}', "a.json: a number has too many digits"),
    "long integer in YAML": ("a.yaml", f"a: {'1' * 5001}", "a.yaml: a number has too many digits"),
    "date": ("a.yaml", "a: 2020-99-99\n", "or a date does not exist"),
    "Latin-1": ("a.yaml", "name: Gr\xfc\xdfe".encode("latin-1"), "a.yaml: the file is not UTF-8 text"),
    "UTF-16": ("a.json", tree().encode("utf-16"), "a.json: the file is UTF-16, not UTF-8 text"),
    "UTF-16 table": ("a.csv", "q1_deg\n0\n1\n".encode("utf-16"), "a.csv: the file is UTF-16"),
    "zeros": ("a.json", b"\0" * 100, "a.json: the file cannot be read"),
    "surrogate": ("a.json", tree(name="\ud800"), "name: "),
    "control characters": ("a.json", tree(name="\x1b[31m"), "a name holds printable characters only"),
    "wait": ("a.json", tree(wait_after_s=1e300), "a.json, operations.0.wait_after_s: 1e+300 is beyond all bounds"),
    "wait of days": ("a.json", tree(wait_after_s=90_000), "should be less than or equal to 86400 (found 90000)"),
    "waits of days": ("a.json", tree(wait_before_s=80_000, wait_after_s=80_000), "is too long for a cycle"),
    "slow": ("a.json", tree(speed_limit_percent=1e-300), "greater than or equal to 0.01 (found 1e-300)"),
    "integer angles": ("a.json", tree(target_deg=[10**400] * 6), "a number without bounds is beyond all bounds"),
    "angles": ("a.json", tree(target_deg=[1e308] * 6), "1e+308 is beyond all bounds"),
    "key in degrees": ("a.json", tree(target_deg=[0, 170, 0, 0, 0, 0]), "operations.0.target_deg: move 'go': joint_2"),
    "one joint": ("a.csv", "q1_deg\n0\n1\n", f"1 joint position given, but {NAME} has 6 joints"),
    "digits of other scripts": (
        "a.csv",
        "q1_deg\n0\n\uff11\n",
        "a.csv, line 3, column q1_deg: '\uff11' is not a number",
    ),
    "wait in a table": ("a.csv", "q1_deg,wait_after_s\n0,\n1,1e9\n", "line 3, column wait_after_s: 1e+09 is not a"),
    "long wait in a table": (
        "a.csv",
        "q1_deg,wait_after_s\n0,\n1,1e300\n",
        "wait_after_s: 1e+300 is beyond all bounds",
    ),
    "folder": ("folder.yaml", None, "folder.yaml: this is a folder, not a file"),
    "still": ("a.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n" + "0,-90,90,0,0,0\n" * 3, "there is no motion"),
}


@pytest.mark.parametrize("name, content, message", PROGRAMS.values(), ids=PROGRAMS.keys())
def test_programs_that_are_refused(folder, capsys, name, content, message):
    if content is not None:
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    before = sorted(folder.iterdir())
    assert main(["optimize", name, "--robot", NAME, "--cycle-time", "+10%", "--out", "out.yaml"]) == 2
    shown = capsys.readouterr()
    assert message in shown.err
    assert one_sentence(shown.err.removesuffix("\n")) and not shown.out
    assert sorted(folder.iterdir()) == before


def test_editors_that_mark_their_files_are_understood(folder, capsys):
    (folder / "a.json").write_bytes(b"\xef\xbb\xbf" + tree().encode())
    (folder / "a.csv").write_bytes(
        b"\xef\xbb\xbfq1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\r\n0,-90,90,0,0,0\r\n9,-90,90,0,0,0\r\n"
    )
    for name in ("a.json", "a.csv"):
        assert main(["optimize", name, "--robot", NAME, "--cycle-time", "+10%", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["cycle_time_s"] > 0.0


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this platform has no named pipes")
def test_a_pipe_is_not_waited_for(folder, capsys):
    os.mkfifo(folder / "pipe.yaml")
    os.mkfifo(folder / "pipe.csv")
    for words in (["pareto", "pipe.yaml"], ["pareto", "pipe.csv"], ["identify", "pipe.csv"]):
        assert main([*words, "--robot", NAME]) == 2
        assert "this is a pipe or a device, not a file" in capsys.readouterr().err


def test_a_file_of_gigabytes_is_not_read(folder, capsys):
    with (folder / "a.yaml").open("wb") as file:
        file.truncate(5 * 2**30)  # no byte of it is on the disk
    assert main(["pareto", "a.yaml", "--robot", NAME]) == 2
    assert "a.yaml: the file is too large; allowed: 4 MB" in capsys.readouterr().err


PROFILE = ["profile", "--robot", NAME, "--from", "0,-90,90,0,0,0", "--to", "30,-80,90,0,0,0"]
OPTIMIZE = ["optimize", "ok.json", "--robot", NAME, "--cycle-time"]
PARETO = ["pareto", "ok.json", "--robot", NAME]
IDENTIFY = ["identify", "log.csv", "--robot", NAME]
WORDS = {
    "command": (["optimise"], "robojoule: unknown command 'optimise' (did you mean optimize?)"),
    "option": ([*PROFILE, "--foo"], "robojoule profile: unrecognized arguments: --foo"),
    "no value": ([*PROFILE, "--points"], "robojoule profile: --points: expected one argument"),
    "missing": (["optimize"], "robojoule optimize: the following arguments are required: PROGRAM"),
    "robot": ([*PARETO[:2], "--robot", "kuka_kr16_r2010_3"], "(did you mean kuka_kr16_r2010_2"),
    "folder for robot": ([*PARETO[:2], "--robot", "."], "unknown robot '.'"),
    "onto a drive file": ([*IDENTIFY[:3], "a.urdf", "--out", "a.drives.yaml"], "--out: this is the robot itself"),
    "no robot": ([*PARETO[:2], "--robot", ""], "no file can have this name"),
    "points": ([*PROFILE, "--points", "1e2"], "--points: '1e2' is not a whole number"),
    "many points": ([*PROFILE, "--points", "9" * 5000], "is not a whole number"),
    "control characters": ([*PROFILE, "--points", "\x1b\n"], r"--points: '\x1b\n' is not a whole number"),
    "payload": ([*PROFILE, "--payload", "nan"], "--payload: 'nan' is not a finite number"),
    "heavy": ([*PROFILE, "--payload", "1e9"], "is more than"),
    "heavy beyond bounds": ([*PROFILE, "--payload", "1e308"], "--payload: 1e+308 is beyond all bounds"),
    "negative": ([*PROFILE, "--payload", "-1e-3"], "--payload: -0.001 is not a valid payload mass"),
    "centre": ([*PROFILE, "--payload-com", "1e9", "0", "0"], "is not a valid centre of mass"),
    "joints": ([*PROFILE[:4], "\uff11,0,0,0,0,0", *PROFILE[5:]], "is not a list of numbers"),
    "folder to draw": ([*PROFILE, "--plot", "no/x.svg"], "no/x.svg, --plot: there is no folder 'no'"),
    "home": ([*PROFILE, "--plot", "~/x.svg"], "there is no folder '~'"),
    "year": ([*OPTIMIZE, "1e9"], "--cycle-time: '1e9', which is 1e+09 s, is too long for a cycle"),
    "share": ([*OPTIMIZE, "+1e308%"], "is too long for a cycle; allowed: at most 86400 s"),
    "full width": ([*OPTIMIZE, "+\uff11\uff10%"], "is not a valid cycle time"),
    "negative time": ([*OPTIMIZE, "-5%"], "--cycle-time: '-5%' is not a valid cycle time"),
    "onto a folder": ([*OPTIMIZE, "4", "--out", "folder.yaml"], "folder.yaml, --out: this is a folder"),
    "long name": ([*OPTIMIZE, "4", "--out", "x" * 300 + ".yaml"], "the file cannot be written"),
    "table onto a program": ([*PARETO, "--csv", "ok.json"], "--csv: unknown file type '.json'; allowed: .csv"),
    "second is a folder": ([*PARETO, "--csv", "c.csv", "--plot", "folder.svg"], "folder.svg, --plot: this is a folder"),
    "onto the robot": (["pareto", "a.csv", "--robot", "b.csv", "--csv", "b.csv"], "--csv: this is the robot itself"),
    "onto a table": (["pareto", "a.csv", "--robot", NAME, "--csv", "a.csv"], "--csv: this is the program itself"),
    "twice": ([*IDENTIFY, "--out", "o.json", "--plot", "folder.svg"], "folder.svg, --plot: this is a folder"),
    "window": ([*IDENTIFY, "--window", "x"], "--window: 'x' is not a number"),
    "constants": ([*IDENTIFY, "--torque-constants", "1,2"], "[1.0, 2.0] are not valid torque constants"),
    "no name": ([*IDENTIFY, "--name", " "], "--name: a robot needs a name"),
}


@pytest.mark.parametrize("words, message", WORDS.values(), ids=WORDS.keys())
def test_commands_that_are_refused(folder, capsys, words, message):
    (folder / "ok.json").write_text(tree(), encoding="utf-8")
    (folder / "folder.svg").mkdir()
    before = sorted(folder.iterdir())
    assert main(words) == 2
    shown = capsys.readouterr()
    assert message in shown.err
    assert one_sentence(shown.err.removesuffix("\n")) and not shown.out
    assert sorted(folder.iterdir()) == before
    assert (folder / "ok.json").read_text(encoding="utf-8") == tree()


def test_a_minus_sign_may_come_first(capsys):
    words = [*PROFILE[:4], "-10,-90,90,0,0,0", "--to", "-.5,-80,90,0,0,0", "--payload-com", "-1e-3", "0", "0"]
    assert main([*words, "--points", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["robot"] == NAME


def robot_file(folder, **drives) -> str:
    """A robot like the catalog's with other drives; figures of joints are those of every joint."""
    data = json.loads(catalog_path(NAME).read_text(encoding="utf-8"))
    for name, value in drives.items():
        for place in (data["drives"],) if name in data["drives"] else data["drives"]["joints"].values():
            place[name] = value
    (folder / "arm.json").write_text(json.dumps(data), encoding="utf-8")
    return "arm.json"


def test_a_robot_without_losses_has_finite_results(folder, capsys):
    nothing = ("base_power_w", "drive_active_power_w", "coulomb_nm", "viscous_nm_s_per_rad", "copper_w_per_nm2")
    robot = robot_file(folder, **dict.fromkeys(nothing, 0.0), inverter_efficiency=1.0, regeneration_efficiency=1.0)
    (folder / "ok.json").write_text(tree(), encoding="utf-8")
    for words in (["optimize", "ok.json", "--cycle-time", "+10%"], ["pareto", "ok.json"], ["profile", *PROFILE[3:]]):
        assert main([*words, "--robot", robot, "--json"]) == 0
        json.loads(capsys.readouterr().out, parse_constant=pytest.fail)  # NaN or Infinity


@pytest.mark.parametrize(
    "drives, message",
    [
        ({"base_power_w": 1e308}, "arm.json, drives.base_power_w: 1e+308 is beyond all bounds"),
        ({"gear_ratio": 1e-300}, "drives.joints.joint_1.gear_ratio: input should be greater than or equal to"),
        ({"inverter_efficiency": 1e-320}, "drives.inverter_efficiency: input should be greater than or equal to"),
    ],
)
def test_a_robot_of_absurd_figures_is_refused(folder, capsys, drives, message):
    assert main(["profile", "--robot", robot_file(folder, **drives), *PROFILE[3:]]) == 2
    assert message in capsys.readouterr().err
