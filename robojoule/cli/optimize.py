"""`robojoule optimize`: the plan with the least energy for a cycle time, written back into the program."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from robojoule.cli._arguments import (
    add_bounds,
    add_measurements,
    add_profiles,
    add_program,
    add_robot,
    add_slowest,
    check_outputs,
    number,
    program_of,
    robot_of,
    wishes_of,
)
from robojoule.cli._output import show_head, show_loads, show_moves, show_outlook, show_written


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Program, robot, cycle time and output."""
    add_program(parser)
    add_robot(parser, named_by_program=True)
    parser.add_argument(
        "--cycle-time",
        required=True,
        metavar="T",
        help="seconds (7.5), or a share above the cycle time of the program as given, waits included (+10%%)",
    )
    parser.add_argument(
        "--allow-faster", action="store_true", help="let moves be faster than the program's own speed limits"
    )
    parser.add_argument(
        "--speed-step",
        type=number,
        default=1.0,
        metavar="PERCENT",
        help="step of speed limits that the controller takes [%%] (default: 1, whole percents)",
    )
    add_slowest(parser)
    add_measurements(parser)
    add_profiles(parser)
    add_bounds(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the program with speed limits and waits here; it may be PROGRAM itself, the rest of which is kept",
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Plan, and write what is asked for."""
    from robojoule.api import optimize
    from robojoule.formats.registry import FORMATS

    suffixes = [suffix for one in FORMATS for suffix in one.suffixes]
    check_outputs(arguments, ["robot", "runs"], {"out": suffixes})
    program = program_of(arguments)
    plan = optimize(
        program,
        robot_of(arguments, program),
        allow_faster=arguments.allow_faster,
        slowest_speed_limit_percent=arguments.slowest_speed_limit,
        profiles=arguments.profiles,
        **wishes_of(arguments),
    )
    if arguments.out is not None:
        plan.save(arguments.out)
    return {**plan.to_dict(), "out": str(arguments.out) if arguments.out is not None else None}


def show(result: dict[str, Any]) -> None:
    """Print the plan."""
    show_head(result)
    print(f"cycle time {result['cycle_time_s']:.4f} s (fastest {result['least_cycle_time_s']:.4f} s)")
    if result["profiles"] == "measured":
        print(f"energy {result['energy_j']:.1f} J per cycle, by the measured runs")
    else:
        gap = result["gap_to_optimum_percent"]
        print(f"energy {result['energy_j']:.1f} J per cycle, at most {gap:.4f} % above the optimum")
    for name, energy, saving in (
        ("the program as given", "energy_given_j", "saving_percent"),
        *(
            [("the same with motors on in all waits", "energy_given_motors_on_j", "saving_over_motors_on_percent")]
            if result["energy_given_motors_on_j"] > result["energy_given_j"]
            else []
        ),
        ("full speed, then waiting", "energy_unoptimized_j", "saving_over_unoptimized_percent"),
    ):
        print(f"  {name}: {result[energy]:.1f} J; the plan takes {_compared(result[saving])}")
    show_loads(result)
    show_outlook(result)
    show_moves(result)
    show_written(result, "out")


def _compared(saving_percent: float) -> str:
    return f"{abs(saving_percent):.2f} % {'more' if saving_percent < 0.0 else 'less'}"
