"""`desk.env`: one file that Python, shells and systemd read alike."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from reproduction.settings import SETTINGS, address, read_settings
from robojoule.documents import write_document
from robojoule.errors import InputError

ROOT = Path(__file__).parents[2]


def test_a_shell_reads_the_same():
    command = f"set -a; . {SETTINGS}; env"
    done = subprocess.run(["env", "-i", "sh", "-c", command], capture_output=True, text=True, check=True)
    shown = dict(line.split("=", 1) for line in done.stdout.splitlines())
    assert read_settings().items() <= shown.items()


def activated(folder: Path, more: str = "", **environment: str) -> dict[str, str]:
    """What the environment of a shell says after `. deploy/activate` in a project's folder, with more settings."""
    for name in ("deploy/activate", "desk.env"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    with (folder / "desk.env").open("a", encoding="utf-8") as settings:
        settings.write(more)
    (folder / ".venv/bin").mkdir(parents=True, exist_ok=True)
    (folder / ".venv/bin/activate").touch()
    words = ["env", "-i", f"PATH={os.environ['PATH']}", *(f"{name}={value}" for name, value in environment.items())]
    done = subprocess.run(
        [*words, "sh", "-ec", ". deploy/activate; env"], cwd=folder, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return dict(line.split("=", 1) for line in done.stdout.splitlines())


def test_an_activated_shell_has_the_settings_but_what_it_says_already_wins(tmp_path: Path):
    expected = read_settings() | {"MLFLOW_PORT": "5001", "DO_NOT_TRACK": ""}
    found = activated(tmp_path, MLFLOW_PORT="5001", DO_NOT_TRACK="")
    assert expected.items() <= found.items()
    assert "MLFLOW_TRACKING_URI" not in found and "_name" not in found


def test_an_activated_shell_reads_settings_to_their_end(tmp_path: Path):
    more = "\n# of the team\nONE=two words\nTOKEN=abc="
    found = activated(tmp_path, more)
    assert (found["ONE"], found["TOKEN"]) == ("two words", "abc=")
    assert "_line" not in found


def test_an_activated_shell_knows_the_servers_that_run(tmp_path: Path):
    (tmp_path / ".desk/run").mkdir(parents=True)
    for name, pid in (("prefect-server", os.getpid()), ("mlflow-server", 2**22 + 1)):  # more than a number can be
        write_document(tmp_path / f".desk/run/{name}.json", {"pid": pid, "started_s": 1.0})
    found = activated(tmp_path, PREFECT_SERVER_API_PORT="4300")
    assert found["PREFECT_API_URL"] == "http://127.0.0.1:4300/api"
    assert "MLFLOW_TRACKING_URI" not in found


def test_everything_listens_here_alone_and_reports_nothing():
    found = read_settings()
    assert {found[name] for name in found if name.endswith("_HOST")} == {"127.0.0.1"}
    quiet = {"DO_NOT_TRACK", "PREFECT_SERVER_ANALYTICS_ENABLED", "MLFLOW_DISABLE_TELEMETRY", "DVC_NO_ANALYTICS"}
    assert quiet | {"RAY_USAGE_STATS_ENABLED"} <= set(found)


def test_the_tools_take_the_settings_as_meant(tmp_path: Path):
    """Each by its own function, in a process of its own whose environment says nothing else."""
    code = """
import flows
from mlflow.telemetry.utils import is_telemetry_disabled
from prefect._internal.analytics.enabled import is_telemetry_enabled
from prefect.settings import get_current_settings
from dvc.analytics import is_enabled
server = get_current_settings().server
print(is_telemetry_disabled(), is_telemetry_enabled(), server.analytics_enabled, server.api.port, is_enabled())
"""
    variables = {name: value for name, value in os.environ.items() if name not in read_settings() and name != "CI"}
    variables["PREFECT_HOME"] = str(tmp_path)
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=variables, capture_output=True, text=True)
    assert done.stdout.split() == ["True", "False", "False", "4200", "False"], done.stderr


def test_what_the_environment_says_wins(monkeypatch: pytest.MonkeyPatch):
    assert address("mlflow") == "http://127.0.0.1:5000"
    monkeypatch.setenv("MLFLOW_PORT", "5999")
    assert address("mlflow") == "http://127.0.0.1:5999"


@pytest.mark.parametrize("line", ["PREFECT_PORT 4200", "export A=1", "A=", "=1"])
def test_other_lines_are_refused(tmp_path: Path, line: str):
    path = tmp_path / "desk.env"
    path.write_text(f"# a comment\n\n{line}\n", encoding="utf-8")
    with pytest.raises(InputError, match=re.escape("line 3 sets nothing; allowed: NAME=VALUE")):
        read_settings(path)
