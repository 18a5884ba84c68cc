"""`robojoule simulate`: what one cycle of a program takes as it stands."""

from __future__ import annotations

import argparse
from typing import Any

from robojoule.cli._arguments import add_program, add_robot, robot_of
from robojoule.cli._output import show_head, show_moves


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Program and robot."""
    add_program(parser)
    add_robot(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Simulate the program with its own speed limits and waits."""
    from robojoule.api import simulate
    from robojoule.formats.program import load_program
    from robojoule.planning.cycle_run import cycle_warnings

    program, robot = load_program(arguments.program), robot_of(arguments)
    cycle = simulate(program, robot)
    return {
        "program": program.name,
        "robot": robot.name,
        "payload_kg": float(robot.payload.mass_kg),
        **cycle.to_dict(),
        "warnings": list(cycle_warnings(program.tree, cycle)),
    }


def show(result: dict[str, Any]) -> None:
    """Print the cycle and its moves."""
    show_head(result)
    print(f"cycle time {result['cycle_time_s']:.4f} s, energy {result['energy_j']:.1f} J per cycle")
    print(
        f"largest mains power {result['peak_power_w']:.1f} W, "
        f"largest torque {100.0 * result['peak_torque_ratio']:.1f} % of its peak limit, "
        f"{100.0 * result['rms_torque_ratio']:.1f} % of the continuous one (root mean square)"
    )
    show_moves(result)
