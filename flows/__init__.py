"""Prefect flows: scheduling, retries and artifacts around the DVC stages."""
