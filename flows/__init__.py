"""Prefect flows: scheduling, retries and artifacts around the DVC stages, and the servers that they report to."""

import sys

import stages  # noqa: F401  # sets how their processes compute, before numpy is loaded
from flows.command import tell_interrupts

tell_interrupts(sys.orig_argv)  # before the others are loaded

from flows.own_server import start_ahead  # noqa: E402
from reproduction.settings import apply_settings  # noqa: E402

apply_settings()  # before Prefect is loaded, which reads them then
start_ahead(sys.orig_argv)  # beside that
