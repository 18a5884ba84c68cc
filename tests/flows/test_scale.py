"""Motion sets on Prefect's task runners: same bytes from each, going on after a kill, clear refusals."""

import signal
import subprocess
import sys
from pathlib import Path

from flows.scale import scale
from reproduction.motions.shards import MotionSet, close_folder, open_folder, write_shard
from robojoule.documents import parse, read_document
from tests.conftest import ROOT, run, wait_for
from tests.reproduction.motions.test_shards import DESCRIPTION


def files(root: Path) -> dict[str, bytes]:
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def made_here(motion_set: MotionSet, root: Path) -> dict[str, bytes]:
    """Files of a set made in this process, its last shard first."""
    for shard in reversed(open_folder(motion_set, root)):
        write_shard(motion_set, root, shard)
    close_folder(motion_set, root)
    return files(root)


def test_tasks_write_the_same_bytes_and_nothing_twice(tmp_path: Path, prefect_server: str):
    motion_set, out = parse(MotionSet, DESCRIPTION, "test"), tmp_path / "threads"
    expected = made_here(motion_set, tmp_path / "here")
    assert len(expected) == 7
    assert scale(motion_set, out, "threads", 2) == 3
    assert files(out) == expected
    assert scale(motion_set, out, "threads", 2) == 0


ASKED = {"motions": 1600, "shard_motions": 100, "seed": 3}


def children(parent: int) -> list[int]:
    """Processes that a process started."""
    tasks = Path(f"/proc/{parent}/task").glob("*/children")
    return [int(pid) for task in tasks for pid in task.read_text().split()]


def test_a_killed_run_goes_on_where_it_stopped(tmp_path: Path, prefect_server: str):
    """Begun by processes, ended by threads; the bytes are those of a plain loop."""
    options = [word for key, value in ASKED.items() for word in (f"--{key.replace('_', '-')}", str(value))]
    command = [sys.executable, "-m", "flows.scale", *options, "--out", str(tmp_path / "set"), "--workers", "2"]
    runs = tmp_path / "set" / "runs"
    with (tmp_path / "log").open("wb") as log:
        process = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=log)
        wait_for("the first shards", lambda: len(list(runs.glob("part-*.parquet"))) >= 3, 120)
        workers = children(process.pid)
        process.send_signal(signal.SIGKILL)
        process.wait()
    wait_for("end of the workers", lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers), 20)
    finished = {path: path.stat().st_mtime_ns for path in runs.glob("part-*.parquet")}
    assert 3 <= len(finished) < 16, "killed too late to show anything"
    assert read_document(tmp_path / "set" / "manifest.json")["shards"] == []

    output = run(*command, "--runner", "threads", cwd=ROOT).stderr
    assert f"{16 - len(finished)} of 16 shards are missing" in output
    assert all(path.stat().st_mtime_ns == written for path, written in finished.items())
    assert not list(runs.glob(".*"))
    motion_set = parse(MotionSet, {**DESCRIPTION, "speed_limits_percent": range(10, 101, 10), **ASKED}, "test")
    assert files(tmp_path / "set") == made_here(motion_set, tmp_path / "again")


def test_bad_input_ends_with_one_sentence_before_anything_starts(tmp_path: Path):
    command = [sys.executable, "-m", "flows.scale", "--motions", "10", "--out", str(tmp_path / "set")]
    failed = run(*command, "--robot", "kuka", cwd=ROOT, code=2)
    assert (
        failed.stderr.startswith("flows.scale: unknown robot 'kuka' (did you mean kuka_kr")
        and failed.stderr.count("\n") == 1
    )
    assert not (tmp_path / "set").exists()
