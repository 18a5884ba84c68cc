"""The watch on the inbox: each log once, when it is whole, and again where it could not be told."""

import os
import shutil
from pathlib import Path

import pytest

from flows.inbox import EVENT, EVERY_S, SETTLED_S, Watch, tell_server, whole_logs
from tests.conftest import free_port, wait_for
from tests.servers import ask


def write(path: Path, text: str, at_s: int) -> None:
    path.write_text(text, encoding="utf-8")
    os.utime(path, (at_s, at_s))


def test_a_log_is_told_of_once_when_it_does_not_change_any_more(tmp_path: Path):
    told: list[str] = []
    watch = Watch(tmp_path / "inbox", lambda path: told.append(path.name))
    watch.look()  # there is no folder yet
    (tmp_path / "inbox").mkdir()
    log = tmp_path / "inbox/monday.csv"
    for at_s, text in enumerate(("a", "ab", "abc")):  # it grows while it is copied
        write(log, text, 1000 + at_s)
        watch.look()
    assert told == []
    for name in (".hidden.csv", "notes.txt"):
        write(tmp_path / "inbox" / name, "no log", 1000)
    (tmp_path / "inbox/accepted").mkdir()
    for _ in range(3):
        watch.look()
    assert told == ["monday.csv"]
    shutil.move(log, tmp_path / "inbox/accepted")
    watch.look()
    write(log, "abc", 1002)  # one of the same name
    for _ in range(3):
        watch.look()
    write(log, "abcd", 1003)
    for _ in range(3):
        watch.look()
    assert told == ["monday.csv"] * 3


def test_what_could_not_be_told_is_told_at_the_next_look(tmp_path: Path):
    told: list[str] = []

    def tell(path: Path) -> None:
        told.append(path.name)
        if len(told) == 1:
            raise ConnectionError

    watch = Watch(tmp_path, tell)
    for name in ("a.csv", "b.csv"):
        write(tmp_path / name, "", 1000)
    watch.look()
    with pytest.raises(ConnectionError):
        watch.look()
    for _ in range(2):
        watch.look()
    assert told == ["a.csv", "b.csv", "a.csv"]


def test_a_log_that_is_being_copied_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for name in ("whole.csv", "growing.csv"):
        write(tmp_path / name, "a", 1000)
    monkeypatch.setattr("flows.inbox.time.sleep", lambda _: write(tmp_path / "growing.csv", "ab", 1000))
    assert whole_logs(tmp_path, settled_s=0.0) == [tmp_path / "whole.csv"]
    assert whole_logs(tmp_path / "nowhere") == []


def test_a_copy_that_stalls_is_left(tmp_path: Path):
    """Whatever moment its copy set as that of its last change."""
    write(tmp_path / "monday.csv", "half", 1000)
    assert whole_logs(tmp_path, pause_s=0.1) == []
    wait_for("the log", lambda: whole_logs(tmp_path, pause_s=0.1) == [tmp_path / "monday.csv"], 60)
    assert SETTLED_S < EVERY_S  # else nobody would take what the watch tells of before the schedule looks


def test_the_server_is_told(prefect_server: str):
    tell_server(Path("tuesday.csv"))

    def events() -> list[str]:
        found = ask(prefect_server, "events/filter", {"filter": {"event": {"name": [EVENT]}}})["events"]
        return [one["resource"]["prefect.resource.id"] for one in found]

    wait_for("the event", lambda: "robojoule.log.tuesday.csv" in events(), 60)


def test_a_server_that_is_away_is_an_error(monkeypatch: pytest.MonkeyPatch):
    from prefect.settings import PREFECT_API_URL, temporary_settings

    with temporary_settings({PREFECT_API_URL: f"http://127.0.0.1:{free_port()}/api"}), pytest.raises(OSError):
        tell_server(Path("tuesday.csv"))
