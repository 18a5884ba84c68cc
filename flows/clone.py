"""Clones of the project in which scheduled runs work: the folder itself stays as it is, and runs do not meet in it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flows.service import ProcessFile, process_of
from reproduction.layout import Layout
from robojoule.documents import load, write_document, write_text
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
    for file in clones.glob("[!.]*.json"):
        if not _is_in_use(file):
            _remove(file)
    file = clones / f"{uuid.uuid4().hex}.json"
    clone = file.with_suffix("")
    cache = _said("dvc", [sys.executable, "-m", "dvc", "cache", "dir"], root)
    write_document(file, ProcessFile.of(os.getpid()).model_dump(mode="json"))  # before there is anything to remove
    try:
        _said("git", ["git", "clone", "--quiet", "--local", "--no-tags", str(root), str(clone)], root)
        write_text(clone / ".dvc/config.local", f"[cache]\n    dir = {cache}\n")
        yield clone
    finally:
        _remove(file)


def _is_in_use(file: Path) -> bool:
    """Whether the process lives that made a clone; its file stands beside it."""
    try:
        return process_of(load(ProcessFile, file)) is not None
    except InputError:  # removed meanwhile, or torn by hand
        return False


def _remove(file: Path) -> None:
    shutil.rmtree(file.with_suffix(""), ignore_errors=True)
    file.unlink(missing_ok=True)


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
