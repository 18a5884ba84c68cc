"""A command that ends with the process that started it, however that ends: `python flows/lifeline.py COMMAND ...`.

That process holds the other end of the standard input and writes nothing: when it is gone, the pipe ends, and the
command is killed with its whole process group. A folder that is named by `FOLDER` goes with it. Started by its path, as
it needs nothing of the project and has to start at once.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from typing import Any

FOLDER = "ROBOJOULE_LIFELINE_FOLDER"  # variable that names a folder of the command alone, to be removed at its end


def cut(process: subprocess.Popen[Any]) -> None:
    """End a command that was started this way, also one whose lifeline alone was killed."""
    assert process.stdin is not None
    process.stdin.close()
    process.wait()
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def _end_with_the_pipe(process: subprocess.Popen[Any], folder: str | None) -> None:
    while os.read(0, 1024):
        pass
    if folder is not None:
        process.kill()
        process.wait()
        _remove(folder)
    os.killpg(0, signal.SIGKILL)


def _remove(folder: str) -> None:
    import shutil  # takes as long to load as all others of this file

    shutil.rmtree(folder, ignore_errors=True)


def main() -> None:
    """Run the command; its exit code is this one's."""
    if os.getpgrp() != os.getpid():
        os.setpgid(0, 0)
    folder = os.environ.pop(FOLDER, None)
    process = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL)
    threading.Thread(target=_end_with_the_pipe, args=(process, folder), daemon=True).start()
    code = process.wait()
    if folder is not None:
        _remove(folder)
    raise SystemExit(code)


if __name__ == "__main__":
    main()
