"""What several commands print."""

from __future__ import annotations

from typing import Any


def show_head(result: dict[str, Any]) -> None:
    """Print which program on which robot."""
    print(f"{result['program']} on {result['robot']}, payload {result['payload_kg']:g} kg")


def show_moves(result: dict[str, Any]) -> None:
    """Print the moves as a table, and what to know."""
    width = max(len("move"), *(len(move["name"]) for move in result["moves"]))
    print(f"{'move':{width}}  speed limit [%]  duration [s]  wait before [s]  wait after [s]  energy [J]")
    for move in result["moves"]:
        print(
            f"{move['name']:{width}}  {move['speed_limit_percent']:15.2f}  {move['duration_s']:12.4f}  "
            f"{move['wait_before_s']:15.4f}  {move['wait_after_s']:14.4f}  {move['energy_j']:10.1f}"
        )
    for warning in result["warnings"]:
        print(f"warning: {warning}")


def show_written(result: dict[str, Any], *names: str) -> None:
    """Print the files that were written, each under the name of its option."""
    for name in names:
        if result[name]:
            print(f"written to {result[name]}")
