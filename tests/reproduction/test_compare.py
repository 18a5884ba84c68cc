"""Fresh results against committed ones: what counts as rounding, what is said, exit codes."""

import subprocess
import sys
from pathlib import Path

import pytest

from reproduction.compare import compare_results, differences, is_beyond
from robojoule.errors import InputError
from tests.conftest import ROOT, run

TABLE = "relaxation_percent,method,saving_percent,energy_j\n110,uniform,13.81,6246.747123\n121,greedy,20.40,5000.5\n"
METRICS = '{"plans": {"energy_j": 7004.61234567, "gaps_percent": [0.5, 1.25], "held": true}}'


@pytest.mark.parametrize(
    ("name", "fresh", "committed", "beyond"),
    [
        ("saving_percent", "17.3611", "17.3699", False),
        ("saving_percent", "17.3611", "17.3732", True),
        ("saving_percent", "17.36", "17.37", False),
        ("energy_j", "5000.004999", "5000.000000", False),
        ("energy_j", "5000.006", "5000.000", True),
        ("energy_j", "0.12", "0.13", False),  # one unit of the last digit
        ("energy_j", "0.12", "0.14", True),
        ("energy_j", "-5.1e-9", "-6.1e-9", True),
        ("trees", "30", "31", True),
        ("robojoule", "13.16 % against 8.07 %", "13.17 % against 8.07 %", False),
        ("robojoule", "13.16 % against 8.07 %", "13.16 % against 8.09 %", True),
        ("held", "true", "false", True),
        ("method", "greedy", "uniform", True),
        ("energy_j", "", "1.5", True),
        ("subset", "1-10", "1-10", False),
    ],
)
def test_numbers_may_differ_by_rounding_alone(name: str, fresh: str, committed: str, beyond: bool):
    assert is_beyond(name, fresh, committed) == beyond


def test_places_of_tables_and_metrics_are_named():
    (found,) = differences(Path("table.csv"), TABLE.replace("13.81", "13.95"), TABLE)
    assert str(found) == "line 2, saving_percent: 13.95, committed 13.81" and found.beyond
    fresh = METRICS.replace("61234567", "61234568").replace("1.25", "1.5")
    energy, gap = differences(Path("metrics.json"), fresh, METRICS)
    assert (energy.place, energy.beyond) == ("plans.energy_j", False)
    assert (str(gap), gap.beyond) == ("plans.gaps_percent.1: 1.5, committed 1.25", True)
    assert differences(Path("table.csv"), TABLE, TABLE) == []


@pytest.mark.parametrize(
    "fresh", [TABLE + "133,greedy,1.0,2.0\n", TABLE.replace("energy_j", "energy_w"), TABLE.splitlines()[0], ""]
)
def test_other_rows_and_columns_are_more_than_rounding(fresh: str):
    assert [one.beyond for one in differences(Path("table.csv"), fresh, TABLE)] == [True]


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A committed project with results in Git and one in DVC."""
    files = {
        "dvc.lock": "stages:\n  simulate_motions:\n    outs:\n    - path: data/runs.parquet\n      md5: abc\n",
        "studies/dvc.lock": "stages: {}\n",
        "reports/tables/table_6_1.csv": TABLE,
        "reports/metrics.json": METRICS,
        "reports/note.txt": "no result",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    run("git", "init", "-q", cwd=tmp_path)
    run("git", "add", "-A", cwd=tmp_path)
    run("git", "-c", "user.name=toy", "-c", "user.email=toy@example.org", "commit", "-qm", "Toy", cwd=tmp_path)
    (tmp_path / "data").mkdir()
    (tmp_path / "data/runs.parquet").touch()
    return tmp_path


def command(root: Path, *words: str) -> subprocess.CompletedProcess[str]:
    call = [sys.executable, "-m", "reproduction.compare", "--root", str(root), *words]
    return subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=False)


def change(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_equal_results_end_with_0(project: Path):
    done = command(project)
    assert (done.returncode, done.stdout) == (0, "all results are the same, byte for byte\n")


def test_rounding_is_said_and_ends_with_0(project: Path):
    change(project / "dvc.lock", "abc", "abd")
    change(project / "reports/tables/table_6_1.csv", "6246.747123", "6246.747124")
    done = command(project)
    assert (done.returncode, done.stdout.splitlines()) == (
        0,
        [
            "data/runs.parquet: other bytes",
            "reports/tables/table_6_1.csv: 1 values differ, 0 by more than rounding",
            "  line 2, energy_j: 6246.747124, committed 6246.747123",
            "all results agree to rounding",
        ],
    )


def test_more_than_rounding_ends_with_1(project: Path):
    change(project / "reports/tables/table_6_1.csv", "20.40", "20.45")
    change(project / "reports/metrics.json", "true", "false")
    done = command(project)
    assert done.returncode == 1
    assert "  line 3, saving_percent: 20.45, committed 20.40" in done.stdout.splitlines()
    assert "  plans.held: false, committed true" in done.stdout.splitlines()


def test_a_result_that_is_gone_is_more_than_rounding(project: Path):
    (project / "reports/metrics.json").unlink()
    lines, beyond = compare_results(project)
    assert beyond and "  the file: missing, committed there" in lines


def test_another_commit_can_be_compared_with(project: Path):
    change(project / "reports/tables/table_6_1.csv", "20.40", "20.45")
    run("git", "-c", "user.name=toy", "-c", "user.email=toy@example.org", "commit", "-qam", "New", cwd=project)
    assert command(project).returncode == 0
    assert command(project, "HEAD~1").returncode == 1


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("data/runs.parquet", None, "there is no fresh result; run `make repro` first"),
        ("dvc.lock", None, "the file cannot be read"),
        ("dvc.lock", "[1, 2]", "this is not a lock file of DVC"),
        ("reports/metrics.json", "{", "the file is damaged"),
        ("reports/tables/table_6_1.csv", TABLE + "1,2\n", "the file is damaged"),
    ],
)
def test_what_cannot_be_compared_is_named(project: Path, file: str, text: str | None, message: str):
    if text is None:
        (project / file).unlink()
    else:
        (project / file).write_text(text, encoding="utf-8")
    done = command(project)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith(f"compare: {project / file}: {message}")


def test_a_commit_that_is_none_is_refused(project: Path):
    with pytest.raises(InputError, match=r"git show failed .*nowhere"):
        compare_results(project, "nowhere")
    done = command(project, "nowhere")
    assert done.returncode == 2 and done.stderr.startswith("compare: ") and len(done.stderr.splitlines()) == 1
