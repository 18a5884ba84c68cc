import subprocess
import sys
from pathlib import Path

import pytest

from stages.show_table import COLUMNS, published, table_text

ROW = dict(zip(COLUMNS, ("110", "", "optimum", "12.3456", "14.5", "0.0000", "30"), strict=True))


def show(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "stages.show_table"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={"PYTHONPATH": str(Path(__file__).parents[2])},
    )


def test_robojoule_s_figures_are_beside_the_thesis_s():
    rows = [ROW, ROW | {"relaxation_percent": "121", "saving_percent": "20"}]
    rows.append(ROW | {"method": "krc_polynomial", "krc_segments": "4", "saving_percent": "9.87"})
    lines = [" ".join(line.split()) for line in table_text(rows, published()).splitlines()]
    assert "cycle time 110 % 121 %" in lines
    assert "optimum 12.35 20.00" in lines and "krc_polynomial, 4 segments 9.87" in lines
    assert "thesis, predicted, trees of 4 segments 17.42 26.70" in lines  # by Eq. 6.1
    assert "thesis, predicted, trees of 4 segments 17.42 28.19" in lines  # as printed
    assert lines.count("optimum 0.00 0.00") == 1


def test_what_the_predictor_reaches_where_it_cannot_know_the_robot_stands_beside():
    study = {"regime": "same_robot", "method": "robojoule_predicted", "payload_kg": "all", "trees": "300"}
    study |= {"relaxation_percent": "110", "saving_mean_percent": "20.7757", "gap_mean_percent": "0.0094"}
    others = [study | {"method": "oracle"}, study | {"payload_kg": "10.0"}, study | {"regime": "unseen_payload"}]
    lines = [" ".join(line.split()) for line in table_text([ROW], published(), [study, *others]).splitlines()]
    studied = [line for line in lines if "robot unlike its entry" in line]
    assert [line.rsplit(" ", 1)[1] for line in studied] == ["20.78", "0.01"]


def test_columns_are_aligned():
    lines = table_text([ROW, ROW | {"relaxation_percent": "200"}], published()).splitlines()
    cells = [line for line in lines if line.startswith("  ") and line.rstrip()[-1].isdigit()]
    assert {len(line) for line in cells if line.count(".") == 2} == {max(len(line) for line in cells)}


def test_a_cycle_time_that_the_thesis_did_not_try():
    text = table_text([ROW | {"relaxation_percent": "140", "saving_percent_published_convention": ""}], published())
    assert "12.35" in text and "thesis" in text


def test_a_missing_table_says_what_to_do(tmp_path: Path):
    done = show(tmp_path)
    assert done.returncode == 1 and "make repro" in done.stderr and len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", ",".join(COLUMNS) + "\n110,,optimum,much,,,30\n"])
def test_a_broken_table_is_one_sentence(tmp_path: Path, text: str):
    (tmp_path / "reports/tables").mkdir(parents=True)
    (tmp_path / "reports/tables/table_6_1.csv").write_text(text, encoding="utf-8")
    done = show(tmp_path)
    assert done.returncode == 1 and done.stderr.startswith("show_table: ") and len(done.stderr.splitlines()) == 1
