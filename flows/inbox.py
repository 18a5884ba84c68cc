"""The inbox, into which people and machines copy logs: a watch tells the server of each that is whole.

`python -m flows.inbox` looks every few seconds, as on network drives nothing else tells of a new file. The deployment's
own schedule looks as well, so that no log is lost with an event.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import time
from collections.abc import Callable
from pathlib import Path

from prefect.events import Event, Resource
from prefect.events.clients import get_events_client

from flows.command import told

EVENT = "robojoule.log.arrived"
INBOX = Path(".desk/inbox")
SUFFIXES = (".csv", ".parquet", ".gz")
EVERY_S = 5.0
SETTLED_S = 4.0  # less than between two looks, so that what the watch tells of is taken at once

Seen = dict[Path, tuple[int, int]]


def logs_in(folder: Path) -> Seen:
    """Logs of a folder with their size and the moment of their last change (of content or name), by name."""
    found = {}
    for path in sorted(folder.glob("[!.]*")):
        try:
            if path.suffix.lower() in SUFFIXES and path.is_file():
                state = path.stat()
                found[path] = (state.st_size, state.st_ctime_ns)
        except OSError:  # taken away in between
            continue
    return found


def whole_logs(folder: Path, pause_s: float = 1.0, settled_s: float = SETTLED_S) -> list[Path]:
    """Logs of a folder that do not change any more: a large one takes its time to be copied.

    Args:
        folder: The inbox.
        pause_s: Time between two looks. [s]
        settled_s: Least time since the last change, which a copy that stalls does not reach. [s]
    """
    before = logs_in(folder)
    if not before:
        return []
    time.sleep(pause_s)
    latest_ns = time.time_ns() - round(1e9 * settled_s)
    return [path for path, state in logs_in(folder).items() if before.get(path) == state and state[1] <= latest_ns]


class Watch:
    """What was seen in an inbox, and told of.

    Args:
        folder: The inbox; it need not be there yet.
        tell: Told of each log that is new or was changed, once it did not change between two looks.
    """

    def __init__(self, folder: Path, tell: Callable[[Path], None]) -> None:
        self._folder, self._tell = folder, tell
        self._seen: Seen = {}
        self._told: Seen = {}

    def look(self) -> None:
        """Look once, and tell; what fails to be told is tried again at the next look, and the first error raised."""
        errors = []
        now = logs_in(self._folder)
        self._told = {path: state for path, state in self._told.items() if now.get(path) == state}
        for path, state in now.items():
            if path not in self._told and self._seen.get(path) == state:
                try:
                    self._tell(path)
                    self._told[path] = state
                except Exception as error:  # of whatever kind: the other logs are told of
                    errors.append(error)
        self._seen = now
        if errors:
            raise errors[0]


def tell_server(log: Path) -> None:
    """Send the event of a log; each on a connection of its own, as servers come and go."""

    async def send() -> None:
        async with get_events_client(reconnection_attempts=0) as client:
            await client.emit(
                Event(event=EVENT, resource=Resource({"prefect.resource.id": f"robojoule.log.{log.name}"}))
            )

    asyncio.run(send())
    print(f"{log.name} arrived", flush=True)


def main() -> None:
    """Watch until it is ended."""
    parser = argparse.ArgumentParser(prog="python -m flows.inbox", description=__doc__.splitlines()[0])
    parser.add_argument("--inbox", type=Path, default=INBOX, help=f"folder (default: {INBOX})")
    inbox = parser.parse_args().inbox
    watch = Watch(inbox, tell_server)
    print(f"looks into {inbox} every {EVERY_S:g} s", flush=True)
    with told("flows.inbox"):
        while True:
            try:
                watch.look()
            # Prefect raises many kinds for a server that is away; it may be back at the next look.
            except Exception as error:
                print(f"flows.inbox: the server is not told yet: {error}", file=sys.stderr, flush=True)
            time.sleep(EVERY_S)


if __name__ == "__main__":
    main()
