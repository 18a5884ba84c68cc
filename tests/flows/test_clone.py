"""Clones in which runs work: removed after use, and after the end of whoever made them."""

import os
import subprocess
from pathlib import Path

import psutil

from flows.clone import scratch_clone
from flows.service import ProcessFile
from reproduction.layout import Layout
from robojoule.documents import write_document


def left(clones: Path, name: str, process: ProcessFile) -> Path:
    """A clone that a process made."""
    (clones / name).mkdir(parents=True)
    (clones / name / "file").touch()
    write_document(clones / f"{name}.json", process.model_dump(mode="json"))
    return clones / name


def test_clones_of_processes_that_are_gone_are_removed_and_nothing_else(toy_project: Path):
    clones = Layout(toy_project).desk_dir / "clones"
    with subprocess.Popen(["sleep", "600"]) as other:
        lives = left(clones, "lives", ProcessFile.of(other.pid))
        # Its number is another program's by now.
        gone = left(clones, "gone", ProcessFile(pid=os.getpid(), started_s=psutil.boot_time() + 1.0))
        (clones / "notes of somebody").mkdir()
        (clones / ".half.json").touch()  # the note of a clone that is just being made
        with scratch_clone(toy_project) as one, scratch_clone(toy_project) as two:
            assert one != two and (one / "dvc.yaml").exists() and (two / "dvc.yaml").exists()
            assert lives.exists() and not gone.exists() and (clones / ".half.json").exists()
        assert not one.exists() and not two.exists()
        other.kill()
        other.wait()
        with scratch_clone(toy_project):
            assert not lives.exists()
    (clones / ".half.json").unlink()
    assert [path.name for path in clones.iterdir()] == ["notes of somebody"]
    (clones / "notes of somebody").rmdir()
