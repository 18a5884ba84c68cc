"""Prefect flows: scheduling, retries and artifacts around the DVC stages, and the servers that they report to."""

import sys

import stages  # noqa: F401  # sets how their processes compute, before numpy is loaded
from flows.own_server import start_ahead
from reproduction.settings import apply_settings

apply_settings()  # before Prefect is loaded, which reads them then
start_ahead(sys.orig_argv)  # beside that
