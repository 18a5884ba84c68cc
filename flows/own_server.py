"""A Prefect server of this process: on the loopback interface, without a page, gone when this process is.

Prefect has such a server, too, but to start it loads the server's code into this process and into every worker that
imports the flow: for each of them that takes as long as the start of the server itself.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from prefect.settings import PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS, get_current_settings

from flows import lifeline
from flows.service import answers, free_port
from robojoule.errors import RobojouleError

_ATTEMPTS = 3  # another process may take the port in between
_POLL_S = 0.1


@contextmanager
def own_server() -> Iterator[str]:
    """Start a server with the settings of this process, and end it.

    Yields:
        Its address.

    Raises:
        RobojouleError: It does not start.
    """
    patience_s = PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS.value()
    end = time.monotonic() + patience_s
    for _ in range(_ATTEMPTS):
        port = free_port()
        url = f"http://127.0.0.1:{port}/api"
        process = _started(port)
        try:
            while process.poll() is None and time.monotonic() < end:
                if answers(f"{url}/health"):
                    yield url
                    return
                time.sleep(_POLL_S)
        finally:
            lifeline.cut(process)
        if time.monotonic() >= end:
            break
    if time.monotonic() >= end:
        raise RobojouleError(
            f"the Prefect server of this command did not answer within {patience_s} s; a busy machine may need "
            "a larger PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS"
        )
    raise RobojouleError("the Prefect server of this command did not start; what it says is above")


def _started(port: int) -> subprocess.Popen[bytes]:
    server = "uvicorn --factory prefect.server.api.server:create_app --host 127.0.0.1 --log-level error --lifespan on"
    return subprocess.Popen(
        [sys.executable, str(Path(lifeline.__file__)), sys.executable, "-m", *server.split(), "--port", str(port)],
        stdin=subprocess.PIPE,
        env={
            **os.environ,
            **get_current_settings().to_environment_variables(exclude_unset=True),
            "PREFECT_UI_ENABLED": "0",
            "PREFECT__SERVER_EPHEMERAL": "1",
            "PREFECT__SERVER_FINAL": "1",
        },
    )
