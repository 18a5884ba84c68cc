"""Programs in a robot's own language on the command line."""

import json

import pytest

from robojoule.cli import main

SOURCE = """\
DEF feeder( )
BAS(#INITMOV,0)
PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}
BAS(#TOOL,3)
PTP {A1 50,A2 -70,A3 80,A5 30}
WAIT FOR $IN[3]
PTP {X 1173,Y 0,Z 1500,A 0,B 90,C 0,S 2,T 2}
PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}
END
"""
ROBOT = ("--robot", "kuka_kr16_r2010_2", "--payload", "8")


@pytest.fixture()
def feeder(tmp_path):
    (tmp_path / "feeder.src").write_text(SOURCE)
    return tmp_path / "feeder.src"


def run(capsys, *words) -> tuple[int, str, str]:
    code = main([str(word) for word in words])
    return (code, *capsys.readouterr())


def test_a_plan_is_shown_as_a_diff_and_written(feeder, tmp_path, capsys):
    out = tmp_path / "new.src"
    words = ["optimize", feeder, *ROBOT, "--cycle-time", "6", "--wait", "6=1.2", "--tool", "0,0,0"]
    code, text, _ = run(capsys, *words, "--diff", "--out", out, "--json")
    assert code == 0
    result = json.loads(text)
    assert result["cycle_time_s"] == pytest.approx(6.0, abs=0.011)
    assert len(result["moves"]) == 3 and result["moves"][0]["wait_after_s"] >= 1.2
    removed = [line[1:] for line in result["diff"].splitlines()[2:] if line.startswith("-")]
    added = [line[1:] for line in result["diff"].splitlines()[2:] if line.startswith("+")]
    assert added and all("VEL_PTP" in line or "WAIT SEC" in line for line in [*removed, *added])
    kept = [line for line in out.read_text().splitlines() if line not in added]
    assert kept == SOURCE.splitlines()
    assert any("line 3: the first motion starts at an unknown position" in note for note in result["program_notes"])
    code, text, _ = run(capsys, *words[:1], out, *words[2:4], *words[4:6], "--cycle-time", result["cycle_time_s"],
                        "--wait", f"{out.read_text().splitlines().index('WAIT FOR $IN[3]') + 1}=1.2",
                        "--tool", "0,0,0", "--diff")  # fmt: skip
    assert code == 0 and "nothing changes in the program's files" in text


def test_notes_are_told_below_the_table(feeder, capsys):
    code, text, _ = run(capsys, "simulate", feeder, *ROBOT)
    assert code == 0
    assert "note: line 6: how long it takes is not in the file, see --wait: WAIT FOR $IN[3]" in text
    assert "TOOL_DATA[3] is not in the file: give it by --tool, --base or --controller-data" in text


BAD = {
    "no robot": (
        ["simulate", "feeder.src"],
        "line 7: the target of the motion is a place of the tool, which needs a rob",
    ),
    "a wait that is none": (["simulate", "feeder.src", *ROBOT, "--wait", "7=1"], "line 7: there is no wait of unknown"),
    "a wait without length": (["simulate", "feeder.src", *ROBOT, "--wait", "6"], "--wait: '6' is not a wait"),
    "a tool of two numbers": (["simulate", "feeder.src", *ROBOT, "--tool", "1,2"], "--tool: 2 numbers are not a frame"),
    "no such data": (["simulate", "feeder.src", *ROBOT, "--controller-data", "no.yaml"], "there is no such file"),
    "seconds for sections": (
        ["optimize", "feeder.src", *ROBOT, "--cycle-time", "6"],
        "nobody knows how long line 6, line 7 takes, so a cycle time in seconds says nothing",
    ),
    "a page of sections": (
        ["optimize", "feeder.src", *ROBOT, "--cycle-time", "+10%", "--page", "a.html", "--out", "b.src"],
        "feeder.src: a page needs the whole cycle, and nobody knows how long line 6",
    ),
    "the data list": (["simulate", "feeder.dat", *ROBOT], "unknown file type '.dat'"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_sentence_and_writes_nothing(feeder, capsys, monkeypatch, name):
    monkeypatch.chdir(feeder.parent)
    words, message = BAD[name]
    code, _, error = run(capsys, *words)
    assert code == 2 and message in error and error.count("\n") == 1
    assert [path.name for path in feeder.parent.iterdir()] == ["feeder.src"]


@pytest.mark.parametrize(
    "words", [("--wait", "3=999"), ("--tool", "0,0,900"), ("--base", "0,0,0"), ("--controller-data", "ctrl.yaml")]
)
@pytest.mark.parametrize("suffix", [".yaml", ".json", ".csv"])
def test_what_stands_in_the_controller_goes_with_a_program_of_it(feeder, capsys, monkeypatch, words, suffix):
    monkeypatch.chdir(feeder.parent)
    plain = feeder.parent / f"plain{suffix}"
    feeder.write_text("DEF a( )\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nPTP {A1 9}\nEND\n")
    (feeder.parent / "ctrl.yaml").write_text("format: robojoule-controller-data\nversion: 1\n")
    assert run(capsys, "convert", feeder, plain, *ROBOT[:2])[0] == 0
    code, _, error = run(capsys, "simulate", plain, *ROBOT, *words)
    assert code == 2 and f"{words[0]}: what stands in the controller goes with a program in a robot's own" in error
    ends = ("--from", "0,-90,90,0,0,0", "--to", "9,-90,90,0,0,0")
    code, _, error = run(capsys, "profile", *ROBOT, *ends, *words)
    assert code == 2 and f"{words[0]}: what stands in the controller" in error


def test_lengths_of_waits_hold_for_the_program_that_a_plan_was_made_from(feeder, tmp_path, capsys):
    """A plan that adds waits has others of its lines behind them."""
    body = "PTP {A1 50,A2 -70,A3 80,A5 30}\nWAIT FOR $IN[3]\nPTP {A1 0,A2 -90,A3 90,A5 0}\nWAIT FOR $IN[4]\n"
    feeder.write_text(f"DEF a( )\nPTP {{A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}}\nWAIT SEC 0.5\n{body}END\n")
    plan = tmp_path / "plan.src"
    words = ["optimize", feeder, *ROBOT, "--cycle-time", "9", "--slowest-speed-limit", "50", "--out", plan]
    code, _, error = run(capsys, *words, "--wait", "5=1.2", "--wait", "7=0.4")
    assert code == 0, error
    lines = plan.read_text().splitlines()
    at = [lines.index(f"WAIT FOR $IN[{signal}]") + 1 for signal in (3, 4)]
    assert at != [5, 7]
    waits = ["--wait", f"{at[0]}=1.2", "--wait", f"{at[1]}=0.4"]
    words = ["adjust", plan, *ROBOT, "--given", feeder, "--measured-cycle", "9.5", "--cycle-time", "9", *waits]
    code, text, error = run(capsys, *words, "--json")
    assert code == 0, error
    given = json.loads(text)
    assert given["cycle_time_s"] <= 9.0
    feeder.write_text(feeder.read_text().replace("WAIT FOR $IN[4]\n", ""))
    code, _, error = run(capsys, *words)
    assert code == 2 and "1 line is of unknown length, 2 in 'plan.src'" in error
