"""Clones of the project in which scheduled runs work: the folder itself stays as it is, and runs do not meet in it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

from reproduction.layout import Layout
from robojoule.documents import write_text
from robojoule.errors import InputError


@contextmanager
def scratch_clone(root: Path) -> Iterator[Path]:
    """A clone of the last commit, with the cache of the project, for as long as it is needed.

    Clones of runs that were killed are removed.

    Args:
        root: Folder of the project.

    Raises:
        InputError: It is not a Git checkout, or nothing can be written.
    """
    root = root.resolve()
    clones = Layout(root).desk_dir / "clones"
    for left in clones.glob("*"):
        if not psutil.pid_exists(int(left.name.partition("-")[0])):
            shutil.rmtree(left, ignore_errors=True)
    clone = clones / f"{os.getpid()}-{len(list(clones.glob('*')))}"
    cache = _said("dvc", [sys.executable, "-m", "dvc", "cache", "dir"], root)
    try:
        _said("git", ["git", "clone", "--quiet", "--local", "--no-tags", str(root), str(clone)], root)
        write_text(clone / ".dvc/config.local", f"[cache]\n    dir = {cache}\n")
        yield clone
    finally:
        shutil.rmtree(clone, ignore_errors=True)


def _said(tool: str, words: list[str], folder: Path) -> str:
    """What a command prints."""
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = [line.strip() for line in done.stderr.splitlines() if line.strip()] or ["no output"]
        problem = lines[-1].removeprefix("fatal: ").removeprefix("ERROR: ")
        raise InputError(
            f"a scheduled run works in a clone of the last commit, but {tool} says: {problem}", file=folder
        )
    return done.stdout.strip()
