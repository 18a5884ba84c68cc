"""`robojoule optimize`: what it prints and writes, and what it refuses."""

import json
import os
import subprocess
import sys

import pytest

from robojoule.cli import main
from robojoule.cli.optimize import show_year
from robojoule.formats.program import Program, load_program

ROBOT = ["--robot", "kuka_kr16_r2010_2", "--payload", "10"]


def optimized(capsys, *words) -> dict:
    assert main(["optimize", *map(str, words), *ROBOT, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_the_written_program_keeps_the_cycle_time(program, tmp_path, capsys):
    out = tmp_path / "out.yaml"
    result = optimized(capsys, program, "--cycle-time", "+20%", "--out", out)
    assert result["cycle_time_s"] == pytest.approx(1.2 * result["least_cycle_time_s"], abs=1e-3)
    assert result["energy_j"] < result["energy_unoptimized_j"]
    assert result["energy_given_j"] == pytest.approx(result["energy_unoptimized_j"], rel=1e-9)
    assert result["saving_percent"] == pytest.approx(result["saving_over_unoptimized_percent"])
    assert result["saving_percent"] > 5.0
    assert 0.0 <= result["gap_to_optimum_percent"] <= 0.01
    assert result["bound_j"] <= result["energy_j"]
    assert 0.0 < result["peak_torque_ratio"] <= 1.0
    assert result["peak_power_w"] > result["energy_j"] / result["cycle_time_s"]
    assert (result["warnings"], result["payload_kg"], result["out"]) == ([], 10.0, str(out))
    moves = load_program(out).moves
    assert [move.speed_limit_percent for move in moves] == [move["speed_limit_percent"] for move in result["moves"]]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit of file sizes")
def test_program_and_page_are_written_together_or_not_at_all(program, tmp_path):
    """The page does not fit on what stands for a full disk here, a limit of file sizes; the program would."""
    out, page = tmp_path / "out.yaml", tmp_path / "page.html"
    words = ["optimize", str(program), *ROBOT, "--cycle-time", "+20%", "--out", str(out), "--page", str(page)]
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))"
    code = f"import sys; {limit}; from robojoule.cli import main; sys.exit(main(sys.argv[1:]))"
    before = {one.name for one in tmp_path.iterdir()}
    run = subprocess.run([sys.executable, "-B", "-c", code, *words], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout) == (2, "")
    assert "page.html: the file cannot be written (File too large)" in run.stderr
    assert {one.name for one in tmp_path.iterdir()} == before
    out.write_text("mine", encoding="utf-8")
    assert subprocess.run([sys.executable, "-B", "-c", code, *words], capture_output=True, check=False).returncode == 2
    assert out.read_text(encoding="utf-8") == "mine"
    assert main(words) == 0
    assert load_program(out).moves and page.stat().st_size > 20000


def test_a_share_is_one_of_the_program_as_given(program, tmp_path, capsys):
    slow = tmp_path / "slow.csv"
    Program(load_program(program).tree.with_plan({"move-1": 20.0}, waits_after_s={"move-2": 1.0})).save(slow)
    result = optimized(capsys, slow, "--cycle-time", "+0%", "--allow-faster")
    assert result["cycle_time_s"] > result["least_cycle_time_s"] + 0.5
    assert result["energy_given_j"] != pytest.approx(result["energy_unoptimized_j"], rel=0.01)
    assert result["saving_percent"] > 5.0
    assert result["program"] == "slow"
    assert result["moves"][1]["wait_after_s"] >= 1.0


