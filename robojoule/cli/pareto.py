"""`robojoule pareto`: least energy over cycle time, and what one more second of cycle time is worth."""

from __future__ import annotations

import argparse
import csv
import io
from pathlib import Path
from typing import Any

from robojoule.cli._arguments import (
    add_model,
    add_profiles,
    add_program,
    add_robot,
    add_runs,
    add_slowest,
    check_outputs,
    program_and_robot_of,
    trade_off_of,
)
from robojoule.cli._models import model_folder
from robojoule.cli._output import payloads_kg, show_head, show_loads, show_written

_ROWS_SHOWN = 12


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Program, robot, range and outputs."""
    add_program(parser)
    add_robot(parser, named_by_program=True)
    parser.add_argument(
        "--until",
        choices=("least", "waiting"),
        default="least",
        help="end at the cycle time with the least energy, or where all further time is waited (default: least)",
    )
    parser.add_argument(
        "--allow-faster", action="store_true", help="let moves be faster than the program's own speed limits"
    )
    add_slowest(parser)
    add_profiles(parser)
    add_model(parser)
    add_runs(parser)
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write every breakpoint of the curve here")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw energy and marginal power here (.svg)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Compute the curve, and write what is asked for."""
    from robojoule.documents import write_files

    check_outputs(arguments, ["program", "robot", "runs"], {"csv": [".csv"], "plot": [".svg"]})
    program, robot = program_and_robot_of(arguments)
    with model_folder(arguments.model) as model:
        result = trade_off_of(arguments, program, robot, model).to_dict(until=arguments.until)
    contents: dict[Path, str | bytes] = {}
    if arguments.csv is not None:
        text = io.StringIO()
        rows = [{**point, "standby": "no"} for point in result["points"]]
        if result["standby"] is not None:
            rows += [{**point, "standby": "yes"} for point in result["standby"]["points"]]
        columns = [*result["points"][0], *(["standby"] if result["standby"] is not None else [])]
        writer = csv.DictWriter(text, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({key: f"{value:.9g}" if isinstance(value, float) else value for key, value in row.items()})
        contents[arguments.csv] = text.getvalue()
    if arguments.plot is not None:
        from robojoule.plots.pareto import drawing_of

        contents[arguments.plot] = drawing_of(result)
    write_files(contents)
    result["payloads_kg"] = payloads_kg(program, robot)
    return {**result, **{name: str(path) if (path := getattr(arguments, name)) else None for name in ("csv", "plot")}}


def show(result: dict[str, Any]) -> None:
    """Print the curve at some of its breakpoints."""
    show_head(result)
    print(
        f"fastest cycle {result['least_cycle_time_s']:.4f} s, {result['energy_fastest_j']:.1f} J; "
        f"least energy {result['best_energy_j']:.1f} J at {result['best_cycle_time_s']:.4f} s; from "
        f"{result['waiting_cycle_time_s']:.4f} s on more time is waited at {result['waiting_power_w']:.1f} W"
    )
    show_loads(result, "in the fastest cycle: ")
    print("cycle time [s]  energy [J]  marginal power [W]")
    points = result["points"]
    shown = range(0, len(points), max(len(points) // _ROWS_SHOWN, 1))
    for index in dict.fromkeys((*shown, len(points) - 1)):
        point = points[index]
        print(f"{point['cycle_time_s']:14.4f}  {point['energy_j']:10.1f}  {point['marginal_power_w']:18.1f}")
    print(
        f"{len(points)} breakpoints from {result['simulated_runs']} simulated runs of {result['moves']} moves; "
        f"at most {result['largest_gap_percent']:.3f} % above the proven bound"
    )
    if (standby := result["standby"]) is not None:
        print(
            f"with waits in standby: least energy {standby['best_energy_j']:.1f} J at "
            f"{standby['best_cycle_time_s']:.4f} s; at most {standby['largest_gap_percent']:.3g} % above the bound"
        )
        _show_standby(standby["points"])
    if result["hull_excess_j"] > 0.0:
        print(
            f"a profile is not convex: between breakpoints the curve may be up to {result['hull_excess_j']:.2f} J low"
        )
    for warning in result["warnings"]:
        print(f"warning: {warning}")
    show_written(result, "csv", "plot")


def _show_standby(points: list[dict[str, float]]) -> None:
    """Print the trade-off with standby at some of its cycle times."""
    print("cycle time [s]  energy with standby [J]")
    for index in dict.fromkeys((*range(0, len(points), max(len(points) // _ROWS_SHOWN, 1)), len(points) - 1)):
        print(f"{points[index]['cycle_time_s']:14.4f}  {points[index]['energy_j']:23.1f}")
