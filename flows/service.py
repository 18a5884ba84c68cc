"""A program that goes on in the background: started once, found again, and ended with all that it started.

A file names its process and the moment at which that began, so that a number which another process got since is not
taken for it.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import psutil
from pydantic import Field

from robojoule.documents import Document, load, write_document
from robojoule.errors import InputError, RobojouleError

_SAME_START_S = 2.0  # the clock's origin, from which starts are counted, may be shifted a little
_POLL_S = 0.25


class ProcessFile(Document):
    """What is kept of a started process."""

    pid: int = Field(ge=1)
    started_s: float = Field(ge=0, description="Moment of its start, in seconds since 1970. [s]")
    managed: bool = Field(default=False, description="Whether a service manager started it, which also ends it.")

    @classmethod
    def of(cls, pid: int, *, managed: bool = False) -> ProcessFile:
        """What is kept of a process that runs."""
        return cls(pid=pid, started_s=psutil.Process(pid).create_time(), managed=managed)


def process_of(file: ProcessFile) -> psutil.Process | None:
    """The process, unless it ended or its number is another's by now."""
    with contextlib.suppress(psutil.Error):
        process = psutil.Process(file.pid)
        began = abs(process.create_time() - file.started_s) < _SAME_START_S
        if began and process.status() != psutil.STATUS_ZOMBIE:
            return process
    return None


def free_port() -> int:
    """A port of the loopback interface on which nobody listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def answers(url: str, timeout_s: float = 5.0) -> bool:
    """Whether a server answers an address."""
    try:
        with urllib.request.urlopen(url, timeout=timeout_s) as reply:
            return bool(reply.status == 200)
    except (urllib.error.URLError, OSError):
        return False


@dataclass(frozen=True)
class Service:
    """A program of the desk.

    Attributes:
        name: How messages and files name it.
        command: Its words.
        folder: Folder of the desk; process files and logs are below it.
        cwd: Where it runs.
        environment: Variables beside those of this process.
        health: Address that answers when it is ready.
        ready: What it prints when it is ready, where it has no such address; without both it is ready when it runs.
        patience_s: Longest time until it is ready. [s]
        grace_s: Longest time for its end after SIGTERM. [s]
    """

    name: str
    command: Sequence[str]
    folder: Path
    cwd: Path
    environment: Mapping[str, str] = field(default_factory=dict)
    health: str | None = None
    ready: str | None = None
    patience_s: float = 300.0
    grace_s: float = 60.0

    @property
    def file(self) -> Path:
        """Where its process is noted."""
        return self.folder / "run" / f"{self.name}.json"

    @property
    def log(self) -> Path:
        """What it printed since its last start."""
        return self.folder / "log" / f"{self.name}.log"

    def noted(self) -> ProcessFile | None:
        """What its process file says, whether or not that process lives."""
        try:
            return load(ProcessFile, self.file) if self.file.exists() else None
        except InputError:  # torn by hand: nothing is known of a process
            return None

    def process(self) -> psutil.Process | None:
        """Its running process."""
        noted = self.noted()
        return process_of(noted) if noted else None

    def launch(self) -> bool:
        """Start it unless it runs.

        Returns:
            Whether it was started.

        Raises:
            RobojouleError: Another program has its place.
        """
        if self.process() is not None:
            return False
        self.stop()  # what is left of one that was killed
        if self.health and answers(self.health):
            raise RobojouleError(f"{self.health} is answered by a program that was not started from here; end it first")
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with self.log.open("wb") as log:
            started = subprocess.Popen(
                self.command,
                cwd=self.cwd,
                env={**os.environ, **self.environment},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self.note(ProcessFile.of(started.pid))
        return True

    def note(self, process: ProcessFile) -> None:
        """Write its process file."""
        write_document(self.file, process.model_dump(mode="json"))

    def wait(self, launched: bool = True) -> None:
        """Wait until it is ready.

        Args:
            launched: Whether it was launched just now; of one that ran already, nothing but an address would tell.

        Raises:
            RobojouleError: It ended, or it is not ready in time.
        """
        if not launched and self.health is None:
            return
        end = time.monotonic() + self.patience_s
        while not self._is_ready():
            if self.process() is None:
                raise RobojouleError(f"{self.name} ended at once: {self._last_line()} (more in {self.log})")
            if time.monotonic() > end:
                place = f" at {self.health}" if self.health else ""
                raise RobojouleError(f"{self.name} does not answer{place}; see {self.log}")
            time.sleep(_POLL_S)

    def _is_ready(self) -> bool:
        if self.health is not None:
            return answers(self.health)
        noted = self.noted()
        if self.ready is None or (noted is not None and noted.managed):  # that one prints to another log
            return True
        return self.ready in self._printed()

    def _printed(self) -> str:
        try:
            return self.log.read_text(encoding="utf-8", errors="replace")
        except FileNotFoundError:  # removed, or of a service manager
            return ""

    def _last_line(self) -> str:
        lines = self._printed().split("\n")
        return next((line.strip() for line in reversed(lines) if line.strip()), "no output")

    def stop(self) -> bool:
        """End it with all processes of its session and all that it started; first by SIGTERM, then by SIGKILL.

        One that a service manager started is left to it.

        Returns:
            Whether anything had to be ended.
        """
        noted = self.noted()
        if noted is None:
            self.file.unlink(missing_ok=True)
            return False
        if noted.managed:
            if process_of(noted) is None:
                self.file.unlink(missing_ok=True)
            return False
        leader, before = process_of(noted), _family(noted)
        if leader is not None:
            with contextlib.suppress(psutil.Error):
                leader.terminate()
                leader.wait(self.grace_s)
        family = [process for process in before | _family(noted) if process.is_running()]
        for process in family:
            with contextlib.suppress(psutil.Error):
                process.kill()
        psutil.wait_procs(family, timeout=10.0)
        self.file.unlink(missing_ok=True)
        return leader is not None or bool(family)


def _family(noted: ProcessFile) -> set[psutil.Process]:
    """The processes of a service: those of its session, and their children, also where it was killed itself."""
    found: set[psutil.Process] = set()
    if psutil.pid_exists(noted.pid) and process_of(noted) is None and not _is_zombie(noted.pid):
        return found  # a number is given anew only when no session bears it any more: this one is another's
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, ProcessLookupError, PermissionError):
            if os.getsid(process.pid) == noted.pid:
                found |= {process, *process.children(recursive=True)}
    return found


def _is_zombie(pid: int) -> bool:
    with contextlib.suppress(psutil.Error):
        return bool(psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)
    return True
