"""Programs in the background: started once, ended with their children, never taken for another's process."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from flows.desk import services
from flows.service import ProcessFile, Service, answers
from reproduction.layout import Layout
from robojoule.errors import RobojouleError
from tests.conftest import ROOT, free_port, run, wait_for

CHILD = "sleep 60 & echo $! > child; wait"


def service(folder: Path, *command: str, **settings) -> Service:
    return Service("sleeper", command, folder / "desk", folder, **settings)


def start(service: Service) -> bool:
    """Launch it unless it runs, and wait until it is ready; returns whether it was launched."""
    launched = service.launch()
    service.wait(launched)
    return launched


def alive(pid: int) -> bool:
    return psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE


def child_of(folder: Path) -> int:
    wait_for("the child", lambda: (folder / "child").exists() and bool((folder / "child").read_text()), 10)
    return int((folder / "child").read_text())


def test_started_once_and_ended_with_its_children(tmp_path: Path):
    sleeper = service(tmp_path, "bash", "-c", CHILD)
    assert start(sleeper) is True
    first, child = sleeper.process().pid, child_of(tmp_path)
    assert start(sleeper) is False
    assert sleeper.process().pid == first
    assert sleeper.stop() is True
    assert not alive(first) and not alive(child)
    assert sleeper.stop() is False
    assert sleeper.process() is None


def test_what_is_left_of_a_killed_one_is_ended(tmp_path: Path):
    sleeper = service(tmp_path, "bash", "-c", CHILD)
    start(sleeper)
    child = child_of(tmp_path)
    os.kill(sleeper.process().pid, signal.SIGKILL)
    wait_for("its end", lambda: sleeper.process() is None, 10)
    assert alive(child)
    assert sleeper.stop() is True
    assert not alive(child)


def test_one_that_does_not_heed_sigterm_is_killed(tmp_path: Path):
    stubborn = service(tmp_path, "bash", "-c", f"trap '' TERM; {CHILD}", grace_s=0.5)
    start(stubborn)
    child_of(tmp_path)
    pid = stubborn.process().pid
    assert stubborn.stop() is True
    assert not alive(pid)


def test_a_process_that_got_the_same_number_since_is_left_alone(tmp_path: Path):
    """As after a restart of the machine: the file names a number that is now another program's."""
    sleeper = service(tmp_path, "sleep", "60")
    with subprocess.Popen(["sleep", "60"], start_new_session=True) as other:
        sleeper.file.parent.mkdir(parents=True)
        began = psutil.Process(other.pid).create_time()
        sleeper.file.write_text(json.dumps({"pid": other.pid, "started_s": began - 1000.0}), encoding="utf-8")
        assert sleeper.process() is None
        assert sleeper.stop() is False
        assert other.poll() is None
        other.kill()


def test_a_torn_file_names_no_process(tmp_path: Path):
    sleeper = service(tmp_path, "sleep", "60")
    sleeper.file.parent.mkdir(parents=True)
    sleeper.file.write_text('{"pid": 1', encoding="utf-8")
    assert sleeper.process() is None
    assert sleeper.stop() is False


def test_one_that_ends_at_once_says_why(tmp_path: Path):
    failing = service(tmp_path, "bash", "-c", "echo no such store >&2; exit 1", health="http://127.0.0.1:9/health")
    with pytest.raises(RobojouleError, match=r"sleeper ended at once: no such store \(more in .*sleeper\.log\)"):
        start(failing)


def test_one_without_an_address_is_ready_when_it_says_so(tmp_path: Path):
    slow = service(tmp_path, "bash", "-c", "sleep 1; echo looks into it; sleep 60", ready="looks into")
    start(slow)
    assert "looks into it" in slow.log.read_text(encoding="utf-8")
    slow.stop()
    failing = service(tmp_path, "bash", "-c", "echo no such folder >&2; exit 1", ready="looks into")
    with pytest.raises(RobojouleError, match="ended at once: no such folder"):
        start(failing)


def test_what_a_service_manager_started_is_known_and_left_to_it(tmp_path: Path):
    managed = service(tmp_path, "sleep", "60", ready="looks into")
    with subprocess.Popen(["sleep", "60"], start_new_session=True) as other:
        managed.note(ProcessFile.of(other.pid, managed=True))
        assert managed.process().pid == other.pid
        assert start(managed) is False
        assert managed.stop() is False and managed.process() is not None
        assert other.poll() is None
        other.kill()
        other.wait()
        assert managed.process() is None
        assert managed.stop() is False and managed.noted() is None


def test_a_program_that_becomes_a_service_is_noted(tmp_path: Path):
    """As systemd starts it; the number stays when it becomes the program itself."""
    words = [sys.executable, "-m", "flows.desk", "run", "inbox-watch", "--root", str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    watch = next(one for one in services(Layout(tmp_path)) if one.name == "inbox-watch")
    printed = tmp_path / "log"
    with printed.open("wb") as log, subprocess.Popen(words, cwd=ROOT, env=environment, stdout=log) as process:
        wait_for("the watch", lambda: b"looks into" in printed.read_bytes(), 120)
        assert watch.process().pid == process.pid and watch.noted().managed
        again = run(*words, cwd=ROOT, code=1).stderr
        assert again == "flows.desk: inbox-watch runs already\n"
        process.terminate()
    assert watch.process() is None


def test_a_place_that_another_program_has_is_not_taken(tmp_path: Path):
    port = free_port()
    server = [sys.executable, "-m", "http.server", str(port), "--bind", "127.0.0.1"]
    with subprocess.Popen(server, cwd=tmp_path, stderr=subprocess.DEVNULL) as other:
        mine = service(tmp_path, *server, health=f"http://127.0.0.1:{port}/")
        wait_for("the other program", lambda: answers(mine.health), 20)
        with pytest.raises(RobojouleError, match="answered by a program that was not started from here"):
            start(mine)
        assert mine.noted() is None
        assert other.poll() is None
        other.kill()
