"""Tables of runs as users write them down."""

import numpy as np
import pytest

from robojoule.calibration.run_table import energy_step_of, is_run_table, read_runs, resolution_of
from robojoule.errors import InputError

MOVES = ["to part", "lift", "home"]
PLAIN = "move,speed_limit_percent,duration_s,energy_j\nto part,100,0.81,912\n2,50,1.22,\nhome,50,1.3,700\n"


def written(tmp_path, text, name="runs.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def test_moves_by_name_or_number_and_missing_energies(tmp_path):
    path = written(tmp_path, PLAIN)
    runs = read_runs(path, MOVES)
    assert is_run_table(path)
    assert runs.motion.tolist() == [0, 1, 2]
    assert runs.speed_limits == pytest.approx([1.0, 0.5, 0.5])
    assert runs.duration_s == pytest.approx([0.81, 1.22, 1.3])
    assert np.isnan(runs.energy_j).tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        (PLAIN.replace(",", ";").replace(".", ","), "utf-8"),
        (PLAIN.replace(",", "\t"), "utf-16"),
        (PLAIN.replace("_j\n", "_j\n-,%,s,[J]\n", 1).replace("to part", "zum Stück"), "latin-1"),
        ("\n" + PLAIN.replace("\n", "\r\n"), "utf-8-sig"),
        (PLAIN.replace("move", "Move", 1).replace("duration_s", "Duration_s").replace("energy_j", "Energy_J"), "utf-8"),
    ],
)
def test_dialects_of_spreadsheets(tmp_path, text, encoding):
    moves = ["zum Stück" if "Stück" in text else "to part", *MOVES[1:]]
    runs = read_runs(written(tmp_path, text, encoding=encoding), moves)
    assert runs.duration_s == pytest.approx([0.81, 1.22, 1.3])
    assert runs.energy_j[[0, 2]] == pytest.approx([912.0, 700.0])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (("to part", "to prat"), "unknown move 'to prat' .did you mean to part.*allowed: a move of the program"),
        (("2,50", "7,50"), "unknown move '7'"),
        (("0.81", "0"), "duration_s: row 1 is out of range; allowed: 0.001 to"),
        (("100,", "101,"), "speed_limit_percent: row 1 is out of range; allowed: 0.1 to 100 %"),
        (("912", "a lot"), "energy_j: row 1 holds 'a lot', which is not a number"),
        (("912", "inf"), "energy_j: row 1 is out of range"),
        (("duration_s", "duration_ms"), "duration_s: this column is missing"),
        (("100,0.81", ",0.81"), "speed_limit_percent: row 1 is empty"),
        (("_j\n", "_j\n-,%,ms,J\n"), "duration_s: the row of units says 'ms'; allowed: s"),
    ],
)
def test_what_cannot_be_used_is_refused_with_its_place(tmp_path, changed, message):
    with pytest.raises(InputError, match=message):
        read_runs(written(tmp_path, PLAIN.replace(*changed, 1)), MOVES)


def test_what_is_meant_as_a_table_of_runs_is_not_taken_for_a_log(tmp_path):
    assert is_run_table(written(tmp_path, PLAIN.replace("duration_s", "seconds", 1)))
    assert is_run_table(written(tmp_path, PLAIN.replace("move", "motion", 1)))
    assert not is_run_table(written(tmp_path, "time_s,q1_rad,power_w,move\n0,0,500,1\n"))


def test_runs_cannot_be_changed(tmp_path):
    runs = read_runs(written(tmp_path, PLAIN), MOVES)
    for name in ("motion", "speed_limits", "duration_s", "energy_j"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(runs, name)[0] = 1


def test_the_resolution_is_read_off_the_figures():
    assert resolution_of(np.array([0.8, 1.2, 1.3, 2.4, 0.9])) == pytest.approx(0.1)
    assert resolution_of(np.array([0.804, 1.2, 1.348, 2.4, 0.916])) == pytest.approx(0.004)
    assert resolution_of(np.array([0.8041, 1.2, 1.348, 2.4, 0.916])) < 0.001
    assert resolution_of(np.array([0.7, 0.9, 0.6])) == pytest.approx(0.1)  # a stopwatch and a program of three moves
    assert resolution_of(np.array([1.0, 2.0])) < 0.001  # too few to judge


def test_the_step_of_a_meter_is_read_off_the_figures():
    assert energy_step_of(np.array([700.0, 1200.0, np.nan, 100.0])) == 100.0
    assert energy_step_of(np.array([712.0, 1203.0, 88.0])) == 1.0
    assert energy_step_of(np.array([712.4, 1203.0, 88.0])) == 0.0
    assert energy_step_of(np.array([700.0, np.nan, np.nan])) == 0.0  # too few to judge
