"""`robojoule simulate`: what one cycle of a program takes as it stands."""

from __future__ import annotations

import argparse
from typing import Any

from robojoule.cli._arguments import add_program, add_robot, program_and_robot_of
from robojoule.cli._output import show_head, show_loads, show_moves


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Program and robot."""
    add_program(parser)
    add_robot(parser, named_by_program=True)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Simulate the program with its own speed limits and waits."""
    from robojoule.api import simulate
    from robojoule.planning.cycle_run import cycle_warnings
    from robojoule.planning.path_checks import collision_warnings
    from robojoule.planning.section_plans import has_sections, section_programs, section_warning
    from robojoule.programs.tree_check import in_model_angles, robot_warnings

    program, robot = program_and_robot_of(arguments)
    cycle = simulate(program, robot)
    sections = section_programs(program)
    return {
        "program": program.name,
        "robot": robot.name,
        "payload_kg": float(robot.payload.mass_kg),
        **cycle.to_dict(),
        "warnings": [
            *robot_warnings(program.tree, robot),
            *(text for one in sections for text in collision_warnings(in_model_angles(one.tree, robot), robot)),
            *cycle_warnings(program.tree, cycle),
            *([section_warning(program, len(sections))] if has_sections(program) else []),
        ],
        "notes": list(program.notes),
    }


def show(result: dict[str, Any]) -> None:
    """Print the cycle and its moves."""
    show_head(result)
    print(f"cycle time {result['cycle_time_s']:.4f} s, energy {result['energy_j']:.1f} J per cycle")
    show_loads(result)
    show_moves(result)
