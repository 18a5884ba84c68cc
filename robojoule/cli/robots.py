"""`robojoule robots`: the catalog."""

from __future__ import annotations

import argparse
from typing import Any


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """No arguments of its own."""


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """List the catalog."""
    from robojoule.robots import load_robot_file, robot_names

    rows = []
    for name in robot_names():
        file = load_robot_file(name)
        rows.append(
            {
                "name": name,
                "vendor": file.vendor,
                "joints": len(file.moving_joints),
                "rated_payload_kg": file.rated_payload_kg,
                "drives": file.drives.provenance,
                "source": file.source,
                "license": file.license,
            }
        )
    return {"robots": rows}


def show(result: dict[str, Any]) -> None:
    """Print one line a robot."""
    width = max((len(row["name"]) for row in result["robots"]), default=4)
    for row in result["robots"]:
        print(f"{row['name']:{width}}  {row['joints']} joints  {row['rated_payload_kg']:6g} kg  {row['drives']}")
