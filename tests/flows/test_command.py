"""How the commands of flows end: bad input is one sentence and exit code 2, before any server starts."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from flows.command import told
from flows.pipeline import StageFailed
from robojoule.errors import InputError
from tests.conftest import ROOT


@pytest.mark.parametrize(
    ("error", "code"), [(InputError("no good", key="seed"), 2), (StageFailed("build_features", False, []), 1)]
)
def test_errors_for_people_are_one_sentence(capsys: pytest.CaptureFixture[str], error: Exception, code: int):
    with pytest.raises(SystemExit) as ended, told("flows.test"):
        raise error
    assert ended.value.code == code
    assert capsys.readouterr().err == f"flows.test: {error}\n"


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), ValueError("Error calling function `_ser`: KeyboardInterrupt: ")]
)
def test_an_interrupt_is_one_sentence_whatever_libraries_make_of_it(
    capsys: pytest.CaptureFixture[str], error: BaseException
):
    with pytest.raises(SystemExit) as ended, told("flows.test"):
        raise error
    assert ended.value.code == 130
    assert capsys.readouterr().err == "flows.test: interrupted\n"


def test_faults_keep_their_traceback():
    with pytest.raises(ZeroDivisionError), told("flows.test"):
        1 / 0  # noqa: B018


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("pipeline --root nowhere --force", "nowhere/dvc.yaml: there is no such file"),
        ("pipeline --root list", "list/dvc.yaml: there are no stages in it; allowed: the file of a pipeline of DVC"),
        ("pipeline --root {root} --runner grid", "unknown task runner 'grid'"),
        ("studies --root nowhere", "nowhere/studies/dvc.yaml: there is no such file"),
        ("measurements log.txt", "log.txt: this is not a log"),
        ("cells {root}/robojoule/examples/robot_cell.yaml --out plans.json", "this cell is of robots' programs"),
        ("cells {root}/robojoule/examples/cell.yaml --out plans.txt", "plans.txt: unknown file type '.txt'; allowed: "),
        ("cells {root}/robojoule/examples/cell.yaml --out nowhere/plans.csv", "there is no folder"),
        ("dvc_lock", ".dvc/tmp/rwlock: cannot be mended: Is a directory"),
    ],
)
def test_bad_input_ends_with_2_at_once(tmp_path: Path, words: str, said: str):
    (tmp_path / "list").mkdir()
    (tmp_path / "list/dvc.yaml").write_text("- stages\n", encoding="utf-8")
    (tmp_path / ".dvc/tmp/rwlock").mkdir(parents=True)
    command, *rest = words.format(root=ROOT).split()
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    environment.pop("PREFECT_API_URL", None)
    done = subprocess.run(
        [sys.executable, "-m", f"flows.{command}", *rest],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith(f"flows.{command}: ") and said in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / ".desk").exists()
