import json

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv

from robojoule.cli import main
from robojoule.robots import load_robot
from tests.calibration.plant import ROBOT, Plant, make_log


@pytest.fixture(scope="module")
def log_file(tmp_path_factory):
    columns, _ = make_log(Plant(21), 21, motions=20)
    path = tmp_path_factory.mktemp("logs") / "log.csv"
    csv.write_csv(pa.table(columns), path)
    return str(path)


def test_writes_a_robot_file_and_a_plot_and_prints_json(log_file, tmp_path, capsys):
    out, plot = tmp_path / "entry.json", tmp_path / "fit.svg"
    words = ["identify", log_file, "--robot", ROBOT, "--payload", "10", "--name", "cell_7", "--json"]
    assert main([*words, "--out", str(out), "--plot", str(plot)]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["robot"] == ROBOT
    assert result["held_out"]["rmse_percent"] < 5.0
    assert result["held_out"]["motions"] == 5
    by_name = {row["name"]: row for row in result["parameters"]}
    assert by_name["base_power_w"]["standard_error"] > 0.0
    assert result["unidentified"] == [name for name, row in by_name.items() if not row["identified"]]
    robot = load_robot(out)
    assert robot.name == "cell_7"
    assert robot.drives.base_power_w == pytest.approx(by_name["base_power_w"]["value"], rel=1e-5)
    first = plot.read_bytes()
    assert b"<svg" in first
    assert main([*words, "--plot", str(plot)]) == 0
    assert plot.read_bytes() == first
    assert sorted(path.name for path in tmp_path.iterdir()) == ["entry.json", "fit.svg"]


def shifted(log_file, tmp_path, samples):
    """The log with a power that comes later by some samples of 4 ms."""
    table = csv.read_csv(log_file)
    late = pa.array(np.roll(table["power_w"].to_numpy(), samples))
    path = tmp_path / "late.csv"
    csv.write_csv(table.set_column(table.column_names.index("power_w"), "power_w", late), path)
    return str(path)


def test_a_poor_fit_is_said(log_file, tmp_path, capsys):
    """Power and positions have different clocks: more than a meter lags by."""
    assert main(["identify", shifted(log_file, tmp_path, 500), "--robot", ROBOT, "--payload", "10"]) == 0
    assert "warning: poor fit (R2 below 0.9): the energy model does not explain this log" in capsys.readouterr().out


def test_a_meter_that_lags_is_said(log_file, tmp_path, capsys):
    assert main(["identify", shifted(log_file, tmp_path, 50), "--robot", ROBOT, "--payload", "10"]) == 0
    assert "warning: the power comes 200 ms later than the positions" in capsys.readouterr().out


def test_prints_a_table(log_file, capsys):
    assert main(["identify", log_file, "--robot", ROBOT, "--payload", "10"]) == 0
    text = capsys.readouterr().out
    assert "joints.joint_2.viscous_nm_s_per_rad" in text
    assert "held out, catalog" in text
    assert "poor fit" not in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["none.csv", "--robot", ROBOT], "none.csv: there is no such file"),
        (["LOG", "--robot", "r2d2"], "unknown robot 'r2d2'"),
        (["LOG", "--robot", ROBOT, "--out", "a.txt"], "--out: unknown file type '.txt'; allowed: .json, .yaml, .yml"),
        (["LOG", "--robot", ROBOT, "--plot", "a.txt"], "--plot: unknown file type '.txt'; allowed: .svg, .png, .pdf"),
        (["LOG", "--robot", ROBOT, "--torque-constants", "a"], "--torque-constants: 'a' is not a list"),
        (["LOG", "--robot", ROBOT, "--window", "0"], "--window: 0 is out of range; allowed: 0.001 to 1 s"),
    ],
)
def test_bad_input_ends_with_2_and_one_line(log_file, capsys, words, message):
    assert main(["identify", *(log_file if word == "LOG" else word for word in words)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert message in captured.err
    assert len(captured.err.strip().splitlines()) == 1
