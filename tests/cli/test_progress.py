"""The sign of life: on terminals, after a while, and gone at the end."""

import io
import re
import time
from contextlib import redirect_stderr

import pytest

from robojoule.cli import _progress
from robojoule.progress import tell


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def until(terminal: io.StringIO, pattern: str) -> None:
    """Wait for a text, by its pattern."""
    end = time.monotonic() + 60.0
    while re.search(pattern, terminal.getvalue()) is None:
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    monkeypatch.setattr(_progress, "SILENT_S", 0.01)
    return Terminal()


def test_long_work_is_told_and_the_line_goes(terminal):
    with redirect_stderr(terminal), _progress.sign_of_life("robojoule optimize"):
        until(terminal, r"\rrobojoule optimize: \d+ s")
    assert terminal.getvalue().endswith(" \r")


def test_what_is_done_and_the_time_left_are_told(terminal):
    with redirect_stderr(terminal), _progress.sign_of_life("robojoule optimize"):
        tell("profiles", 0, 4)
        until(terminal, "profiles: 0 of 4")
        tell("profiles", 2.5, 4)
        until(terminal, r"profiles: 2 of 4, \d+ s left")
        tell("profiles", 4, 4)
        before = len(terminal.getvalue())
        while "optimize: " not in terminal.getvalue()[before:]:
            time.sleep(0.01)
    assert "profiles" not in terminal.getvalue()[before:]


def test_short_work_is_silent(terminal, monkeypatch):
    monkeypatch.setattr(_progress, "SILENT_S", 600.0)
    with redirect_stderr(terminal), _progress.sign_of_life("robojoule optimize"):
        pass
    assert terminal.getvalue() == ""


def test_an_error_ends_it(terminal):
    with (
        pytest.raises(ValueError, match="wrong"),
        redirect_stderr(terminal),
        _progress.sign_of_life("robojoule optimize"),
    ):
        until(terminal, r"optimize: \d+ s")
        raise ValueError("wrong")
    assert terminal.getvalue().endswith(" \r")


def test_files_and_pipes_get_nothing(monkeypatch):
    plain = io.StringIO()
    monkeypatch.setattr(_progress, "SILENT_S", 0.0)
    with redirect_stderr(plain), _progress.sign_of_life("robojoule optimize"):
        time.sleep(0.05)
    assert plain.getvalue() == ""
