"""Files of DVC that a kill tore: DVC refuses them, what the make targets and flows do first mends them."""

import fcntl
import subprocess
import sys
from pathlib import Path

import pytest

from flows.dvc_lock import mend_locks
from tests.conftest import ROOT, run
from tests.flows.test_pipeline import project  # noqa: F401  a fixture


def note_of(project: Path) -> Path:  # noqa: F811
    return project / ".dvc/tmp/rwlock"


@pytest.mark.parametrize("left", ["", '{"read": {}, "wri'])
def test_a_torn_note_is_taken_away(project: Path, left: str):  # noqa: F811
    run("dvc", "repro", "build_features", cwd=project)
    assert not mend_locks(project)
    note_of(project).write_text(left, encoding="utf-8")
    assert "rwlock" in run("dvc", "repro", cwd=project, code=255).stderr  # else nothing is to be mended
    assert mend_locks(project) == [".dvc/tmp/rwlock was torn by a kill; DVC makes it anew"]
    run("dvc", "repro", cwd=project)
    assert not mend_locks(project)


def test_what_another_process_is_writing_is_waited_for(project: Path):  # noqa: F811
    run("dvc", "repro", cwd=project)
    whole = note_of(project).read_text(encoding="utf-8")
    words = [
        sys.executable,
        "-c",
        f"from pathlib import Path; from flows.dvc_lock import mend_locks as mend; print(mend(Path({str(project)!r})))",
    ]
    with note_of(project).with_suffix(".lock").open("a") as guard:
        fcntl.flock(guard, fcntl.LOCK_EX)
        note_of(project).write_text("", encoding="utf-8")
        mending = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        with pytest.raises(subprocess.TimeoutExpired):
            mending.wait(3.0)
        note_of(project).write_text(whole, encoding="utf-8")
    assert mending.communicate()[0] == "[]\n"
    assert note_of(project).read_text(encoding="utf-8") == whole


def test_a_project_without_one_is_left_alone(tmp_path: Path):
    assert not mend_locks(tmp_path)
    assert list(tmp_path.iterdir()) == []


def in_git(project: Path) -> None:  # noqa: F811
    run("git", "init", "-q", cwd=project)
    run("git", "add", "dvc.yaml", "dvc.lock", cwd=project)
    run("git", "-c", "user.name=toy", "-c", "user.email=toy@example.org", "commit", "-qm", "Results", cwd=project)


@pytest.mark.parametrize("committed", [True, False])
def test_a_torn_lock_file_is_mended_wherever_it_was_cut(project: Path, committed: bool):  # noqa: F811
    run("dvc", "repro", cwd=project)
    lock = project / "dvc.lock"
    whole = lock.read_text(encoding="utf-8")
    if committed:
        in_git(project)
    for end in (0, 5, 14, 40, whole.index("md5: ") + 5, whole.index("outs:") + 6, len(whole) // 2):
        lock.write_text(whole[:end], encoding="utf-8")
        said = mend_locks(project)
        if not said:  # cut where a shorter one would end: DVC takes it, too
            run("dvc", "status", cwd=project)
            continue
        how = "the committed one is back" if committed else "DVC makes it anew"
        assert said == [f"dvc.lock was torn by a kill; {how}, and what is left of it is in .dvc/tmp/root-dvc.lock.torn"]
        assert (project / ".dvc/tmp/root-dvc.lock.torn").read_text(encoding="utf-8") == whole[:end]
        assert lock.exists() == committed
    run("dvc", "repro", cwd=project)
    assert lock.read_text(encoding="utf-8") == whole


def test_a_lock_file_with_conflicts_or_just_being_written_is_left_alone(
    project: Path,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
):
    lock = project / "dvc.lock"
    lock.write_text("<<<<<<< HEAD\nschema: '2.0'\n", encoding="utf-8")
    assert mend_locks(project) == []
    lock.write_text("schema:", encoding="utf-8")
    monkeypatch.setattr("flows.dvc_lock.time.sleep", lambda _: lock.write_text("schema: '2.0'\n", encoding="utf-8"))
    assert mend_locks(project) == []
    assert lock.read_text(encoding="utf-8") == "schema: '2.0'\n"
