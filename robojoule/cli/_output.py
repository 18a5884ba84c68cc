"""What several commands print."""

from __future__ import annotations

from typing import Any


def show_head(result: dict[str, Any]) -> None:
    """Print which program on which robot."""
    print(f"{result['program']} on {result['robot']}, payload {result['payload_kg']:g} kg")


def show_loads(result: dict[str, Any]) -> None:
    """Print the largest power and torques."""
    print(
        f"largest mains power {result['peak_power_w']:.1f} W, "
        f"largest torque {100.0 * result['peak_torque_ratio']:.1f} % of its peak limit, "
        f"{100.0 * result['rms_torque_ratio']:.1f} % of the continuous one (root mean square)"
    )


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
