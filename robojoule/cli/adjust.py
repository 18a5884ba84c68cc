"""`robojoule adjust`: a plan made again from what a trial of it took on the machine."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojoule.cli._arguments import (
    add_bounds,
    add_diff,
    add_measurements,
    add_model,
    add_program,
    add_robot,
    add_speed_step,
    check_outputs,
    number,
    program_and_robot_of,
    save_plan,
    wishes_of,
)
from robojoule.cli._models import model_folder
from robojoule.cli._output import payloads_kg
from robojoule.cli.optimize import show

if TYPE_CHECKING:
    from robojoule.formats.program import Program
    from robojoule.robots.robot import Robot

__all__ = ["add_arguments", "run", "show"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The plan that ran, what was measured, and output."""
    add_program(parser)
    add_robot(parser, named_by_program=True)
    parser.add_argument("--measured-cycle", type=number, metavar="S", help="what the cycle took on the machine [s]")
    parser.add_argument(
        "--cycle-time",
        metavar="T",
        help="cycle time asked for [s] (default: the one that the plan was made for, which YAML and JSON files say)",
    )
    parser.add_argument(
        "--given",
        type=Path,
        metavar="PROGRAM",
        help="the program that the plan was made from: its speed limits bound the new plan (YAML and JSON files of "
        "plans say them)",
    )
    parser.add_argument(
        "--allow-faster", action="store_true", help="let moves be faster than the program's own speed limits"
    )
    add_speed_step(parser)
    add_measurements(parser)
    add_model(parser)
    add_bounds(parser)
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the program with the new plan here")
    add_diff(parser)


def _given(arguments: argparse.Namespace, plan: Program, robot: Robot) -> Program:
    """The program that a plan was made from; the lengths of its waits are given by the lines of the plan."""
    from robojoule.formats.program import load_program

    given = load_program(arguments.given)
    if given.source is not None and plan.source is not None:
        beside = replace(plan.source.beside, waits_s=plan.source.waits_for(given.source))
        given = load_program(arguments.given, beside=beside)
    return (given if arguments.angles is None else given.counted_as(arguments.angles)).for_robot(robot)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Plan again, and write what is asked for."""
    from robojoule.api import adjust
    from robojoule.formats.registry import FORMATS

    suffixes = [suffix for one in FORMATS for suffix in one.suffixes]
    check_outputs(arguments, ["robot", "runs", "given"], {"out": suffixes})
    program, robot = program_and_robot_of(arguments)
    given = None if arguments.given is None else _given(arguments, program, robot)
    with model_folder(arguments.model) as model:
        plan = adjust(
            program,
            robot,
            measured_cycle=arguments.measured_cycle,
            given=given,
            allow_faster=arguments.allow_faster,
            model=model,
            **wishes_of(arguments),
        )
    lost = () if arguments.out is None else save_plan(plan, arguments.out, robot)
    told = {"payloads_kg": payloads_kg(program, robot), "program_notes": [*program.notes, *lost]}
    told |= {"diff": plan.program.diff()} if arguments.diff else {}
    return {**plan.to_dict(), **told, "out": str(arguments.out) if arguments.out is not None else None}
