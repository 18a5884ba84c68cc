"""DVC's note of what its processes read and write, where a kill tore it: `python -m flows.dvc_lock`.

DVC rewrites that file in place before and after each stage and refuses to work with a torn one. What it says is of
processes, so that nothing is lost with it once they are gone.
"""

from __future__ import annotations

import argparse
import fcntl
import json
from pathlib import Path

from flows.command import told
from robojoule.errors import InputError


def mend_lock(root: Path) -> bool:
    """Take a torn note away, unless a process of DVC is just writing it.

    Args:
        root: Folder of `dvc.yaml`.

    Returns:
        Whether it was torn.

    Raises:
        InputError: It cannot be read or taken away.
    """
    note = root / ".dvc/tmp/rwlock"
    try:
        if not _torn(note):
            return False
        with note.with_suffix(".lock").open("a") as guard:  # the one that DVC takes around each change
            fcntl.flock(guard, fcntl.LOCK_EX)
            if torn := _torn(note):
                note.unlink()
            return torn
    except OSError as error:
        raise InputError(f"cannot be mended: {error.strerror}", file=note) from None


def _torn(note: Path) -> bool:
    try:
        json.loads(note.read_bytes())
    except FileNotFoundError:
        return False
    except ValueError:
        return True
    return False


def main() -> None:
    """Mend the note of the project in this folder."""
    argparse.ArgumentParser(prog="python -m flows.dvc_lock", description=__doc__.splitlines()[0]).parse_args()
    with told("flows.dvc_lock"):
        if mend_lock(Path()):
            print(".dvc/tmp/rwlock was torn by a kill; DVC makes it anew")


if __name__ == "__main__":
    main()