def test_the_program_itself_may_be_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "cycle.yaml"
    assert main(["example", "cycle.yaml"]) == 0
    path.write_text("# left cell\n" + path.read_text(encoding="utf-8"), encoding="utf-8")
    before = path.read_text(encoding="utf-8").splitlines()
    capsys.readouterr()
    first = optimized(capsys, path, "--cycle-time", "+20%", "--speed-step", "5", "--out", path)
    written = path.read_text(encoding="utf-8")
    assert all(limit["speed_limit_percent"] % 5.0 == 0.0 for limit in first["moves"])
    kept = [line for line in written.splitlines() if not line.startswith("# robojoule: ")]
    assert kept[:5] == before[:5]
    again = optimized(capsys, path, "--cycle-time", first["cycle_time_s"], "--speed-step", "5", "--out", path)
    assert path.read_text(encoding="utf-8") == written
    for move, before_move in zip(again["moves"], first["moves"], strict=True):
        assert [move.pop(key) for key in ("name", "through")] == [before_move.pop(key) for key in ("name", "through")]
        assert move == pytest.approx(before_move, rel=1e-12)


def test_faster_than_given_only_if_allowed(program, tmp_path, capsys):
    slow = tmp_path / "slow.yaml"
    read = load_program(program)
    Program(read.tree.with_plan({"move-1": 20.0})).save(slow)
    speeds = [
        optimized(capsys, slow, "--cycle-time", "+1%", *words)["moves"][0]["speed_limit_percent"]
        for words in ([], ["--allow-faster"])
    ]
    assert speeds[0] <= 20.0 < speeds[1]


