"""Prefect flows: scheduling, retries and artifacts around the DVC stages."""

import stages  # noqa: F401  # sets how their processes compute, before numpy is loaded
