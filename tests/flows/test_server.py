"""The server of a command started by hand: that which is named, or one of its own with a store of its own."""

import os
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import psutil
import pytest
from prefect.settings import (
    PREFECT_API_URL,
    PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS,
    temporary_settings,
)

from flows import own_server
from flows.server import prefect_server as server_for
from flows.service import answers
from reproduction.layout import Layout
from robojoule.errors import RobojouleError
from tests.conftest import ROOT, free_port, run


def test_a_server_that_is_named_is_used(tmp_path: Path, prefect_server: str):
    with server_for(Layout(tmp_path)) as url:
        assert url == prefect_server
    assert answers(f"{prefect_server}/health")
    assert list(tmp_path.iterdir()) == []


def test_one_that_does_not_answer_is_one_sentence(tmp_path: Path):
    url = f"http://127.0.0.1:{free_port()}/api"
    with (
        temporary_settings({PREFECT_API_URL: url}),
        pytest.raises(RobojouleError, match=f"no Prefect server answers at {url}; start it"),
        server_for(Layout(tmp_path)),
    ):
        pass


def test_one_that_is_too_slow_is_one_sentence_that_says_what_helps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    started, kind = [], own_server.OwnServer
    monkeypatch.setattr(own_server, "OwnServer", lambda *words: started.append(words) or kind(*words))
    with (
        temporary_settings({PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS: 0}, restore_defaults={PREFECT_API_URL}),
        pytest.raises(
            RobojouleError, match="did not answer within 0 s; a busy machine may need a larger PREFECT_SERVER_"
        ),
        server_for(Layout(tmp_path)),
    ):
        pass
    assert len(started) == 1


def test_else_one_is_started_with_a_store_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Neither the store of the desk nor that of the user's profile is touched; an empty one is kept for the next."""
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    layout = Layout(tmp_path)
    with temporary_settings(restore_defaults={PREFECT_API_URL}):
        with server_for(layout) as url:
            assert answers(f"{url}/health") and os.environ["PREFECT_API_URL"] == url
            with ThreadPoolExecutor(1) as thread:  # else it would start one more server
                assert thread.submit(PREFECT_API_URL.value).result() == url
        assert not answers(f"{url}/health")
    assert "PREFECT_API_URL" not in os.environ
    (empty,) = layout.desk_dir.rglob("*.db")
    with sqlite3.connect(empty) as store:
        assert store.execute("SELECT count(*) FROM flow_run").fetchall() == [(0,)]


def test_flows_do_not_load_the_code_of_the_server():
    """It takes as long as the start of one, in this process and in every worker."""
    code = "import sys, flows.pipeline, flows.scale, flows.cells, flows.studies; print(*sys.modules)"
    assert "prefect.server.api.server" not in run(sys.executable, "-c", code, cwd=ROOT).stdout.split()


@pytest.mark.parametrize(
    "words", [["--help"], ["--root", "nowhere"], ["--no-such-option"], ["--runner", "dask", "--address", "nowhere"]]
)
def test_a_server_that_was_started_ahead_ends_with_its_command(words: list[str], tmp_path: Path):
    """Commands that load Prefect start it before that; what ends early leaves neither a process nor a folder."""
    environment = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
    environment["TMPDIR"] = str(tmp_path)
    command = [sys.executable, "-m", "flows.pipeline", *words]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == (0 if words == ["--help"] else 2), done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []
    assert [one for one in psutil.process_iter() if _in(one, tmp_path)] == []


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_server_that_was_started_ahead_ends_with_a_command_that_is_ended_while_it_loads(
    ending: signal.Signals, tmp_path: Path
):
    environment = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
    environment["TMPDIR"] = str(tmp_path)
    command = subprocess.Popen(
        [sys.executable, "-m", "flows.scale", "--motions", "1000000", "--out", str(tmp_path / "set")],
        cwd=ROOT,
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # as a terminal starts it
    )
    end = time.monotonic() + 60.0
    while not any(_in(one, tmp_path) for one in psutil.process_iter()) and time.monotonic() < end:
        time.sleep(0.02)
    if ending == signal.SIGINT:
        os.killpg(command.pid, ending)
    else:
        command.send_signal(ending)
    _, said = command.communicate(timeout=60)
    assert command.returncode == -ending
    assert said == ("flows.scale: interrupted\n" if ending == signal.SIGINT else "")
    while (left := [*tmp_path.iterdir(), *(one for one in psutil.process_iter() if _in(one, tmp_path))]) and (
        time.monotonic() < end
    ):
        time.sleep(0.1)
    assert left == []


@pytest.mark.parametrize("kept", [b"", b"no store", b"SQLite format 3\0" + bytes(5000)])
def test_an_empty_store_that_is_damaged_is_made_again(kept: bytes, tmp_path: Path):
    empty = tmp_path / ".desk/empty" / f"prefect-{version('prefect')}.db"
    empty.parent.mkdir(parents=True)
    empty.write_bytes(kept)
    server = own_server.OwnServer(Layout(tmp_path), {})
    try:
        assert server.wait(time.monotonic() + 60.0)
    finally:
        server.end()
    assert own_server._copy(empty, tmp_path / "copy.db")


def test_no_room_for_a_store_is_one_sentence_of_the_command_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    own_server.start_ahead(["python", "-m", "flows.studies", "--root", str(tmp_path)])
    assert own_server._ahead == []
    with (
        temporary_settings(restore_defaults={PREFECT_API_URL}),
        pytest.raises(RobojouleError, match=r"^no folder can be made for the store of a Prefect server \(No such file"),
        server_for(Layout(tmp_path)),
    ):
        pass


def _in(process: psutil.Process, folder: Path) -> bool:
    """Whether a process has a store below a folder."""
    try:
        return str(folder) in process.environ().get("PREFECT_SERVER_DATABASE_CONNECTION_URL", "")
    except (psutil.Error, OSError):
        return False


def test_the_server_that_was_started_ahead_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    own_server.start_ahead(["python", "-m", "flows.desk", "up"])
    assert own_server._ahead == []
    own_server.start_ahead(["python", "-m", "flows.studies", "--force", "--root", str(tmp_path)])
    (ahead,) = own_server._ahead
    with temporary_settings(restore_defaults={PREFECT_API_URL}), server_for(Layout(tmp_path)) as url:
        assert url == ahead.url and own_server._ahead == []
    assert not answers(f"{url}/health")


def test_a_server_that_is_named_in_a_profile_is_used_instead(
    tmp_path: Path, prefect_server: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    own_server.start_ahead(["python", "-m", "flows.pipeline", "--root", str(tmp_path)])
    (ahead,) = own_server._ahead
    with temporary_settings({PREFECT_API_URL: prefect_server}), server_for(Layout(tmp_path)) as url:
        assert url == prefect_server and own_server._ahead == []
    assert not answers(f"{ahead.url}/health")
