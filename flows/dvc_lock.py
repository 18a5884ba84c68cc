"""Files of DVC that a kill tore, mended before it runs: `python -m flows.dvc_lock`.

DVC rewrites two kinds in place and refuses to work with a torn one: its note of what its processes read and write,
before and after each stage, and `dvc.lock`, after each stage. The note is of processes, so that nothing is lost with it
once they are gone. The lock file comes back as committed; what stages made since then is in DVC's cache of runs.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import yaml

from flows.command import told
from robojoule.errors import InputError

LOCK_FILES = ("dvc.lock", "studies/dvc.lock")
_PAUSE_S = 1.0  # far longer than DVC takes to write one


def mend_locks(root: Path) -> list[str]:
    """Mend what a kill tore, unless a process of DVC is just writing it.

    Args:
        root: Folder of `dvc.yaml`.

    Returns:
        What was done, a sentence for each file.

    Raises:
        InputError: A file cannot be read or taken away.
    """
    said = []
    if _note_mended(root / ".dvc/tmp/rwlock"):
        said.append(".dvc/tmp/rwlock was torn by a kill; DVC makes it anew")
    for name in LOCK_FILES:
        if _lock_file_torn(root / name):
            said.append(_lock_file_mended(root, name))
    return said


def _note_mended(note: Path) -> bool:
    try:
        if not _note_torn(note):
            return False
        with note.with_suffix(".lock").open("a") as guard:  # the one that DVC takes around each change
            fcntl.flock(guard, fcntl.LOCK_EX)
            if torn := _note_torn(note):
                note.unlink()
            return torn
    except OSError as error:
        raise InputError(f"cannot be mended: {error.strerror}", file=note) from None


def _note_torn(note: Path) -> bool:
    try:
        json.loads(note.read_bytes())
    except FileNotFoundError:
        return False
    except ValueError:
        return True
    return False


def _lock_file_torn(path: Path) -> bool:
    """Whether a lock file is there in part, and stays so; conflicts that a merge left are their owner's to mend."""
    try:
        content = path.read_bytes()
        if b"<<<<<<<" in content or not _in_part(content):
            return False
        time.sleep(_PAUSE_S)
        return path.read_bytes() == content
    except FileNotFoundError:
        return False
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None


def _in_part(content: bytes) -> bool:
    try:
        found = yaml.safe_load(content)
    except (yaml.YAMLError, UnicodeDecodeError):
        return True
    return not isinstance(found, dict) or "schema" not in found or any(value is None for value in _values(found))


def _values(found: object) -> Iterator[object]:
    if isinstance(found, dict | list):
        for value in found.values() if isinstance(found, dict) else found:
            yield from _values(value)
    else:
        yield found


def _lock_file_mended(root: Path, name: str) -> str:
    path, kept = root / name, root / ".dvc/tmp" / f"{Path(name).parent.name or 'root'}-dvc.lock.torn"
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        path.replace(kept)
    except OSError as error:
        raise InputError(f"cannot be mended: {error.strerror}", file=path) from None
    words = ["git", "checkout", "--quiet", "HEAD", "--", name]
    try:
        restored = subprocess.run(words, cwd=root, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:  # no Git, as where an archive was downloaded
        restored = False
    how = "the committed one is back" if restored else "DVC makes it anew"
    return f"{name} was torn by a kill; {how}, and what is left of it is in {kept.relative_to(root)}"


def main() -> None:
    """Mend the files of the project in this folder."""
    argparse.ArgumentParser(prog="python -m flows.dvc_lock", description=__doc__.splitlines()[0]).parse_args()
    with told("flows.dvc_lock"):
        for line in mend_locks(Path()):
            print(line)


if __name__ == "__main__":
    main()
