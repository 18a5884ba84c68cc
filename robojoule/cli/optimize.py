"""`robojoule optimize`: the plan with the least energy for a cycle time, written back into the program."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojoule.cli._arguments import (
    add_bounds,
    add_diff,
    add_measurements,
    add_model,
    add_profiles,
    add_program,
    add_robot,
    add_slowest,
    add_speed_step,
    add_year,
    check_outputs,
    choices_of,
    operation_of,
    program_and_robot_of,
    save_plan,
    trade_off_of,
    wishes_of,
)
from robojoule.cli._models import model_folder
from robojoule.cli._output import payloads_kg, show_diff, show_head, show_loads, show_moves, show_outlook, show_written
from robojoule.year import yearly

if TYPE_CHECKING:
    from robojoule.formats.program import Program
    from robojoule.page.report import Report
    from robojoule.planning.plan import Plan
    from robojoule.robots.robot import Robot
    from robojoule.year import Operation


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
    add_speed_step(parser)
    add_slowest(parser)
    add_measurements(parser)
    add_profiles(parser)
    add_model(parser)
    add_bounds(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the program with speed limits and waits here; it may be PROGRAM itself, the rest of which is kept",
    )
    add_diff(parser)
    parser.add_argument("--page", type=Path, metavar="FILE", help="write a page to look at here (.html)")
    add_year(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Plan, and write what is asked for."""
    from robojoule.api import optimize
    from robojoule.documents import all_or_none
    from robojoule.formats.registry import FORMATS
    from robojoule.planning.section_plans import refuse_sections

    suffixes = [suffix for one in FORMATS for suffix in one.suffixes]
    check_outputs(arguments, ["robot", "runs"], {"out": suffixes, "page": [".html"]})
    operation = operation_of(arguments)
    program, robot = program_and_robot_of(arguments)
    if arguments.page is not None:
        refuse_sections(program.for_robot(robot), "a page")
    with model_folder(arguments.model) as model:
        plan = optimize(
            program,
            robot,
            model=model,
            **choices_of(arguments),
            **wishes_of(arguments),
        )
        page = None if arguments.page is None else _page(arguments, plan, program, robot, operation, model)
    with all_or_none():
        lost = () if arguments.out is None else save_plan(plan, arguments.out, robot)
        if page is not None:
            page.save(arguments.page)
    year = yearly(plan.cycle_time_s, plan.energy_given_j, plan.energy_j, operation)
    written = {name: str(path) if (path := getattr(arguments, name)) else None for name in ("out", "page")}
    told = {"payloads_kg": payloads_kg(program, robot), "program_notes": [*program.notes, *lost]}
    told |= {"diff": plan.program.diff()} if arguments.diff else {}
    return {**plan.to_dict(), "yearly": year.to_dict(), **told, **written}


def _page(
    arguments: argparse.Namespace,
    plan: Plan,
    program: Program,
    robot: Robot,
    operation: Operation,
    model: Path | None,
) -> Report:
    """The page of a plan; its trade-off stands on what the plan stands on."""
    from robojoule.api import report

    curve = trade_off_of(arguments, program, robot, model)
    return report(plan, program, robot, trade_off=curve, operation=operation)


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
    if "yearly" in result:
        show_year(result["yearly"])
    show_loads(result)
    show_outlook(result)
    show_moves(result)
    show_diff(result)
    show_written(result, "out", "page")


def show_year(year: dict[str, Any]) -> None:
    """Print what a plan means in a year."""
    print(
        f"in {year['hours_per_year']:.0f} h a year: {round(abs(year['saved_kwh']))} kWh "
        f"{'more' if round(year['saved_kwh']) < 0 else 'less'}, {round(abs(year['saved_cost']))} "
        f"{year['currency']} and {round(abs(year['saved_co2_kg']))} kg CO2"
    )


def _compared(saving_percent: float) -> str:
    rounded = round(saving_percent, 2)
    return f"{abs(rounded):.2f} % {'more' if rounded < 0.0 else 'less'}"
