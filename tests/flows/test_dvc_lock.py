"""A note of DVC that a kill tore: DVC refuses it, what the make targets and flows do first takes it away."""

import fcntl
import subprocess
import sys
from pathlib import Path

import pytest

from flows.dvc_lock import mend_lock
from tests.conftest import ROOT, run
from tests.flows.test_pipeline import project  # noqa: F401  a fixture


def note_of(project: Path) -> Path:  # noqa: F811
    return project / ".dvc/tmp/rwlock"


@pytest.mark.parametrize("left", ["", '{"read": {}, "wri'])
def test_a_torn_note_is_taken_away(project: Path, left: str):  # noqa: F811
    run("dvc", "repro", "build_features", cwd=project)
    assert not mend_lock(project)
    note_of(project).write_text(left, encoding="utf-8")
    assert "rwlock" in run("dvc", "repro", cwd=project, code=255).stderr  # else nothing is to be mended
    assert mend_lock(project)
    run("dvc", "repro", cwd=project)
    assert not mend_lock(project)


def test_what_another_process_is_writing_is_waited_for(project: Path):  # noqa: F811
    run("dvc", "repro", cwd=project)
    whole = note_of(project).read_text(encoding="utf-8")
    words = [
        sys.executable,
        "-c",
        f"from pathlib import Path; from flows.dvc_lock import mend_lock as mend; print(mend(Path({str(project)!r})))",
    ]
    with note_of(project).with_suffix(".lock").open("a") as guard:
        fcntl.flock(guard, fcntl.LOCK_EX)
        note_of(project).write_text("", encoding="utf-8")
        mending = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        with pytest.raises(subprocess.TimeoutExpired):
            mending.wait(3.0)
        note_of(project).write_text(whole, encoding="utf-8")
    assert mending.communicate()[0] == "False\n"
    assert note_of(project).read_text(encoding="utf-8") == whole


def test_a_project_without_one_is_left_alone(tmp_path: Path):
    assert not mend_lock(tmp_path)
    assert list(tmp_path.iterdir()) == []
