"""`robojoule simulate`: what one cycle of a program takes as it stands."""

from __future__ import annotations

import argparse
from typing import Any

from robojoule.cli._arguments import add_program, add_robot, program_and_robot_of
from robojoule.cli._output import payloads_kg, show_head, show_loads, show_moves


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Program and robot."""
    add_program(parser)
    add_robot(parser, named_by_program=True)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Simulate the program with its own speed limits and waits."""
    from robojoule.api import simulate

    program, robot = program_and_robot_of(arguments)
    cycle = simulate(program, robot)
    head = {"program": program.name, "robot": robot.name, "payload_kg": float(robot.payload.mass_kg)}
    head["payloads_kg"] = payloads_kg(program, robot)
    return {**head, **cycle.to_dict(), "program_notes": list(program.notes)}


def show(result: dict[str, Any]) -> None:
    """Print the cycle and its moves."""
    show_head(result)
    print(f"cycle time {result['cycle_time_s']:.4f} s, energy {result['energy_j']:.1f} J per cycle")
    show_loads(result)
    show_moves(result)