def test_people_read_what_it_saves_against_what(program, tmp_path, capsys):
    out = tmp_path / "out.csv"
    assert main(["optimize", str(program), *ROBOT, "--cycle-time", "+20%", "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "the program as given: " in shown
    assert "full speed, then waiting: " in shown
    assert "% less" in shown
    assert "warning" not in shown
    assert f"written to {out}" in shown


@pytest.mark.parametrize("saved_kwh, said", [(5.2, "5 kWh less, 1"), (-5.2, "5 kWh more, 1"), (-0.2, "0 kWh less, 0")])
def test_a_year_with_more_energy_is_called_more(capsys, saved_kwh, said):
    year = {"hours_per_year": 4000.0, "currency": "EUR", "saved_kwh": saved_kwh}
    show_year({**year, "saved_cost": 0.2 * saved_kwh, "saved_co2_kg": 0.4 * saved_kwh})
    assert capsys.readouterr().out.startswith(f"in 4000 h a year: {said} EUR and ")


def test_a_program_that_was_slower_is_warned_of(program, tmp_path, capsys):
    slow = tmp_path / "slow.yaml"
    read = load_program(program)
    Program(read.tree.with_plan({move.name: 10.0 for move in read.moves})).save(slow)
    assert main(["optimize", str(slow), *ROBOT, "--cycle-time", "2.5", "--allow-faster"]) == 0
    shown = capsys.readouterr().out
    assert "warning: the program as given takes " in shown
    assert shown.count("warning") == 1


def test_the_fastest_cycle_is_no_better_than_its_bound(program, capsys):
    """Rounding must not put the bound above the energy of the only plan there is."""
    result = optimized(capsys, program, "--cycle-time", "+0%")
    assert result["bound_j"] <= result["energy_j"]
    assert result["gap_to_optimum_percent"] >= 0.0
    assert result["energy_j"] == pytest.approx(result["energy_unoptimized_j"], rel=1e-6)


SECONDS = "allowed: seconds (7.5), or a share above the program's own cycle time (+10%)"
# further words, message; PROGRAM stands for a good program
BAD = {
    "too short": (
        ["PROGRAM", "--cycle-time", "0.5"],
        "the cycle time 0.5 s is shorter than the fastest cycle; allowed",
    ),
    "text": (
        ["PROGRAM", "--cycle-time", "fast"],
        f"--cycle-time: 'fast' is not a valid cycle time; {SECONDS}",
    ),
    "negative": (["PROGRAM", "--cycle-time=-3"], "--cycle-time: '-3' is not a valid cycle time; "),
    "negative share": (["PROGRAM", "--cycle-time=-5%"], "--cycle-time: '-5%' is not a valid cycle time; "),
    "not finite": (["PROGRAM", "--cycle-time", "nan"], "--cycle-time: 'nan' is not a valid cycle time; "),
    "no program": (["none.yaml", "--cycle-time", "3"], "none.yaml: there is no such file"),
    "type of program": (
        ["PROGRAM.txt", "--cycle-time", "3"],
        "unknown file type '.txt'; allowed: .yaml, .yml, .json (",
    ),
    "type of output": (
        ["PROGRAM", "--cycle-time", "3", "--out", "a.txt"],
        "--out: unknown file type '.txt'; allowed: .yaml, .yml, .json, .csv",
    ),
    "step": (
        ["PROGRAM", "--cycle-time", "3", "--speed-step", "0"],
        "--speed-step: 0 is out of range; allowed: 0.01 to 50 %",
    ),
    "payload": (["PROGRAM", "--cycle-time", "3", "--payload", "17"], "a payload of 17 kg is more than kuka_kr16_r20"),
    "mass": (
        ["PROGRAM", "--cycle-time", "3", "--payload", "-1"],
        "--payload: -1 is not a valid payload mass; allowed: 0 kg",
    ),
}


@pytest.mark.parametrize("words, message", BAD.values(), ids=BAD.keys())
def test_bad_input_is_one_sentence_with_exit_code_2_and_writes_nothing(
    program, tmp_path, monkeypatch, capsys, words, message
):
    monkeypatch.chdir(tmp_path)
    words = [word.replace("PROGRAM", str(program)) for word in words]
    assert main(["optimize", *ROBOT, *words, *(["--out", "out.yaml"] if "--out" not in words else [])]) == 2
    shown = capsys.readouterr()
    assert message in shown.err
    assert shown.err.startswith("robojoule optimize: ")
    assert shown.err.count("\n") == 1
    assert shown.out == ""
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "text, message",
    [
        ("q1_deg;q2_deg\n0;0\n", "cycle.csv, line 1: the columns are not separated by commas"),
        ("q1_deg,q2_deg\n0,0\n1,1\n", "cycle.csv, line 2: the start: 2 joint positions given, but kuka_kr16_r2010_2"),
        ("q1_deg,q2_deg\n0,0\n1,one\n", "cycle.csv, line 3, column q2_deg: 'one' is not a number"),
    ],
    ids=["separators", "joints", "word"],
)
def test_a_bad_file_of_joint_positions_says_where(tmp_path, monkeypatch, capsys, text, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cycle.csv").write_text(text)
    assert main(["optimize", "cycle.csv", *ROBOT, "--cycle-time", "+10%"]) == 2
    assert message in capsys.readouterr().err


def test_loads_are_in_text_json_and_yaml(program, tmp_path, capsys):
    out = tmp_path / "out.yaml"
    result = optimized(capsys, program, "--cycle-time", "+20%", "--out", out)
    said = (
        f"largest mains power {result['peak_power_w']:.1f} W, largest torque {100 * result['peak_torque_ratio']:.1f} %"
    )
    assert main(["optimize", str(program), *ROBOT, "--cycle-time", "+20%"]) == 0
    assert said in capsys.readouterr().out
    lines = out.read_text().splitlines()
    assert lines[0].startswith(
        f"# robojoule: plan for {ROBOT[1]} with 10 kg: cycle time {result['cycle_time_s']:.3f} s"
    )
    assert f"largest mains power {result['peak_power_w']:.0f} W" in lines[1]
    optimized(capsys, out, "--cycle-time", "+20%", "--out", out)
    again = out.read_text().splitlines()
    assert sum(line.startswith("# robojoule: ") for line in again) == 2  # those of the earlier plan are gone
    assert again[0] != lines[0]


def test_bounds_of_a_plan_are_options(program, capsys):
    free = optimized(capsys, program, "--cycle-time", "+60%")
    power = 0.97 * free["peak_power_w"]
    assert optimized(capsys, program, "--cycle-time", "+60%", "--peak-power", power)["peak_power_w"] <= power
    words = ["optimize", str(program), *ROBOT, "--cycle-time", "+150%"]
    assert main([*words, "--peak-power", "100"]) == 2
    assert "--peak-power: move " in capsys.readouterr().err
    assert main([*words, "--allow-overload", "999"]) == 2
    assert "--allow-overload: 999 is out of range; allowed: 0 to 200 %" in capsys.readouterr().err
