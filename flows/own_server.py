"""A Prefect server of this process: on the loopback interface, without a page, gone when this process is.

Prefect has such a server, too, but to start it loads the server's code into this process and into every worker that
imports the flow: for each of them that takes as long as the start of the server itself.

Making a store takes longer than the start of a server, so that an empty one is kept below the project and copied.
"""

from __future__ import annotations

import argparse
import atexit
import contextlib
import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from flows import lifeline
from flows.service import answers, free_port
from reproduction.layout import Layout
from robojoule.documents import atomic_path, reason
from robojoule.errors import RobojouleError

COMMANDS = frozenset(f"flows.{name}" for name in ("cells", "pipeline", "scale", "studies"))  # report to one

_ATTEMPTS = 3  # another process may take the port in between
_POLL_S = 0.1


class OwnServer:
    """A server that was started, with a store of its own.

    Args:
        layout: Folder of the project; the empty store is kept there.
        settings: Variables beside those of this process.

    Raises:
        RobojouleError: There is no room for its store.
    """

    def __init__(self, layout: Layout, settings: Mapping[str, str]) -> None:
        self._empty = layout.desk_dir / "empty" / f"prefect-{version('prefect')}.db"
        try:
            self._folder = tempfile.TemporaryDirectory(prefix="prefect-", ignore_cleanup_errors=True)
        except OSError as error:
            raise RobojouleError(f"no folder can be made for the store of a Prefect server ({reason(error)})") from None
        self._store = Path(self._folder.name) / "prefect.db"
        try:
            self._keeps = not _copy(self._empty, self._store)
        except OSError as error:
            self._folder.cleanup()
            problem = f"the empty store {self._empty} cannot be copied to {self._store.parent} ({reason(error)})"
            raise RobojouleError(problem) from None
        port = free_port()
        self.url = f"http://127.0.0.1:{port}/api"
        words = f"--factory prefect.server.api.server:create_app --host 127.0.0.1 --port {port} --lifespan on"
        server = ["-m", "uvicorn", *words.split(), "--log-level", "error"]
        self._process = subprocess.Popen(
            [sys.executable, str(Path(lifeline.__file__)), sys.executable, *server],
            stdin=subprocess.PIPE,
            process_group=0,  # of its own from the start: Ctrl-C is for the command, which ends it
            env={
                **os.environ,
                **settings,
                lifeline.FOLDER: self._folder.name,
                "PREFECT_SERVER_DATABASE_CONNECTION_URL": f"sqlite+aiosqlite:///{self._store}",
                "PREFECT_UI_ENABLED": "0",
                "PREFECT__SERVER_EPHEMERAL": "1",
                "PREFECT__SERVER_FINAL": "1",
            },
        )

    def wait(self, end: float) -> bool:
        """Wait until it answers, until it ended, or until a time of `time.monotonic`; returns whether it answers."""
        while self._process.poll() is None and time.monotonic() < end:
            if answers(f"{self.url}/health"):
                if self._keeps:
                    # A folder that cannot be written, or is full: slower next time.
                    with contextlib.suppress(RobojouleError, sqlite3.Error):
                        _keep(self._store, self._empty)
                return True
            time.sleep(_POLL_S)
        return False

    def end(self) -> None:
        """End it; its store goes with it."""
        lifeline.cut(self._process)
        self._folder.cleanup()


_ahead: list[OwnServer] = []  # the one that was started ahead, until it is taken


def start_ahead(words: Sequence[str]) -> None:
    """Start the server of a command before that loads Prefect: both take seconds, here of different processors.

    Args:
        words: Those by which Python was started. Nothing happens if they are none of `COMMANDS`, or if the environment
            names a server. Where the command finds one named elsewhere, or ends early, this one is ended unused.
    """
    command = words[2] if len(words) > 2 and words[1] == "-m" else None
    if command not in COMMANDS or "PREFECT_API_URL" in os.environ or {"-h", "--help"} & set(words):
        return
    parser = argparse.ArgumentParser(add_help=False, exit_on_error=False)
    parser.add_argument("--root", type=Path, default=Path())
    # The command itself says what is wrong with its words, or that there is no room.
    with contextlib.suppress(argparse.ArgumentError, RobojouleError):
        _ahead.append(OwnServer(Layout(parser.parse_known_args(list(words[3:]))[0].root), {}))
        atexit.register(drop_ahead)


def drop_ahead() -> None:
    """End the server that was started ahead, if nobody took it."""
    while _ahead:
        _ahead.pop().end()


@contextmanager
def own_server(layout: Layout) -> Iterator[str]:
    """Start a server with the settings of this process, or take the one that was started ahead; and end it.

    Args:
        layout: Folder of the project; the empty store is kept there.

    Yields:
        Its address.

    Raises:
        RobojouleError: It does not start.
    """
    from prefect.settings import PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS, get_current_settings

    settings = get_current_settings().to_environment_variables(exclude_unset=True)
    patience_s = PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS.value()
    end = time.monotonic() + patience_s
    for _ in range(_ATTEMPTS):
        server = _ahead.pop() if _ahead else OwnServer(layout, settings)
        try:
            if server.wait(end):
                yield server.url
                return
        finally:
            server.end()
        if time.monotonic() >= end:
            raise RobojouleError(
                f"the Prefect server of this command did not answer within {patience_s} s; a busy machine may need "
                "a larger PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS"
            )
    raise RobojouleError("the Prefect server of this command did not start; what it says is above")


def _copy(empty: Path, store: Path) -> bool:
    """Copy the empty store; returns whether there is one, and it is whole: else a server makes its own."""
    if not empty.is_file():
        return False
    shutil.copyfile(empty, store)
    try:
        with contextlib.closing(sqlite3.connect(store)) as copied:
            is_whole = bool(copied.execute("PRAGMA quick_check").fetchone() == ("ok",))
            copied.execute("SELECT version_num FROM alembic_version").fetchone()
    except sqlite3.Error:
        is_whole = False
    if not is_whole:
        store.unlink()
    return is_whole


def _keep(store: Path, empty: Path) -> None:
    """Copy a store that is in use, whole or not at all."""
    with (
        atomic_path(empty) as path,
        contextlib.closing(sqlite3.connect(store)) as source,
        contextlib.closing(sqlite3.connect(path)) as target,
    ):
        source.backup(target)
