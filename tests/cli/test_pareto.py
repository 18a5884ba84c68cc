"""`robojoule pareto`: JSON, CSV and drawing agree; the same bytes each time; bad input."""

import csv
import json

import numpy as np
import pytest

from robojoule.cli import main
from robojoule.robots import catalog_path

ROBOT = ["--robot", "kuka_kr16_r2010_2", "--payload", "10"]


def test_the_curve_falls_to_the_least_energy(program, tmp_path, capsys):
    table = tmp_path / "curve.csv"
    assert main(["pareto", str(program), *ROBOT, "--csv", str(table), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    time, energy, power = (
        np.array([point[name] for point in result["points"]])
        for name in ("cycle_time_s", "energy_j", "marginal_power_w")
    )
    assert time[0] == result["least_cycle_time_s"]
    assert energy[0] == result["energy_fastest_j"]
    assert (time[-1], energy[-1]) == (result["best_cycle_time_s"], result["best_energy_j"])
    assert (np.diff(energy) < 0.0).all()
    assert (power[:-1] < 0.0).all()
    assert power[-1] >= 0.0
    assert np.diff(energy) / np.diff(time) == pytest.approx(power[:-1], rel=1e-6, abs=1e-6)
    assert 0.0 < result["largest_gap_percent"] < 0.1
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["cycle_time_s", "energy_j", "marginal_power_w"]
    found = [{name: float(value) for name, value in row.items()} for row in rows]
    for row, point in zip(found, result["points"], strict=True):
        assert row == pytest.approx(point, rel=1e-8)


def test_the_optimum_for_a_cycle_time_lies_on_the_curve(program, capsys):
    assert main(["pareto", str(program), *ROBOT, "--until", "waiting", "--json"]) == 0
    curve = json.loads(capsys.readouterr().out)
    assert curve["points"][-1]["cycle_time_s"] == curve["waiting_cycle_time_s"]
    assert curve["points"][-1]["marginal_power_w"] == curve["waiting_power_w"]
    for relative in ("+5%", "+40%"):
        words = ["--cycle-time", relative, "--speed-step", "0.01", "--json"]
        assert main(["optimize", str(program), *ROBOT, *words]) == 0
        plan = json.loads(capsys.readouterr().out)
        on_curve = np.interp(
            plan["cycle_time_s"],
            [point["cycle_time_s"] for point in curve["points"]],
            [point["energy_j"] for point in curve["points"]],
        )
        assert on_curve == pytest.approx(plan["energy_j"], rel=5e-4)


def test_the_drawing_has_the_same_bytes_each_time(program, tmp_path, capsys):
    drawings = []
    for name in ("one.svg", "two.svg"):
        assert main(["pareto", str(program), *ROBOT, "--plot", str(tmp_path / name)]) == 0
        drawings.append((tmp_path / name).read_bytes())
    assert drawings[0] == drawings[1]
    assert drawings[0].startswith(b"<?xml")
    shown = capsys.readouterr().out
    assert "marginal power [W]" in shown
    assert f"written to {tmp_path / 'two.svg'}" in shown


def test_bad_input_writes_nothing(program, tmp_path, capsys):
    table = tmp_path / "curve.csv"
    assert main(["pareto", str(program), *ROBOT, "--csv", str(table), "--plot", str(tmp_path / "a.png")]) == 2
    assert "--plot: unknown file type '.png'; allowed: .svg" in capsys.readouterr().err
    assert main(["pareto", str(tmp_path / "none.yaml"), *ROBOT, "--csv", str(table)]) == 2
    assert "there is no such file" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_standby_modes_have_a_curve_of_their_own(program, tmp_path, capsys):
    data = json.loads(catalog_path("kuka_kr16_r2010_2").read_text(encoding="utf-8"))
    data |= {"name": "mine", "derived_from": data["name"], "standby": {"brakes": {"power_w": 160, "least_idle_s": 1}}}
    (tmp_path / "mine.json").write_text(json.dumps(data), encoding="utf-8")
    words = ["pareto", str(program), "--robot", str(tmp_path / "mine.json"), "--csv", str(tmp_path / "curve.csv")]
    assert main([*words, "--until", "waiting", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    rows = list(csv.DictReader((tmp_path / "curve.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["standby"] for row in rows].count("yes") == len(result["standby"]["points"])
    assert [row["standby"] for row in rows].count("no") == len(result["points"])
    assert result["standby"]["best_energy_j"] <= result["best_energy_j"] * (1.0 + 1e-9)
    assert result["standby"]["points"][-1]["energy_j"] < result["points"][-1]["energy_j"]
    assert main(words) == 0
    assert "with waits in standby: least energy" in capsys.readouterr().out
