"""Questions to servers of Prefect and MLflow, in JSON."""

import json
import time
import urllib.error
import urllib.request
from typing import Any

ATTEMPTS = 8


def ask(api: str, path: str, body: dict[str, Any], method: str = "POST") -> Any:
    """What a server answers; asked again while it says that it is busy (503), as the clients of Prefect do.

    Prefect's server says so where another of its transactions holds SQLite's lock; it then has changed nothing.

    Raises:
        urllib.error.HTTPError: It refuses, or is busy to the end.
    """
    request = urllib.request.Request(
        f"{api}/{path}", json.dumps(body).encode(), {"content-type": "application/json"}, method=method
    )
    for attempt in range(ATTEMPTS):
        try:
            with urllib.request.urlopen(request, timeout=60) as reply:
                text = reply.read()
                return json.loads(text) if text else None
        except urllib.error.HTTPError as error:
            if error.code != 503 or attempt == ATTEMPTS - 1:
                raise
        time.sleep(2**attempt / 4)
    raise AssertionError("unreachable")


def artifacts(api: str, key: str) -> list[dict[str, Any]]:
    """Prefect's artifacts of a key, newest first."""
    found: list[dict[str, Any]] = ask(
        api, "artifacts/filter", {"artifacts": {"key": {"any_": [key]}}, "sort": "CREATED_DESC"}
    )
    return found
