"""What contributors and build servers rely on: no test is left out in silence."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.conftest import ROOT
from tests.imports import imports, module_name, python_files

SKIPPED = """
import pytest

@pytest.mark.skipif(True, reason="there is no browser")
def test_mark():
    pass

def test_call():
    pytest.skip("there is no server")

@pytest.mark.xfail(reason="known")
def test_known():
    raise AssertionError
"""


def outcome(folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Pytest with the suite's hooks on a file of its own."""
    path = folder / "test_skipped.py"
    path.write_text(SKIPPED, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.conftest"]
    config = ["-c", str(ROOT / "pyproject.toml"), "--rootdir", str(ROOT)]
    variables = {key: value for key, value in os.environ.items() if key != "ROBOJOULE_NO_SKIPS"} | environment
    return subprocess.run([*command, *config, str(path)], cwd=ROOT, env=variables, capture_output=True, text=True)


def test_skipped_tests_are_named(tmp_path: Path):
    done = outcome(tmp_path)
    assert done.returncode == 0
    assert "there is no browser" in done.stdout and "there is no server" in done.stdout
    assert done.stdout.splitlines()[-1].startswith("2 skipped, 1 xfailed")


def test_a_build_server_fails_if_a_test_is_skipped(tmp_path: Path):
    done = outcome(tmp_path, ROBOJOULE_NO_SKIPS="1")
    assert done.returncode == 1
    assert "there is no browser" in done.stdout and "there is no server" in done.stdout
    assert done.stdout.splitlines()[-1].startswith("1 failed, 1 xfailed, 1 error")  # a mark acts at set-up


@pytest.mark.parametrize("path", python_files("tests"), ids=module_name)
def test_no_test_needs_a_package_that_some_platforms_lack(path: Path):
    """It asks for it by `pytest.importorskip` where it is used, so that the rest of its module runs everywhere."""
    assert not {name.split(".")[0] for name, _ in imports(path)} & {"pinocchio", "coal", "ruckig"}


def test_a_commit_is_checked_as_lint_checks():
    """The hooks run the tools of `make lint`, from the same environment."""
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0]["hooks"]
    lint = re.search(r"^lint:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)
    commands = [line.split("$(PY) ")[1].split() for line in lint[1].splitlines()]
    assert [hook["entry"].split()[0] for hook in hooks] == [".venv/bin/python"] * len(commands)
    for hook, command in zip(hooks, commands, strict=True):
        assert [word for word in command if word != "."] == [
            w for w in hook["entry"].split()[1:] if w != "--force-exclude"
        ]
