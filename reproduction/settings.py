"""Settings of the tools around the pipeline, from `desk.env`: where they listen, and that they report nothing."""

from __future__ import annotations

import os
from pathlib import Path

from robojoule.documents import read_text
from robojoule.errors import InputError

SETTINGS = Path(__file__).resolve().parents[1] / "desk.env"


def read_settings(path: Path = SETTINGS) -> dict[str, str]:
    """Names and values of the file.

    Raises:
        InputError: It is missing, or a line is neither a comment nor NAME=VALUE.
    """
    found: dict[str, str] = {}
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if line.strip() and not line.startswith("#"):
            name, _, value = line.strip().partition("=")
            if not (name.isidentifier() and value):
                raise InputError(f"line {number} sets nothing", file=path, allowed="NAME=VALUE, or a comment with #")
            found[name] = value
    return found


def apply_settings() -> None:
    """Put the settings into the environment of this process and of those that it starts; what is there stays."""
    for name, value in read_settings().items():
        os.environ.setdefault(name, value)


def address(tool: str) -> str:
    """Where a tool listens, or will.

    Args:
        tool: prefect or mlflow.
    """
    prefix = {"prefect": "PREFECT_SERVER_API", "mlflow": "MLFLOW"}[tool]
    known = read_settings() | os.environ
    return f"http://{known[f'{prefix}_HOST']}:{known[f'{prefix}_PORT']}"
