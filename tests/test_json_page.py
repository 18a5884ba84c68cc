"""docs/json.md: every key that a command prints with `--json` is in its table, and nothing else is."""

import contextlib
import io
import json
import re
from typing import Any

import pyarrow as pa
import pytest
from pyarrow import csv

import robojoule as rj
from robojoule.cli import main
from tests.calibration.plant import Plant, make_log
from tests.conftest import ROOT
from tests.robots.test_urdf import TWO_JOINTS

PAGE = ROOT / "docs/json.md"
KR16 = ("--robot", "kuka_kr16_r2010_2", "--payload", "10")
COMMANDS = {
    "robots": [],
    "robots check": [str(ROOT / "robojoule/catalog/ur_ur10e.json")],
    "robots scale": ["arm.urdf", "--rated-payload", "30", "--out", "arm.drives.yaml"],
    "profile": [*KR16, "--from", "0,-90,90,0,0,0", "--to", "45,-60,70,0,30,0"],
    "simulate": ["cycle.yaml", *KR16],
    "optimize": ["cycle.yaml", *KR16, "--cycle-time", "+10%", "--profiles", "predicted", "--diff"],
    "convert": ["cycle.yaml", "cycle.src", *KR16],
    "adjust": ["cycle.yaml", *KR16, "--measured-cycle", "2.7", "--cycle-time", "3"],
    "pareto": ["cycle.yaml", *KR16],
    "identify": ["log.csv", "--robot", "kuka_kr16_r2010_2"],
    "identify torques.csv": ["--robot", "kuka_kr16_r2010_2"],
    "identify runs.csv": ["--program", "cycle.yaml", *KR16],
    "cell solve": ["cell.yaml", "--out", "plan.json"],
    "cell solve robot_cell.yaml": ["--time-limit", "900", "--gap", "1", "--quiet", "--out", "table.json"],
    "cell check": ["cell.yaml", "plan.json"],
    "cell check robot_cell.yaml": ["table.json"],
    "cell gantt": ["cell.yaml", "plan.json", "--plot", "plan.svg"],
    "example": [],
}
NAMES_OF_DATA = (
    "parts_j",
    "examples",
    "provenance",
    "notes",
    "lumped_links",
    "starts_s",
)  # their keys are names themselves


def keys(data: Any) -> set[str]:
    """All keys of nested data but those that are names themselves."""
    if isinstance(data, dict):
        inner = [keys(value) for key, value in data.items() if key not in NAMES_OF_DATA]
        return set(data).union(*inner)
    return set().union(*map(keys, data)) if isinstance(data, list) else set()


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    folder = tmp_path_factory.mktemp("json")
    (folder / "arm.urdf").write_text(TWO_JOINTS, encoding="utf-8")
    columns, _ = make_log(Plant(21), 21, motions=20)
    csv.write_csv(pa.table(columns), folder / "log.csv")
    columns, _ = make_log(Plant(21), 21, motions=6, torques=True)
    del columns["power_w"]
    csv.write_csv(pa.table(columns), folder / "torques.csv")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name in ("cycle.yaml", "cell.yaml", "robot_cell.yaml"):
            assert main(["example", name]) == 0
        (folder / "runs.csv").write_text(runs_of("cycle.yaml"), encoding="utf-8")
        return {command: keys(output(command, words)) for command, words in COMMANDS.items()}


def runs_of(program: str) -> str:
    """A table of runs of a program as it is, each move a fifth slower than simulated."""
    run = rj.simulate(rj.load_program(program), rj.load_robot(KR16[1], payload_kg=10.0))
    rows = [f"{move.name},{move.speed_limit_percent},{1.2 * move.duration_s}" for move in run.moves]
    return "\n".join(["move,speed_limit_percent,duration_s", *rows])


def output(command: str, words: list[str]) -> Any:
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        assert main([*command.split(), *words, "--json"]) == 0, command
    return json.loads(text.getvalue())


def test_the_table_names_every_key(printed):
    listed = re.findall(r"^\| `(\w+)` \| .+ \|$", PAGE.read_text(encoding="utf-8"), re.M)
    assert listed == sorted(set().union(*printed.values()))
