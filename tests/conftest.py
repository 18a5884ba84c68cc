"""Fixtures of the whole suite: a toy copy of the project, reproduced once, and a Prefect server, started once."""

import contextlib
import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from xdist.scheduler import LoadFileScheduling

import stages  # noqa: F401  before numpy: this process and those that tests start compute with the same instructions
from reproduction.settings import apply_settings
from tests.toy import ROOT, make_toy

# Before anything imports Prefect or MLflow: nothing of the user's settings is read or written, nothing is looked up.
_PREFECT_HOME = tempfile.mkdtemp(prefix="prefect-home-")
apply_settings()
os.environ.update(
    PREFECT_HOME=_PREFECT_HOME,
    PREFECT_SERVER_SERVICES_SCHEDULER_LOOP_SECONDS="5",  # looks for new schedules every 60 s otherwise
    PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW="ignore",
    PATH=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)]),
)

from flows.service import answers, free_port  # noqa: E402  after the settings; for tests, too

# Fixtures that take long to set up and serve tests of several files, as a parameter of a test.
EXPENSIVE = re.compile(r"\b(toy_project|reproduced|prefect_server): ")


# What starts servers and kills runs, by who shares it: each takes about a third of the time of all.
GROUPS = {
    "services": tuple(f"tests/flows/test_{name}.py" for name in ("schedule", "events", "desk", "team")),
    "kills": (
        "tests/chaos/",
        "tests/test_dvc_use.py",
        "tests/flows/test_clusters.py",
        "tests/flows/test_measurements.py",
    ),
}
LONGEST = (*GROUPS, "pipeline")


@cache
def worker_group(file: str) -> str:
    """Tests of one group run in one worker: those of a file, and all of the files that need an expensive fixture.

    The latter are some groups, so that workers share them.
    """
    if not EXPENSIVE.search((ROOT / file).read_text(encoding="utf-8")):
        return file
    return next((name for name, files in GROUPS.items() if file.startswith(files)), "pipeline")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One worker more than processors: tests of servers wait for most of their time."""
    return len(os.sched_getaffinity(0)) + 1 if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadFileScheduling:
    """By group and in the order of collection; the group marks of pytest-xdist 3.8 have no effect with pytest 9.2."""

    class GroupScheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return worker_group(super()._split_scope(nodeid))

    config.option.loadscopereorder = False
    return GroupScheduling(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The groups that take the longest come first."""

    def place(item: pytest.Item) -> int:
        group = worker_group(os.path.relpath(item.path, ROOT))
        return LONGEST.index(group) if group in LONGEST else len(LONGEST)

    items.sort(key=place)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """With ROBOJOULE_NO_SKIPS=1, as on a build server, a test that is skipped counts as failed."""
    report = yield
    if os.environ.get("ROBOJOULE_NO_SKIPS") == "1" and report.skipped and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"no test may be skipped here: {report.longrepr}"
    return report


def pytest_unconfigure() -> None:
    shutil.rmtree(_PREFECT_HOME, ignore_errors=True)


def run(*command: str, cwd: Path, code: int | None = 0) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; its output is part of the failure if it does not end with `code`."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert code is None or done.returncode == code, f"{command}: exit {done.returncode}\n{done.stdout}{done.stderr}"
    return done


@pytest.fixture(scope="session")
def toy_project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project in a Git repository of its own, with parameters for a few trees; the name has a space."""
    return make_toy(tmp_path_factory.mktemp("toy") / "robo joule")


@pytest.fixture(scope="session")
def reproduced(toy_project: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The toy project after `dvc repro`; the first worker that needs it makes it for all."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        run("dvc", "repro", cwd=toy_project)
        return toy_project
    made = tmp_path_factory.getbasetemp().parent / "reproduced"
    with made.with_suffix(".lock").open("w") as guard:
        fcntl.flock(guard, fcntl.LOCK_EX)
        if not made.exists():
            run("dvc", "repro", cwd=toy_project)
            shutil.copytree(toy_project, made.with_suffix(".part"), symlinks=True)
            made.with_suffix(".part").rename(made)
            return toy_project
    shutil.rmtree(toy_project)
    shutil.copytree(made, toy_project, symlinks=True)
    return toy_project


def wait_for(what: str, ready: Callable[[], bool], seconds: float) -> None:
    """Poll until `ready` is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if ready():
            return
        time.sleep(0.25)
    raise AssertionError(f"{what}: not within {seconds:g} s")


class Background:
    """Processes that run beside a test; stopped in reverse order, each with everything it started."""

    def __init__(self) -> None:
        self._processes: list[subprocess.Popen[bytes]] = []

    def start(self, command: str, cwd: Path, log: Path) -> subprocess.Popen[bytes]:
        with log.open("wb") as out:
            process = subprocess.Popen(
                ["bash", "-c", f"exec {command}"], cwd=cwd, stdout=out, stderr=out, start_new_session=True
            )
        self._processes.append(process)
        return process

    def stop(self) -> None:
        for process in reversed(self._processes):
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(timeout=5)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@pytest.fixture
def background() -> Iterator[Background]:
    processes = Background()
    yield processes
    processes.stop()


@pytest.fixture(scope="session")
def prefect_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a Prefect server on the loopback interface, in use by this process and those that it starts."""
    from prefect.settings import PREFECT_API_URL, temporary_settings

    from flows.server import drain

    folder = tmp_path_factory.mktemp("prefect-server")
    port = free_port()
    url = f"http://127.0.0.1:{port}/api"
    processes = Background()
    os.environ["PREFECT_API_URL"] = url
    processes.start(f"prefect server start --host 127.0.0.1 --port {port}", folder, folder / "server.log")
    try:
        wait_for("Prefect server", lambda: answers(f"{url}/health"), 180)
        with temporary_settings({PREFECT_API_URL: url}):
            yield url
            drain()
    finally:
        del os.environ["PREFECT_API_URL"]
        processes.stop()
