"""The Prefect server that a command started by hand reports to: the one that is named, or one of its own.

A server of its own has a store of its own, which goes with it: what is tried by hand does not show up among scheduled
runs.
"""

from __future__ import annotations

import atexit
import contextlib
import logging
import os
import sys
from collections.abc import Iterator

import httpx
from prefect.context import refresh_global_settings_context
from prefect.events.worker import EventsWorker
from prefect.logging.handlers import APILogWorker
from prefect.settings import (
    PREFECT_API_URL,
    PREFECT_CLIENT_MAX_RETRIES,
    temporary_settings,
)

from flows.own_server import drop_ahead, own_server
from flows.service import answers
from reproduction.layout import Layout
from robojoule.errors import RobojouleError

_TRIES = 3  # within some 15 s, to reach a server that nobody else would start again; Prefect's own are a minute


@contextlib.contextmanager
def prefect_server(layout: Layout) -> Iterator[str]:
    """A Prefect server for this process and those that it starts.

    Args:
        layout: Folder of the project; the empty store is kept there.

    Yields:
        Its address.

    Raises:
        RobojouleError: The server does not answer, from the beginning or any more.
    """
    named = PREFECT_API_URL.value()
    if named:
        drop_ahead()
        if not answers(f"{named}/health"):
            raise RobojouleError(
                f"no Prefect server answers at {named}; start it (`make up`), or unset PREFECT_API_URL to do without"
            )
        with _lost(str(named)):
            yield str(named)
        return
    with (
        own_server(layout) as url,
        temporary_settings({PREFECT_API_URL: url, PREFECT_CLIENT_MAX_RETRIES: _TRIES}),
    ):
        os.environ["PREFECT_API_URL"] = url
        # For threads that Prefect starts: without an address, those of its process pool start one more server.
        refresh_global_settings_context()
        try:
            with _lost(url):
                try:
                    yield url
                finally:
                    if answers(f"{url}/health"):
                        drain()
        finally:
            os.environ.pop("PREFECT_API_URL", None)
            refresh_global_settings_context()


class _WithoutTraces(logging.Filter):
    """Takes the traces out of what Prefect says of a server that is away: one sentence at the end tells it."""

    def filter(self, record: logging.LogRecord) -> bool:
        if record.exc_info and isinstance(record.exc_info[1], httpx.TransportError | ConnectionError):
            record.exc_info = record.exc_text = None
        return True


@contextlib.contextmanager
def _lost(url: str) -> Iterator[None]:
    """Tell of a server that went away in the middle of a run, after Prefect's own tries."""
    for name in ("prefect", "prefect.flow_runs", "prefect.task_runs"):
        for handler in logging.getLogger(name).handlers:
            handler.addFilter(_WithoutTraces())
    try:
        yield
    except httpx.TransportError:
        logging.raiseExceptions = False  # Prefect says each time by this switch that a log did not get through
        atexit.register(_leave)  # registered last, it comes first: before threads of Prefect that would try on
        raise RobojouleError(
            f"the Prefect server at {url} no longer answers; give the same command again when one does: "
            "what was finished is kept"
        ) from None


def _leave() -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(1)


def drain() -> None:
    """Send what Prefect's threads still hold, before its server stops: else they try for a minute to reach it."""
    APILogWorker.instance().drain()
    EventsWorker.drain_all()
